/// \file kernel.hpp
/// Covariance functions k(x, x') on lanes.
///
/// Each point is prepared once (feature()), so that a pair costs little: for the neural-network
/// covariance the feature is the unit-ball vector h of eq. 4, k = sf2 asin(h . h'); for the
/// stationary ones it is the position in length scales. The hot path computes in units of sf2.
#pragma once

#include "gpom/params.h"
#include "src/lane/elementary.hpp"

namespace gpom
{

/// The hyperparameters of the covariance, in the form the hot path wants.
struct KernelConstants {
    float sf2;
    float bias;   ///< NN: sqrt(2 s0).
    float weight; ///< NN: sqrt(2 s1) [1/m]. Others: 1 / ell [1/m], times units_per_ell().
};

constexpr float kLog2e = 1.44269504f;

/// Units of position in a length scale, chosen so that the covariance needs no further factor:
/// exp(-r / ell) is 2^-u for log2(e) units, exp(-(r / ell)^2 / 2) is 2^-u^2 for their half's root.
constexpr float units_per_ell(int32_t kernel)
{
    return kernel == GPOM_KERNEL_MATERN12   ? kLog2e
           : kernel == GPOM_KERNEL_MATERN32 ? 1.73205081f
           : kernel == GPOM_KERNEL_SE       ? 0.849321800f
                                            : 1.0f;
}

KernelConstants kernel_constants(const gpom_params_t &params);

template <class F> struct Feature {
    F a, b, c, d;
};

template <gpom_kernel_t K, class F>
inline Feature<F> feature(const KernelConstants constants, F x_m, F y_m)
{
    const F x = constants.weight * x_m;
    const F y = constants.weight * y_m;
    const F zero = lane::splat<F>(0.0f);
    if constexpr (K == GPOM_KERNEL_NN) {
        const F bias2 = lane::splat<F>(1.0f + constants.bias * constants.bias);
        const F norm2 = lane::fma(x, x, lane::fma(y, y, bias2));
        const F scale = 1.0f / lane::sqrt(F(norm2 + norm2));
        return {constants.bias * scale, x * scale, y * scale, scale * scale};
    } else {
        return {x, y, zero, zero};
    }
}

/// How far apart two features are: 1 - h . h' of eq. 4, or the squared distance.
///
/// The former without cancellation: with g = h / sqrt(2) and d = (1 - |h|^2) / 2 it is
/// |g - g'|^2 + d + d'.
template <gpom_kernel_t K, class F> inline F separation(const Feature<F> &p, const Feature<F> &q)
{
    const F da = p.a - q.a;
    const F db = p.b - q.b;
    if constexpr (K == GPOM_KERNEL_NN) {
        const F dc = p.c - q.c;
        return lane::fma(da, da, lane::fma(db, db, lane::fma(dc, dc, F(p.d + q.d))));
    } else {
        return lane::fma(da, da, F(db * db));
    }
}

/// k(x, x') / sf2 of a separation.
template <gpom_kernel_t K, class F> inline F unit_covariance(F separation)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        return asin_of_complement(separation);
    } else if constexpr (K == GPOM_KERNEL_SE) {
        return exp2_negated(separation);
    } else if constexpr (K == GPOM_KERNEL_MATERN12) {
        return exp2_negated(lane::sqrt(separation));
    } else if constexpr (K == GPOM_KERNEL_MATERN32) {
        const F s = lane::sqrt(separation);
        return (1.0f + s) * exp2_negated(F(kLog2e * s));
    } else {
        const F u = lane::max(F(1.0f - lane::sqrt(separation)), lane::splat<F>(0.0f));
        return u * u * u;
    }
}

/// k(x, x) / sf2 from its feature.
template <gpom_kernel_t K, class F> inline F unit_variance(const Feature<F> &p)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        return asin_of_complement(F(p.d + p.d));
    } else {
        return lane::splat<F>(1.0f);
    }
}

/// k(x, x') / sf2 of a point with n others, one at every `stride` of `row`. On lanes in two passes:
/// a processor looks some hundred operations ahead, and finds more to do at once in short chains of
/// them. Askey's is short as it is.
template <gpom_kernel_t K, class F>
inline void unit_covariances(const Feature<F> own, const Feature<F> *others, size_t n, F *row,
                             size_t stride)
{
    if constexpr (lane::width<F> == 1 || K == GPOM_KERNEL_ASKEY) {
        for (size_t p = 0; p < n; ++p) {
            row[stride * p] = unit_covariance<K>(separation<K>(own, others[p]));
        }
    } else {
        for (size_t p = 0; p < n; ++p) {
            row[stride * p] = separation<K>(own, others[p]);
        }
        for (size_t p = 0; p < n; ++p) {
            row[stride * p] = unit_covariance<K>(row[stride * p]);
        }
    }
}

/// k between two places on the x axis, for callers off the hot path.
float covariance_on_axis(const gpom_params_t &params, float x1_m, float x2_m);

} // namespace gpom
