/// \file lane.hpp
/// The scalar type of the hot path: W queries side by side, one in each lane.
///
/// One template serves every width W. For W = 1 the type is a plain float, so that a
/// microcontroller runs the same source as a PC. For W > 1 the type is the compiler's vector type,
/// whose operators work element by element on any instruction set. Each lane sees the same
/// operations in the same order as a scalar. So the answer to a query does not depend on the other
/// queries of its packet.
///
/// The build sets three macros. GPOM_LANES is the width. GPOM_FMA is 1 if the processor multiplies
/// and adds in one fused instruction. GPOM_MINNUM is 1 if the processor has the minimum and maximum
/// of IEEE 754 as instructions.
#pragma once

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __aarch64__
#include <arm_neon.h>
#endif

#ifndef GPOM_LANES
#define GPOM_LANES 1
#endif
#ifndef GPOM_FMA
#define GPOM_FMA 0
#endif
#ifndef GPOM_MINNUM
#define GPOM_MINNUM 0
#endif

namespace gpom::lane
{

/// F is W floats. I and U are W integers of the same size. A comparison of two F gives a mask for
/// select().
template <int W> struct Lane {
    typedef float F __attribute__((vector_size(4 * W)));
    typedef int32_t I __attribute__((vector_size(4 * W)));
    typedef uint32_t U __attribute__((vector_size(4 * W)));
};
template <> struct Lane<1> {
    using F = float;
    using I = int32_t;
    using U = uint32_t;
};

template <class F> constexpr int width = static_cast<int>(sizeof(F) / sizeof(float));

/// How many values of type F the vector registers hold. x86 before AVX-512 has 16 registers for
/// every width. The compiler puts four plain floats in one register.
template <class F>
constexpr size_t registers =
#if defined(__x86_64__) && !defined(__AVX512F__)
    width<F> == 1 ? 64 : 16;
#else
    32;
#endif

template <class F> using IntOf = typename Lane<width<F>>::I;

/// The same value in every lane.
template <class F> inline F splat(float value)
{
    if constexpr (width<F> == 1) {
        return value;
    } else {
        return value - F{}; // not value + F{}, because -0 + 0 is +0
    }
}

template <class I> inline I splat_int(int32_t value)
{
    if constexpr (sizeof(I) == sizeof(int32_t)) {
        return value;
    } else {
        return I{} + value;
    }
}

template <class V> inline auto get(const V &lanes, int i)
{
    if constexpr (sizeof(V) == 4) {
        (void)i;
        return lanes;
    } else {
        return lanes[i];
    }
}

template <class V, class T> inline void set(V &lanes, int i, T value)
{
    if constexpr (sizeof(V) == 4) {
        (void)i;
        lanes = value;
    } else {
        lanes[i] = value;
    }
}

/// Arguments of AVX-512 operations: compute all lanes, in the rounding mode that is set.
constexpr unsigned short kAllLanes = 0xffff;
constexpr int kRoundAsSet = 4;

/// Clear the upper parts of the AVX registers. Call this where the hot path ends. Upper parts that
/// are not clear slow down the SSE code that the caller runs next, and GCC does not clear them on
/// every way out.
inline void clear_upper_parts()
{
#if defined(__AVX__)
    __builtin_ia32_vzeroupper();
#endif
}

/// mask ? a : b, lane by lane.
template <class M, class V> inline V select(M mask, V a, V b) { return mask ? a : b; }

/// Bit i is 1 if the mask is true in lane i. x86 has an instruction for this, and Arm has one that
/// sums all lanes. The compiler finds neither of them, so that the code names them.
template <class M> inline uint32_t bits_of_mask(M mask)
{
    if constexpr (sizeof(M) <= sizeof(int)) {
        return mask != 0 ? 1u : 0u; // a bool, or an int after & or |
#ifdef __aarch64__
    } else if constexpr (sizeof(M) == 16) {
        constexpr Lane<4>::U kBits = {1, 2, 4, 8};
        return vaddvq_u32(reinterpret_cast<Lane<4>::U>(mask) & kBits);
#endif
#ifdef __SSE2__
    } else if constexpr (sizeof(M) == 16) {
        return static_cast<uint32_t>(__builtin_ia32_movmskps(reinterpret_cast<Lane<4>::F>(mask)));
#endif
#ifdef __AVX__
    } else if constexpr (sizeof(M) == 32) {
        return static_cast<uint32_t>(
            __builtin_ia32_movmskps256(reinterpret_cast<Lane<8>::F>(mask)));
#endif
#ifdef __AVX512DQ__
    } else if constexpr (sizeof(M) == 64) {
        return __builtin_ia32_cvtd2mask512(mask);
#endif
    } else {
        uint32_t bits = 0;
        for (int i = 0; i < static_cast<int>(sizeof(M) / sizeof(int32_t)); ++i) {
            bits |= (mask[i] != 0 ? 1u : 0u) << i;
        }
        return bits;
    }
}

/// True if the mask is true in any lane.
template <class M> inline bool any(M mask) { return bits_of_mask(mask) != 0; }

/// Bit i is 1 if a <= b in lane i. The code names the one instruction of AVX-512 for this, because
/// GCC would first make a vector of the comparison.
template <class F> inline uint32_t bits_where_le(F a, F b)
{
#if defined(__AVX512F__) && !defined(__clang__)
    if constexpr (width<F> == 16) {
        constexpr int kLessOrEqual = 2;
        return __builtin_ia32_cmpps512_mask(a, b, kLessOrEqual, kAllLanes, kRoundAsSet);
    }
#endif
    return bits_of_mask(a <= b);
}

/// Bit i is 1 if a == b in lane i.
template <class F> inline uint32_t bits_where_equal(F a, F b)
{
#if defined(__AVX512F__) && !defined(__clang__)
    if constexpr (width<F> == 16) {
        constexpr int kEqual = 0;
        return __builtin_ia32_cmpps512_mask(a, b, kEqual, kAllLanes, kRoundAsSet);
    }
#endif
    return bits_of_mask(a == b);
}

/// a > b ? a : b. If a and b are equal, or if one of them is a NaN, the result is b. x86 has an
/// instruction for exactly this. Clang finds the instruction for lanes, GCC does not, so that the
/// code names it for GCC.
template <class F> inline F larger(F a, F b)
{
    if constexpr (width<F> == 1) {
        return a > b ? a : b;
#if defined(__SSE__) && !defined(__clang__)
    } else if constexpr (width<F> == 4) {
        return __builtin_ia32_maxps(a, b);
#endif
#if defined(__AVX__) && !defined(__clang__)
    } else if constexpr (width<F> == 8) {
        return __builtin_ia32_maxps256(a, b);
#endif
#if defined(__AVX512F__) && !defined(__clang__)
    } else if constexpr (width<F> == 16) {
        return __builtin_ia32_maxps512_mask(a, b, b, kAllLanes, kRoundAsSet);
#endif
    } else {
        return select(a > b, a, b);
    }
}

/// a < b ? a : b. If a and b are equal, or if one of them is a NaN, the result is b.
template <class F> inline F smaller(F a, F b)
{
    if constexpr (width<F> == 1) {
        return a < b ? a : b;
#if defined(__SSE__) && !defined(__clang__)
    } else if constexpr (width<F> == 4) {
        return __builtin_ia32_minps(a, b);
#endif
#if defined(__AVX__) && !defined(__clang__)
    } else if constexpr (width<F> == 8) {
        return __builtin_ia32_minps256(a, b);
#endif
#if defined(__AVX512F__) && !defined(__clang__)
    } else if constexpr (width<F> == 16) {
        return __builtin_ia32_minps512_mask(a, b, b, kAllLanes, kRoundAsSet);
#endif
    } else {
        return select(a < b, a, b);
    }
}

/// The smaller of a and b. If they are equal, or if one of them is a NaN, the result is b. With
/// GPOM_MINNUM and W = 1 the rule of IEEE 754 holds: if one of them is a NaN, the result is the
/// other.
template <class F> inline F min(F a, F b)
{
    if constexpr (GPOM_MINNUM == 1 && width<F> == 1) {
        return __builtin_fminf(a, b);
    } else {
        return smaller(a, b);
    }
}

/// The larger of a and b, by the same rules as min().
template <class F> inline F max(F a, F b)
{
    if constexpr (GPOM_MINNUM == 1 && width<F> == 1) {
        return __builtin_fmaxf(a, b);
    } else {
        return larger(a, b);
    }
}

/// x, but not more than `high` and not less than `low`.
template <class F> inline F clamp(F x, F low, F high) { return max(min(x, high), low); }

template <class F> inline IntOf<F> bits_of(F x)
{
    IntOf<F> bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

template <class F> inline F from_bits(IntOf<F> bits)
{
    F x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

template <class F> inline F abs(F x)
{
    if constexpr (width<F> == 1) {
        return __builtin_fabsf(x);
    } else {
        return from_bits<F>(bits_of(x) & INT32_C(0x7fffffff));
    }
}

/// x 2^n, if the result is a normal number. n is in the low bits of `n_bits`; the bits above them
/// are shifted out.
template <class F> inline F scale_exponent(F x, IntOf<F> n_bits)
{
    typename Lane<width<F>>::U exponent;
    typename Lane<width<F>>::U bits;
    memcpy(&exponent, &n_bits, sizeof exponent);
    memcpy(&bits, &x, sizeof bits);
    bits += exponent << 23;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/// m of a positive, normal x = m 2^n, 1 <= m < 2.
template <class F> inline F mantissa(F x)
{
    return from_bits<F>((bits_of(x) & INT32_C(0x007fffff)) | INT32_C(0x3f800000));
}

/// n of a positive, normal x = m 2^n, 1 <= m < 2.
template <class F> inline F exponent(F x)
{
    constexpr float kRound = 12582912.0f; // 1.5 * 2^23: its lowest bit has the value 1
    const IntOf<F> n = (bits_of(x) >> 23) - 127;
    return from_bits<F>(bits_of(splat<F>(kRound)) + n) - kRound;
}

/// `magnitude` with the sign of `sign`. `magnitude` must not be negative.
template <class F> inline F with_sign(F magnitude, F sign)
{
    if constexpr (width<F> == 1) {
        return __builtin_copysignf(magnitude, sign);
    } else {
        return from_bits<F>(bits_of(magnitude) | (bits_of(sign) & INT32_MIN));
    }
}

/// -x in lanes where `sign` is negative, else x.
template <class F> inline F flip_sign(F x, F sign)
{
    return from_bits<F>(bits_of(x) ^ (bits_of(sign) & INT32_MIN));
}

template <class F> inline F sqrt(F x)
{
    if constexpr (width<F> == 1) {
        return __builtin_sqrtf(x);
    } else {
        F root = x;
        for (int i = 0; i < width<F>; ++i) {
            root[i] = __builtin_sqrtf(x[i]);
        }
        return root;
    }
}

/// a b + c. Only this function and minus_product() may fuse a product and a sum. So all builds with
/// the same GPOM_FMA round in the same way; -ffp-contract=off stops the compiler from fusing
/// elsewhere. For x86 the code names the instruction, because GCC does not find it in every such
/// loop.
template <class F> inline F fma(F a, F b, F c)
{
    if constexpr (GPOM_FMA == 0) {
        return a * b + c;
    } else if constexpr (width<F> == 1) {
        return __builtin_fmaf(a, b, c);
#if defined(__FMA__) && !defined(__clang__)
    } else if constexpr (width<F> == 8) {
        return __builtin_ia32_vfmaddps256(a, b, c);
#endif
#if defined(__AVX512F__) && !defined(__clang__)
    } else if constexpr (width<F> == 16) {
        return __builtin_ia32_vfmaddps512_mask(a, b, c, kAllLanes, kRoundAsSet);
#endif
    } else {
        F sum = c;
        for (int i = 0; i < width<F>; ++i) {
            sum[i] = __builtin_fmaf(a[i], b[i], c[i]);
        }
        return sum;
    }
}

/// c - a b, fused as in fma().
template <class F> inline F minus_product(F c, F a, F b)
{
    if constexpr (GPOM_FMA == 0) {
        return c - a * b;
#if defined(__FMA__) && !defined(__clang__)
    } else if constexpr (width<F> == 8) {
        return __builtin_ia32_vfnmaddps256(a, b, c);
#endif
#if defined(__AVX512F__) && !defined(__clang__)
    } else if constexpr (width<F> == 16) {
        return __builtin_ia32_vfnmaddps512_mask(a, b, c, kAllLanes, kRoundAsSet);
#endif
    } else {
        return fma(F(-a), b, c);
    }
}

} // namespace gpom::lane
