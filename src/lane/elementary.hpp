/// \file elementary.hpp
/// Arcsine, exponentials, logarithm, normal distribution function, sine and cosine in float32.
///
/// Every platform uses these functions and not those of its C library. C libraries differ in the
/// last bits, and none of them works on lanes. tools/dev/fit_elementary.py prints the coefficients
/// and error bounds (weighted minimax fits).
#pragma once

#include "src/lane/lane.hpp"

namespace gpom
{

/// Polynomial in x by Horner's rule. c holds the coefficient of the lowest power first.
template <class F, int N> inline F horner(const float (&c)[N], F x)
{
    F sum = lane::splat<F>(c[N - 1]);
#pragma GCC unroll 8
    for (int i = N - 2; i >= 0; --i) {
        sum = lane::fma(sum, x, lane::splat<F>(c[i]));
    }
    return sum;
}

/// asin(1 - q) for 0 <= q <= 1, as pi/2 + sqrt(q) P(q). Absolute error <= 2.8e-7.
template <class F> inline F acute_asin_of_complement(F q)
{
    constexpr float kHalfPi = 1.57079637f;
    constexpr float kP[] = {-1.41421509f,    -0.117799751f,  -0.0270233806f, -0.0057213679f,
                            -0.00732220756f, 0.00400857907f, -0.00272317207f};
    return lane::fma(lane::sqrt(q), horner(kP, q), lane::splat<F>(kHalfPi));
}

/// asin(1 - q) for 0 <= q <= 2. The argument is q and not 1 - q, because 1 - q would lose digits
/// near q = 0, where the arcsine is steepest. If rounding made q greater than 2, the function uses
/// 4 - q, which is equally far below 2.
template <class F> inline F asin_of_complement(F q)
{
    const F mirrored = lane::abs(F(2.0f - q));
    if constexpr (lane::width<F> == 1) {
        const bool is_obtuse = q > 1.0f;
        const F arc = acute_asin_of_complement(is_obtuse ? mirrored : q);
        return is_obtuse ? -arc : arc;
    } else {
        const F arc = acute_asin_of_complement(lane::smaller(mirrored, q));
        return lane::flip_sign(arc, F(1.0f - q));
    }
}

/// exp(x) for x <= 0, as 2^n exp(f) after Cody and Waite's reduction. Below x = -87 the result is
/// 0, so that there are no denormal numbers. Error <= 1.3 units in the last place. A NaN gives a
/// NaN, here, in exp2_negated() and in normal_cdf().
template <class F> inline F exp_nonpositive(F x)
{
    constexpr float kLog2e = 1.44269504f;
    constexpr float kLn2High = 0.693359375f;
    constexpr float kLn2Low = -0.000212194442f;
    constexpr float kRound = 12582912.0f; // 1.5 * 2^23: a sum with it is rounded to an integer
    constexpr float kQ[] = {0.49999994f, 0.166665211f, 0.0416682735f, 0.00836868398f,
                            0.00138200796f};
    const F clamped = lane::select(x < -87.0f, lane::splat<F>(-87.0f), x);
    const F shifted = clamped * kLog2e + kRound;
    const F n = shifted - kRound;
    const F f = (clamped - n * kLn2High) - n * kLn2Low;
    const F mantissa = lane::fma(F(f * f), horner(kQ, f), F(f + 1.0f));
    const F scaled = lane::scale_exponent(mantissa, lane::bits_of(shifted));
    return lane::select(x < -87.0f, lane::splat<F>(0.0f), scaled);
}

/// 2^-u for u >= 0. From u = 127 on the result is 0. 2^0 is exactly 1. Error <= 2.2 units in the
/// last place up to u = 125; beyond u = 125 the error is <= 2^-126. The result 0 needs no branch,
/// because at u = 127 all bits of the exponent are 0.
template <class F> inline F exp2_negated(F u)
{
    constexpr float kRound = 12582912.0f; // 1.5 * 2^23: a difference is rounded to an integer
    constexpr float kP[] = {1.0f,          -0.693147004f,  0.240222469f,
                            -0.055507116f, 0.00967130065f, -0.00132692745f};
    const F clamped = lane::smaller(lane::splat<F>(127.0f), u); // a NaN stays a NaN
    const F shifted = kRound - clamped;
    const F f = clamped + (shifted - kRound);
    return lane::scale_exponent(horner(kP, f), lane::bits_of(shifted));
}

/// Natural logarithm of a positive, normal x = m 2^n, as n log(2) + 2 atanh((m - 1) / (m + 1)). The
/// series of atanh is cut. Absolute error <= 4e-7 for 0.01 <= x <= 100.
template <class F> inline F log_positive(F x)
{
    constexpr float kLn2 = 0.693147181f;
    constexpr float kSqrt2 = 1.41421356f;
    constexpr float kSeries[] = {1.0f, 0.333333333f, 0.2f, 0.142857143f, 0.111111111f};
    const F unit = lane::mantissa(x);
    const F power = lane::exponent(x);
    const auto above = unit > kSqrt2;
    const F m = lane::select(above, F(0.5f * unit), unit);
    const F n = lane::select(above, F(power + 1.0f), power);
    const F s = (m - 1.0f) / (m + 1.0f);
    return lane::fma(n, lane::splat<F>(kLn2), F(2.0f * s * horner(kSeries, F(s * s))));
}

/// Standard normal distribution function Phi(z). Absolute error <= 2.4e-7. In the lower tail the
/// relative error is <= 7e-6 down to z = -13.
template <class F> inline F normal_cdf(F z)
{
    constexpr float kScale = 0.259999990f;
    constexpr float kP[] = {0.103558563f, 0.106701247f, 0.0753969774f, 0.161952898f,
                            -0.10140191f, 0.226114228f, -0.0723220408f};
    const F a = lane::select(lane::abs(z) > 14.0f, lane::splat<F>(14.0f), lane::abs(z));
    const F t = 1.0f / (1.0f + kScale * a);
    const F tail = exp_nonpositive(F(-0.5f * (a * a))) * (t * horner(kP, t));
    return lane::select(z < 0.0f, tail, F(1.0f - tail));
}

/// A unit vector.
struct Direction {
    float x, y;
};

/// Unit vector at the angle `angle_rad`, |angle_rad| <= 1e6. The angle is reduced to [-pi/4, pi/4]
/// in double. Error <= 1e-7.
inline Direction direction_of(double angle_rad)
{
    constexpr double kTwoOverPi = 0.63661977236758134;
    constexpr double kHalfPi = 1.5707963267948966;
    constexpr float kSin[] = {-0.166666552f, 0.0083321901f, -0.000195184082f};
    constexpr float kCos[] = {0.0416666456f, -0.00138873013f, 2.44306684e-05f};
    const double turns = angle_rad * kTwoOverPi;
    const int32_t quarter = static_cast<int32_t>(turns + (turns < 0.0 ? -0.5 : 0.5));
    const float f = static_cast<float>(angle_rad - static_cast<double>(quarter) * kHalfPi);
    const float f2 = f * f;
    const float s = f + f * f2 * horner(kSin, f2);
    const float c = 1.0f + (-0.5f * f2 + f2 * f2 * horner(kCos, f2));
    switch (static_cast<uint32_t>(quarter) & 3u) {
    case 0:
        return {c, s};
    case 1:
        return {-s, c};
    case 2:
        return {-c, -s};
    default:
        return {s, -c};
    }
}

} // namespace gpom
