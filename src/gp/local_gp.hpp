/// \file local_gp.hpp
/// The Gaussian process of one query's neighbourhood: eqs. 1-3, with the points of eq. 10.
#pragma once

#include "src/gp/chol.hpp"
#include "src/gp/kernel.hpp"
#include "src/gp/nn_block.hpp"

namespace gpom
{

/// Noise variance of an absent point. Every covariance is negligible beside it in float32. The row
/// of L of an absent point is about 1e-15 k. The point adds about 1e-30 to mean and variance.
constexpr float kAbsentNoise = 1e30f;

/// The points around a query in each lane: first hits (label +1), then free points (label -1).
template <class F> struct Neighbourhood {
    F *x_m, *y_m; ///< Relative to the query. All arrays have room for whole tiles of points.
    F *noise;     ///< Noise variance, or kAbsentNoise.
    F *weight;    ///< 1, or less for a neighbour that fades (context.hpp).
    size_t n_hits, n_free;

    size_t n_tiles() const { return tile_count(n_hits + n_free); }
};

/// Arrays for predict(): each has kTile n_tiles() elements. The factor has its own size.
template <class F> struct GpWork {
    Feature<F> *features;
    F *u, *v;
    Factor<F> factor;
};

/// Mean and variance at a query. bad: 1 in lanes whose matrix had a bad pivot, else 0.
template <class F> struct Moments {
    F mean, variance, bad;
};

/// Merge equal points with equal labels. Such points are exactly equivalent to one point whose
/// precision (1 / noise variance) is the sum of their precisions. After merging, the equal points
/// cannot make the matrix badly conditioned.
/// Cost: O(n^2) comparisons, n <= 64.
template <class F> inline void merge_equal(F *x_m, F *y_m, F *noise, size_t n)
{
    const F absent = lane::splat<F>(kAbsentNoise);
    for (size_t i = 1; i < n; ++i) {
        const F x_i = x_m[i];
        for (size_t j = 0; j < i; ++j) {
            if (!lane::any(x_i == x_m[j])) {
                continue;
            }
            const auto equal = (x_m[i] == x_m[j]) & (y_m[i] == y_m[j]) & (noise[i] < absent);
            const F merged = 1.0f / (1.0f / noise[j] + 1.0f / noise[i]);
            noise[j] = lane::select(equal, merged, noise[j]);
            noise[i] = lane::select(equal, absent, noise[i]);
        }
    }
}

/// Fill the last tile with absent points.
template <class F> inline void pad(const Neighbourhood<F> &points)
{
    for (size_t i = points.n_hits + points.n_free; i < kTile * points.n_tiles(); ++i) {
        points.x_m[i] = points.y_m[i] = lane::splat<F>(0.0f);
        points.noise[i] = lane::splat<F>(kAbsentNoise);
    }
}

/// True if the covariances of a block row with the query are computed together with the block row.
template <gpom_kernel_t K, class F>
constexpr bool has_query_in_block_row = lane::width<F> == 1 && K == GPOM_KERNEL_NN;

/// Block row i of (K + N) / sf2: the covariances of four points with each other and with all points
/// before them.
template <gpom_kernel_t K, class F>
inline void covariance_block_row(const GpWork<F> &work, const Feature<F> &query, const F *noise,
                                 F inv_sf2, size_t i)
{
    F *const panel = work.factor.l + panel_at(i);
    if constexpr (has_query_in_block_row<K, F>) {
        nn_block_row(work.features, query, i, work.v, panel);
    }
    for (size_t r = 0; r < kTile; ++r) {
        const size_t n = kTile * i + r;
        F &own = panel[kTile * n + r];
        if constexpr (!has_query_in_block_row<K, F>) {
            unit_covariances<K>(work.features[n], work.features, n, panel + r, kTile);
            own = unit_variance<K>(work.features[n]);
        }
        own = lane::fma(noise[n], inv_sf2, own);
    }
}

/// Mean and variance at the query. The function needs forward substitution only:
///
///     (K + N) / sf2 = L L^T,  v = L^-1 k* / sf2,  u = L^-1 y
///     mean (eq. 2) = v . u,  variance (eq. 3) = k** - sf2 v . v
///
/// frame_x_m, frame_y_m  the query's coordinates in the frame of the covariance. They are 0 in the
///                       frame of the query.
template <gpom_kernel_t K, class F>
inline Moments<F> predict(const KernelConstants constants, const Neighbourhood<F> &points,
                          GpWork<F> &work, F frame_x_m, F frame_y_m)
{
    const F zero = lane::splat<F>(0.0f);
    const F inv_sf2 = lane::splat<F>(1.0f / constants.sf2);
    const Feature<F> query = feature<K>(constants, frame_x_m, frame_y_m);
    F mean = zero;
    F explained = zero;
    work.factor.bad = zero;
    pad(points);
    const size_t n = kTile * points.n_tiles();
    for (size_t j = 0; j < n; ++j) {
        work.features[j] =
            feature<K>(constants, F(points.x_m[j] + frame_x_m), F(points.y_m[j] + frame_y_m));
    }
    for (size_t j = 0; j < points.n_hits; ++j) {
        work.u[j] = lane::splat<F>(1.0f);
    }
    for (size_t j = points.n_hits; j < n; ++j) {
        work.u[j] = lane::splat<F>(-1.0f);
    }
    if constexpr (!has_query_in_block_row<K, F>) {
        unit_covariances<K>(query, work.features, n, work.v, 1);
    }
    for (size_t i = 0; i < points.n_tiles(); ++i) {
        covariance_block_row<K>(work, query, points.noise, inv_sf2, i);
        factor_block_row(work.factor, i);
        forward_block(work.factor, i, work.u, work.v);
        for (size_t j = kTile * i; j < kTile * (i + 1); ++j) {
            mean = lane::fma(work.v[j], work.u[j], mean);
            explained = lane::fma(work.v[j], work.v[j], explained);
        }
    }
    const F prior = unit_variance<K>(query);
    const auto good = work.factor.bad == zero;
    const F left = lane::max(F(prior - explained), zero);
    return {lane::select(good, mean, zero), constants.sf2 * lane::select(good, left, prior),
            work.factor.bad};
}

} // namespace gpom
