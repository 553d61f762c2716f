#include "bench/solve.hpp"

#include "src/gp/local_gp.hpp"

namespace gpom
{
namespace
{

constexpr int kLanes = GPOM_LANES;
using F = lane::Lane<kLanes>::F;
constexpr std::size_t kPointsMax = GPOM_POINTS_MAX;

/// Working memory of the solve of one packet.
struct Memory {
    F x_m[kPointsMax], y_m[kPointsMax], noise[kPointsMax], u[kPointsMax], v[kPointsMax];
    Feature<F> features[kPointsMax];
    F factor[panel_at(tile_count(kPointsMax))];
};

/// Points on a spiral around the query. Each lane's spiral is turned a little.
Neighbourhood<F> spiral(Memory &memory, const gpom_params_t &params)
{
    for (std::size_t j = 0; j < kPointsMax; ++j) {
        for (int i = 0; i < kLanes; ++i) {
            const float turn = 2.4f * static_cast<float>(j) + 0.1f * static_cast<float>(i);
            const float r_m = 0.3f + 0.1f * static_cast<float>(j);
            lane::set(memory.x_m[j], i, r_m * __builtin_cosf(turn));
            lane::set(memory.y_m[j], i, r_m * __builtin_sinf(turn));
        }
        memory.noise[j] = lane::splat<F>(params.sn2);
    }
    return {memory.x_m, memory.y_m, memory.noise, nullptr, params.n_hits, params.n_free};
}

template <gpom_kernel_t K> float solve_with(const gpom_params_t &params, std::size_t rounds)
{
    static Memory memory;
    const KernelConstants kernel = kernel_constants(params);
    const Neighbourhood<F> points = spiral(memory, params);
    GpWork<F> work = {memory.features, memory.u, memory.v, {memory.factor, F{}}};
    const F zero = lane::splat<F>(0.0f);
    F sum = zero;
    for (std::size_t round = 0; round < rounds; ++round) {
        const Moments<F> moments = predict<K>(kernel, points, work, zero, zero);
        sum = sum + moments.mean + moments.variance;
        // Makes each round differ from the last.
        memory.x_m[0] = memory.x_m[0] + 1e-6f * moments.mean;
    }
    return lane::get(sum, 0);
}

float solve(const gpom_params_t &params, std::size_t rounds)
{
    switch (params.kernel) {
    case GPOM_KERNEL_NN:
        return solve_with<GPOM_KERNEL_NN>(params, rounds);
    case GPOM_KERNEL_ASKEY:
        return solve_with<GPOM_KERNEL_ASKEY>(params, rounds);
    default:
        return solve_with<GPOM_KERNEL_MATERN12>(params, rounds);
    }
}

} // namespace

gpom_bench_solve bench_solve_here() { return {kLanes, solve}; }

} // namespace gpom
