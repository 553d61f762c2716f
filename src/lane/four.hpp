/// \file four.hpp
/// Four values that lie one after the other, loaded and stored together.
///
/// A Cortex-M4F or M7 loads and stores registers that follow each other by one instruction. The
/// compiler does not find it, because it chooses the registers later. So the code names the
/// instruction and its registers here. Elsewhere, and for more than one lane, the functions copy.
#pragma once

#include "src/lane/lane.hpp"

#if defined(__arm__) && defined(__ARM_FP)
#define GPOM_HAS_REGISTER_BLOCKS 1
#else
#define GPOM_HAS_REGISTER_BLOCKS 0
#endif

namespace gpom::lane
{

/// Four registers that follow each other. 0 to 3 are meant for the columns of a 4 x 4 tile, 4 and 5
/// for what is combined with it. The compiler keeps the values in these registers as far as it can.
template <int block> struct RegisterBlock;

#if GPOM_HAS_REGISTER_BLOCKS
#define GPOM_REGISTER_BLOCK(block, s0, s1, s2, s3)                                                 \
    template <> struct RegisterBlock<block> {                                                      \
        static inline void load(const float *from, float (&to)[4])                                 \
        {                                                                                          \
            register float a asm(s0);                                                              \
            register float b asm(s1);                                                              \
            register float c asm(s2);                                                              \
            register float d asm(s3);                                                              \
            asm("vldmia %4, {%0, %1, %2, %3}"                                                      \
                : "=t"(a), "=t"(b), "=t"(c), "=t"(d)                                               \
                : "r"(from), "m"(*reinterpret_cast<const float(*)[4]>(from)));                     \
            to[0] = a;                                                                             \
            to[1] = b;                                                                             \
            to[2] = c;                                                                             \
            to[3] = d;                                                                             \
        }                                                                                          \
                                                                                                   \
        static inline void store(const float (&from)[4], float *to)                                \
        {                                                                                          \
            register float a asm(s0) = from[0];                                                    \
            register float b asm(s1) = from[1];                                                    \
            register float c asm(s2) = from[2];                                                    \
            register float d asm(s3) = from[3];                                                    \
            asm("vstmia %5, {%1, %2, %3, %4}"                                                      \
                : "=m"(*reinterpret_cast<float(*)[4]>(to))                                         \
                : "t"(a), "t"(b), "t"(c), "t"(d), "r"(to));                                        \
        }                                                                                          \
    }
GPOM_REGISTER_BLOCK(0, "s0", "s1", "s2", "s3");
GPOM_REGISTER_BLOCK(1, "s4", "s5", "s6", "s7");
GPOM_REGISTER_BLOCK(2, "s8", "s9", "s10", "s11");
GPOM_REGISTER_BLOCK(3, "s12", "s13", "s14", "s15");
GPOM_REGISTER_BLOCK(4, "s24", "s25", "s26", "s27");
GPOM_REGISTER_BLOCK(5, "s28", "s29", "s30", "s31");
#undef GPOM_REGISTER_BLOCK
#endif

/// Load four values, where the processor can into this block of registers.
template <int block, class F> inline void load_four(const F *from, F (&to)[4])
{
    if constexpr (GPOM_HAS_REGISTER_BLOCKS == 1 && width<F> == 1) {
        RegisterBlock<block>::load(from, to);
    } else {
        to[0] = from[0];
        to[1] = from[1];
        to[2] = from[2];
        to[3] = from[3];
    }
}

/// Store four values, where the processor can from this block of registers.
template <int block, class F> inline void store_four(const F (&from)[4], F *to)
{
    if constexpr (GPOM_HAS_REGISTER_BLOCKS == 1 && width<F> == 1) {
        RegisterBlock<block>::store(from, to);
    } else {
        to[0] = from[0];
        to[1] = from[1];
        to[2] = from[2];
        to[3] = from[3];
    }
}

} // namespace gpom::lane
