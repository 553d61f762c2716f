// The local solve only, at the width of the lanes in use, for comparison with the FMA peak.
#ifndef GPOM_BENCH_SOLVE_HPP
#define GPOM_BENCH_SOLVE_HPP

#include "gpom/params.h"

#include <cstddef>

/// Compiled for each instruction set, like the library's hot path (src/query/hot_path.hpp).
struct gpom_bench_solve {
    int lanes;

    /// Compute covariances (neural network, Askey, else Matern-1/2), factor, mean and variance of
    /// `rounds` packets of neighbourhoods of the size in params. Returns a number that depends on
    /// all results.
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

/// Operations of one solve of n points. A covariance counts as 20 operations, a square root as one.
constexpr double solve_flops(double n)
{
    return n * n * n / 3.0 + 2.0 * n * n + 10.0 * n * (n + 1.0) + 15.0 * n;
}

} // namespace gpom_bench

#endif
