// Measures how many multiply-adds a second the processor can do at the width of the library's
// lanes.
#ifndef GPOM_BENCH_FMA_PEAK_HPP
#define GPOM_BENCH_FMA_PEAK_HPP

#include <cstdint>

namespace gpom_bench
{

constexpr int kChains = 12; ///< Number of independent sums. It is more than latency times number of
                            ///< units.

/// Do `rounds` multiply-adds on each of kChains vectors, which stay in registers.
template <class F> inline __attribute__((always_inline)) float multiply_add(std::int64_t rounds)
{
    F sum[kChains];
    for (int c = 0; c < kChains; ++c) {
        sum[c] = F{} + static_cast<float>(c);
    }
    F factor = F{} + 0.5f;
    F term = F{} + 1.0f;
    asm volatile("" : "+v"(factor), "+v"(term)); // hide the values from the compiler
    for (std::int64_t i = 0; i < rounds; ++i) {
#pragma GCC unroll 12
        for (int c = 0; c < kChains; ++c) {
            sum[c] = sum[c] * factor + term;
        }
    }
    float total = 0.0f;
    for (int c = 0; c < kChains; ++c) {
        total += sum[c][0];
    }
    return total;
}

typedef float F4 __attribute__((vector_size(16)));
typedef float F8 __attribute__((vector_size(32)));
typedef float F16 __attribute__((vector_size(64)));

__attribute__((optimize("fp-contract=fast"))) inline float peak_sse2(std::int64_t rounds)
{
    return multiply_add<F4>(rounds);
}
#ifdef __x86_64__
__attribute__((target("avx2,fma"), optimize("fp-contract=fast"))) inline float
peak_avx2(std::int64_t rounds)
{
    return multiply_add<F8>(rounds);
}
__attribute__((target("avx512f"), optimize("fp-contract=fast"))) inline float
peak_avx512(std::int64_t rounds)
{
    return multiply_add<F16>(rounds);
}
#endif

} // namespace gpom_bench

#endif
