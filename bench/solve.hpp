// The local solve alone, at the width of the lanes in use: to be held against the FMA peak.
#ifndef GPOM_BENCH_SOLVE_HPP
#define GPOM_BENCH_SOLVE_HPP

#include "gpom/params.h"

#include <cstddef>

/// Compiled for each instruction set as the library's hot path is (src/query/hot_path.hpp).
struct gpom_bench_solve {
    int lanes;

    /// Covariances (neural network, Askey, else Matern-1/2), factor, mean and variance of `rounds`
    /// packets of neighbourhoods of params' size. Returns a number that depends on all of them.
    float (*solve)(const gpom_params_t &params, std::size_t rounds);
};

namespace gpom
{
gpom_bench_solve bench_solve_here();
}
#ifdef __x86_64__
namespace gpom_avx2
{
gpom_bench_solve bench_solve_here();
}
namespace gpom_avx512
{
gpom_bench_solve bench_solve_here();
}
#endif

namespace gpom_bench
{

/// Operations of one solve of n points, covariances with 20 and a square root with one.
constexpr double solve_flops(double n)
{
    return n * n * n / 3.0 + 2.0 * n * n + 10.0 * n * (n + 1.0) + 15.0 * n;
}

} // namespace gpom_bench

#endif
