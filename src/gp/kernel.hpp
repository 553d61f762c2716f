/// \file kernel.hpp
/// Covariance functions k(x, x') on lanes.
///
/// feature() prepares each point once, so that the covariance of a pair costs little. For the
/// neural-network covariance the feature is the vector h of eq. 4, which lies in the unit ball;
/// k = sf2 asin(h . h'). For a stationary covariance the feature is the position in length scales.
/// The hot path computes in units of sf2.
#pragma once

#include "gpom/params.h"
#include "src/lane/dual.hpp"

namespace gpom
{

/// The hyperparameters of the covariance, in the form that the hot path uses.
struct KernelConstants {
    float sf2;
    float bias;   ///< NN: sqrt(2 s0).
    float weight; ///< NN: sqrt(2 s1) [1/m]. Others: 1 / ell [1/m], times units_per_ell().
};

constexpr float kLog2e = 1.44269504f;

/// How many units of position one length scale has. The number is chosen so that the covariance
/// needs no further factor. u is a distance in these units.
/// Matern-1/2: log2(e) units, so that exp(-r / ell) = 2^-u.
/// Matern-3/2: sqrt(3) units, so that s = u.
/// Squared exponential: sqrt(log2(e) / 2) units, so that exp(-(r / ell)^2 / 2) = 2^-(u^2).
/// Neural network and Askey: 1 unit.
constexpr float units_per_ell(int32_t kernel)
{
    return kernel == GPOM_KERNEL_MATERN12   ? kLog2e
           : kernel == GPOM_KERNEL_MATERN32 ? 1.73205081f
           : kernel == GPOM_KERNEL_SE       ? 0.849321800f
                                            : 1.0f;
}

KernelConstants kernel_constants(const gpom_params_t &params);

/// A prepared point. NN: (a, b, c) is h / sqrt(2) and d is (1 - |h|^2) / 2, see separation().
/// Others: (a, b) is the position.
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

/// How far apart two features are. NN: 1 - h . h' of eq. 4. Others: the squared distance.
///
/// 1 - h . h' is computed without cancellation: with g = h / sqrt(2) and d = (1 - |h|^2) / 2, it is
/// |g - g'|^2 + d + d'.
///
/// Always inlined early: otherwise GCC keeps copies of features in memory (nn_block.hpp).
template <gpom_kernel_t K, class F>
[[gnu::always_inline]] inline F separation(const Feature<F> &p, const Feature<F> &q)
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

/// k(x, x') / sf2 of two points with this separation.
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

/// k(x, x) / sf2 of a point, from its feature.
template <gpom_kernel_t K, class F> inline F unit_variance(const Feature<F> &p)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        return asin_of_complement(F(p.d + p.d));
    } else {
        return lane::splat<F>(1.0f);
    }
}

/// k(x, x') / sf2 of a point with n others. The results are `stride` elements apart in `row`.
///
/// On lanes the function makes two passes. A processor looks some hundred operations ahead, and can
/// do more of them at once if the chains of dependent operations are short. The chain of the Askey
/// covariance is short already.
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

/// k(x, x') of two places on the x axis, for callers outside the hot path.
float covariance_on_axis(const gpom_params_t &params, float x1_m, float x2_m);

} // namespace gpom
