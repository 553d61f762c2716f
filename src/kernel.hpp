/// \file kernel.hpp
/// Covariance functions k(x, x') on lanes.
///
/// Each point is prepared once (feature()), so that a pair costs little: for the neural-network
/// covariance the feature is the unit-ball vector h of eq. 4, k = sf2 asin(h . h'); for the
/// stationary ones it is the position in length scales.
#pragma once

#include "gpom/params.h"
#include "src/elementary.hpp"

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
inline Feature<F> feature(const KernelConstants &constants, F x_m, F y_m)
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

/// 1 - h . h' of two features of eq. 4 without cancellation: with g = h / sqrt(2) and
/// d = (1 - |h|^2) / 2 it is |g - g'|^2 + d + d'.
template <class F> inline F complement_of(const Feature<F> &p, const Feature<F> &q)
{
    const F da = p.a - q.a;
    const F db = p.b - q.b;
    const F dc = p.c - q.c;
    return lane::fma(da, da, lane::fma(db, db, lane::fma(dc, dc, F(p.d + q.d))));
}

/// k(x, x') from two features.
template <gpom_kernel_t K, class F>
inline F covariance(const KernelConstants &constants, const Feature<F> &p, const Feature<F> &q)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        return asin_of_complement(complement_of(p, q), constants.sf2);
    } else {
        const F dx = p.a - q.a;
        const F dy = p.b - q.b;
        const F r2 = lane::fma(dx, dx, F(dy * dy));
        if constexpr (K == GPOM_KERNEL_SE) {
            return constants.sf2 * exp2_nonpositive(F(-r2));
        } else if constexpr (K == GPOM_KERNEL_MATERN12) {
            return constants.sf2 * exp2_nonpositive(F(-lane::sqrt(r2)));
        } else if constexpr (K == GPOM_KERNEL_MATERN32) {
            const F s = lane::sqrt(r2);
            return constants.sf2 * (1.0f + s) * exp2_nonpositive(F(-kLog2e * s));
        } else {
            const F u = lane::max(F(1.0f - lane::sqrt(r2)), lane::splat<F>(0.0f));
            return constants.sf2 * u * u * u;
        }
    }
}

/// k(x, x) from its feature.
template <gpom_kernel_t K, class F>
inline F variance(const KernelConstants &constants, const Feature<F> &p)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        return asin_of_complement(F(p.d + p.d), constants.sf2);
    } else {
        return lane::splat<F>(constants.sf2);
    }
}

/// k between two places on the x axis, for callers off the hot path.
float covariance_on_axis(const gpom_params_t &params, float x1_m, float x2_m);

} // namespace gpom
