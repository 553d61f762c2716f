/// \file sparse_lanes.hpp
/// Solves the large neighbourhoods of a packet by sparse solves, one query after the other.
#pragma once

#include "src/query/workspace.hpp"

namespace gpom
{

/// Collect the points of one lane, without absent points. Returns the number of points.
inline size_t collect_points(const Neighbourhood<F> &from, int i_lane, gpom_sparse_point *points)
{
    size_t n = 0;
    for (size_t j = 0; j < from.n_hits + from.n_free; ++j) {
        const float noise = lane::get(from.noise[j], i_lane);
        if (noise < kAbsentNoise) {
            points[n++] = {lane::get(from.x_m[j], i_lane), lane::get(from.y_m[j], i_lane),
                           j < from.n_hits ? 1.0f : -1.0f, noise};
        }
    }
    return n;
}

/// Mean and variance of the queries of a packet by the sparse solve, for the Askey covariance.
inline Moments<F> predict_sparse([[maybe_unused]] const gpom_params_t &params,
                                 [[maybe_unused]] const Workspace &work)
{
    const F zero = lane::splat<F>(0.0f);
    Moments<F> moments = {zero, zero, zero};
    if constexpr (GPOM_SPARSE != 0) {
        for (int i = 0; i < work.packet->n; ++i) {
            const size_t n = collect_points(work.points, i, work.sparse.points);
            const gpom_sparse_moments own = gpom_sparse_predict(
                {params.sf2, params.ell_m}, {work.sparse.points, n, work.sparse.mem});
            lane::set(moments.mean, i, own.mean);
            lane::set(moments.variance, i, own.variance);
            lane::set(moments.bad, i, own.is_good ? 0.0f : 1.0f);
        }
    }
    return moments;
}

/// Mean and variance of the queries of a packet, by the solve that the map uses: sparse or dense.
template <gpom_kernel_t K> Moments<F> moments_of(const gpom_map &map, Workspace &work)
{
    const gpom_params_t &params = map.config.params;
    if constexpr (K == GPOM_KERNEL_ASKEY) {
        if (is_sparse(map)) {
            return predict_sparse(params, work);
        }
    }
    const bool in_map_frame = params.frame == GPOM_FRAME_MAP;
    const F zero = lane::splat<F>(0.0f);
    return predict<K>(map.kernel, work.points, work.gp, in_map_frame ? work.packet->at.x_m : zero,
                      in_map_frame ? work.packet->at.y_m : zero);
}

} // namespace gpom
