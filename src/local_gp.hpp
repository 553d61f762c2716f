/// \file local_gp.hpp
/// The Gaussian process of one query's neighbourhood (eqs. 1-3 with the points of eq. 10).
#pragma once

#include "src/chol.hpp"
#include "src/kernel.hpp"

namespace gpom
{

/// Noise variance of a point that is not there. Against it every covariance vanishes in float32:
/// its row of L is about 1e-15 k, and what it adds to mean and variance is about 1e-30.
constexpr float kAbsentNoise = 1e30f;

/// n points about the query, hits (+1) first, then free points (-1).
template <class F> struct Neighbourhood {
    F *x_m, *y_m; ///< Relative to the query.
    F *noise;     ///< Noise variance, or kAbsentNoise.
    size_t n_hits, n_free;
};

/// Working arrays of n = n_hits + n_free elements beside the factor.
template <class F> struct GpWork {
    Feature<F> *features;
    F *u, *v;
    Factor<F> factor;
};

template <class F> struct Moments {
    F mean, variance, bad;
};

/// m equal points with equal labels are exactly one point whose precision is the sum of theirs;
/// made one, they cannot spoil the factor's conditioning. O(n^2) comparisons; n <= 64.
template <class F> inline void merge_equal(F *x_m, F *y_m, F *noise, size_t n)
{
    const F absent = lane::splat<F>(kAbsentNoise);
    for (size_t i = 1; i < n; ++i) {
        for (size_t j = 0; j < i; ++j) {
            const auto equal = (x_m[i] == x_m[j]) & (y_m[i] == y_m[j]) & (noise[i] < absent);
            const F merged = 1.0f / (1.0f / noise[j] + 1.0f / noise[i]);
            noise[j] = lane::select(equal, merged, noise[j]);
            noise[i] = lane::select(equal, absent, noise[i]);
        }
    }
}

/// Mean and variance at the query by forward substitution alone: with K + N = L L^T,
/// v = L^-1 k*, u = L^-1 y, the mean (eq. 2) is v . u and the variance (eq. 3) k** - v . v.
///
/// frame_x_m, frame_y_m  the query's coordinates in the covariance's frame; 0 in its own.
template <gpom_kernel_t K, class F>
inline Moments<F> predict(const KernelConstants &constants, const Neighbourhood<F> &points,
                          GpWork<F> &work, F frame_x_m, F frame_y_m)
{
    const Feature<F> query = feature<K>(constants, frame_x_m, frame_y_m);
    F mean = lane::splat<F>(0.0f);
    F explained = lane::splat<F>(0.0f);
    work.factor.bad = lane::splat<F>(0.0f);
    const size_t n = points.n_hits + points.n_free;
    for (size_t i = 0; i < n; ++i) {
        const Feature<F> here =
            feature<K>(constants, F(points.x_m[i] + frame_x_m), F(points.y_m[i] + frame_y_m));
        work.features[i] = here;
        F *const row = work.factor.l + tri(i);
        for (size_t j = 0; j < i; ++j) {
            row[j] = covariance<K>(constants, here, work.features[j]);
        }
        row[i] = variance<K>(constants, here) + points.noise[i];
        factor_row(work.factor, i);
        const F label = lane::splat<F>(i < points.n_hits ? 1.0f : -1.0f);
        work.v[i] = forward(work.factor, i, covariance<K>(constants, query, here), work.v);
        work.u[i] = forward(work.factor, i, label, work.u);
        mean = lane::fma(work.v[i], work.u[i], mean);
        explained = lane::fma(work.v[i], work.v[i], explained);
    }
    const F prior = variance<K>(constants, query);
    const F zero = lane::splat<F>(0.0f);
    const auto good = work.factor.bad == zero;
    return {lane::select(good, mean, zero),
            lane::select(good, lane::max(F(prior - explained), zero), prior), work.factor.bad};
}

} // namespace gpom
