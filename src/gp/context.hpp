/// \file context.hpp
/// Extensions of the paper's model: the axis along which the surface runs, terms inside eq. 7, and
/// neighbours that fade. All of them have no effect by default (params.h).
#pragma once

#include "src/gp/local_gp.hpp"

namespace gpom
{

/// Greater distances count as this one [m]. The vote and the line have no effect at this distance.
constexpr float kContextReach_m = 30.0f;
/// Added to a distance before its logarithm is computed [m].
constexpr float kLogFloor_m = 0.02f;

/// At this distance from the line through the hits the term `line` has 0.7 of its full size [m]
/// (params.h).
constexpr float kLineScale_m = 0.05f;

/// Distance to a neighbour. If the neighbour is farther than kContextReach_m or absent, the result
/// is kContextReach_m.
template <class F> inline F distance_of(const Neighbourhood<F> &points, size_t i)
{
    const F x_m = points.x_m[i];
    const F y_m = points.y_m[i];
    const F d_m = lane::sqrt(lane::fma(x_m, x_m, F(y_m * y_m)));
    const F reach_m = lane::splat<F>(kContextReach_m);
    return lane::select(points.noise[i] < kAbsentNoise, lane::min(d_m, reach_m), reach_m);
}

/// Added to the squared distance between hit and query when the axis of the hits is computed [m2].
/// So a hit nearer than 0.1 m weighs at most twice as much as a hit at 0.1 m.
constexpr float kAxisSoftness_m2 = 0.01f;

/// Smaller divisors count as this one: the sum of weights if there are no hits [1/m2], and the
/// distance over which a neighbour fades [m].
constexpr float kDivisorMin = 1e-12f;

/// Hits with a smaller scatter have no axis [m2].
constexpr float kScatterMin_m2 = 1e-12f;

/// A query nearer to a hit than this is on the hit [m].
constexpr float kOnHit_m = 1e-6f;

/// Least weight of a neighbour. The effect of such a neighbour is less than rounding errors, and
/// its noise is still finite.
constexpr float kWeightMin = 1e-6f;

/// Weight of a neighbour at the distance d_m. Up to from_m the weight is 1. Beyond from_m it is
/// 1 - t^2, where t rises from 0 at from_m to 1 at end_m. fading_noise() turns the weight into
/// noise, so that an answer does not jump when another neighbour becomes the last one. If from_m,
/// end_m and d_m are equal, the weight is 1.
template <class F> inline F fading_weight(F d_m, F from_m, F end_m)
{
    const F zero = lane::splat<F>(0.0f);
    const F t = lane::max(F(d_m - from_m), zero) /
                lane::max(F(end_m - from_m), lane::splat<F>(kDivisorMin));
    return lane::max(F(1.0f - t * t), lane::splat<F>(kWeightMin));
}

/// Noise variance of a neighbour of weight w. At its place, the neighbour explains w times the
/// variance of f that it would explain with the weight 1. The same formula holds for a place that
/// is not exactly known, with w = rho^2 (raised() in noise.hpp).
template <class F> inline F fading_noise(F noise, float prior_variance, F weight)
{
    return (noise + prior_variance) / weight - prior_variance;
}

/// Added to squared distances in facing() if neighbours fade [m2]. The cosine at a hit then turns
/// over a few centimetres and does not jump.
constexpr float kFacingSoftness_m2 = kLogFloor_m * kLogFloor_m;

/// Cosine of the angle between a hit's beam and the direction from the hit to the query. The hit is
/// at (x_m, y_m) relative to the query. The result is 0 if the query is on the hit.
template <class F> inline F facing(F x_m, F y_m, F dir_x, F dir_y, float softness_m2)
{
    const F d_m = lane::sqrt(F(lane::fma(x_m, x_m, F(y_m * y_m)) + softness_m2));
    const F along_m = -lane::fma(dir_x, x_m, F(dir_y * y_m));
    const F one = lane::splat<F>(1.0f);
    return lane::select(d_m < kOnHit_m, F(0.0f * one),
                        F(along_m / lane::max(d_m, F(kOnHit_m * one))));
}

/// Factor of the vote and the line. It is 1 if the query is on the nearest hit, and falls to 0 if
/// the nearest hit is kContextReach_m away.
template <class F> inline F nearness(const Neighbourhood<F> &points)
{
    return 1.0f - distance_of(points, 0) * (1.0f / kContextReach_m);
}

inline bool has_log_terms(const gpom_params_t &params)
{
    return params.log_hit_first != 0.0f || params.log_hit_last != 0.0f ||
           params.log_free_first != 0.0f || params.log_free_last != 0.0f;
}

/// Sum of the weighted logarithms of distances to the first and last neighbour of each kind.
template <class F> inline F log_terms(const gpom_params_t &params, const Neighbourhood<F> &points)
{
    const float weights[] = {params.log_hit_first, params.log_hit_last, params.log_free_first,
                             params.log_free_last};
    const size_t places[] = {0, points.n_hits - 1, points.n_hits,
                             points.n_hits + points.n_free - 1};
    F sum = lane::splat<F>(0.0f);
    for (int i = 0; i < 4; ++i) {
        const F term = log_positive(F(distance_of(points, places[i]) + kLogFloor_m));
        sum = lane::fma(lane::splat<F>(weights[i]), term, sum);
    }
    return sum;
}

/// The number that is added to alpha mu in eq. 7 at places far from all beams.
inline float prior_offset(const gpom_params_t &params)
{
    const float logs =
        log_positive(kContextReach_m + kLogFloor_m) *
        (params.log_hit_first + params.log_hit_last + params.log_free_first + params.log_free_last);
    return params.beta + params.beta_far + logs;
}

/// The inputs of eq. 7 for a query, without alpha.
template <class F> struct Evidence {
    Moments<F> moments;
    F offset; ///< Added to alpha mu.
};

/// The evidence of a query, faded with the distance d to its nearest point.
///
/// rho = 1 - d^2 / fade_m^2, at least 0, is the correlation between f at the query and the f that
/// the neighbours predict. f is rho times the predicted f plus an independent part of variance
/// (1 - rho^2) k**. From d = fade_m on the result is exactly the prior, to the last bit.
template <class F>
inline Evidence<F> faded(const gpom_params_t &params, float prior_variance, F nearest2_m2,
                         const Evidence<F> &near)
{
    const F share = nearest2_m2 * (1.0f / (params.fade_m * params.fade_m));
    const F rho = 1.0f - lane::min(share, lane::splat<F>(1.0f));
    const float far_offset = prior_offset(params);
    return {{rho * near.moments.mean,
             prior_variance - rho * rho * (prior_variance - near.moments.variance),
             near.moments.bad},
            far_offset + rho * (near.offset - far_offset)};
}

/// Weighted sums over the hits: of weights, of offsets from a centre, and of products of offsets.
template <class F> struct Sums {
    F weight, x, y, xx, xy, yy;
};

/// The sums about the centre (x0_m, y0_m). The weight of each hit is divided by
/// kAxisSoftness_m2 + d^2, where d is its distance from the query. So near hits count most.
template <class F> inline Sums<F> sums_about(const Neighbourhood<F> &points, F x0_m, F y0_m)
{
    const F zero = lane::splat<F>(0.0f);
    Sums<F> sums = {zero, zero, zero, zero, zero, zero};
    for (size_t i = 0; i < points.n_hits; ++i) {
        const F x_m = points.x_m[i];
        const F y_m = points.y_m[i];
        const F near = 1.0f / (kAxisSoftness_m2 + lane::fma(x_m, x_m, F(y_m * y_m)));
        const F weight =
            lane::select(points.noise[i] < kAbsentNoise, F(near * points.weight[i]), zero);
        const F wx = weight * (x_m - x0_m);
        const F wy = weight * (y_m - y0_m);
        sums.weight = sums.weight + weight;
        sums.x = sums.x + wx;
        sums.y = sums.y + wy;
        sums.xx = lane::fma(wx, F(x_m - x0_m), sums.xx);
        sums.xy = lane::fma(wx, F(y_m - y0_m), sums.xy);
        sums.yy = lane::fma(wy, F(y_m - y0_m), sums.yy);
    }
    sums.weight = lane::max(sums.weight, lane::splat<F>(kDivisorMin));
    return sums;
}

/// The main axis v of the hits' scatter about their mean: v v^T = (1 + c, s; s, 1 - c) / 2. If r is
/// half the difference of the scatter's eigenvalues, then r (c, s) = ((xx - yy) / 2, xy).
template <class F> struct HitAxis {
    F c, s;
    F narrow;   ///< 1 - sqrt(lambda_2 / lambda_1). 1: hits on a line. 0: no axis.
    F x_m, y_m; ///< The mean of the hits.
};

template <class F> inline HitAxis<F> axis_of_hits(const Neighbourhood<F> &points)
{
    const F zero = lane::splat<F>(0.0f);
    const F one = lane::splat<F>(1.0f);
    const Sums<F> about_query = sums_about(points, zero, zero);
    const F x_m = about_query.x / about_query.weight;
    const F y_m = about_query.y / about_query.weight;
    const Sums<F> sums = sums_about(points, x_m, y_m);
    const F half_trace = 0.5f * (sums.xx + sums.yy) / sums.weight;
    const F difference = 0.5f * (sums.xx - sums.yy) / sums.weight;
    const F cross = sums.xy / sums.weight;
    const F r = lane::sqrt(lane::fma(difference, difference, F(cross * cross)));
    const F lambda_1 = half_trace + r;
    const F lambda_2 = lane::max(F(half_trace - r), zero);
    const auto has_axis = (lambda_1 > kScatterMin_m2) & (r > 0.0f);
    const F ratio = lambda_2 / lane::select(has_axis, lambda_1, one);
    const F inv_r = 1.0f / lane::select(has_axis, r, one);
    const F narrow = 1.0f - lane::sqrt(ratio);
    return {difference * inv_r, cross * inv_r, lane::select(has_axis, narrow, zero), x_m, y_m};
}

/// How far the query is behind the line through the hits (params.h, `line`). The normal n of the
/// line is used only in n n^T = (1 - c, -s; -s, 1 + c) / 2. So the function needs neither the sign
/// of n nor a branch.
///
/// beam_x, beam_y  the mean direction of the hits' beams.
template <class F> inline F behind_line(const HitAxis<F> &axis, F beam_x, F beam_y)
{
    const F off_x = (1.0f - axis.c) * axis.x_m - axis.s * axis.y_m; // 2 n n^T mean
    const F off_y = (1.0f + axis.c) * axis.y_m - axis.s * axis.x_m;
    const F t2 = 0.5f * lane::fma(axis.x_m, off_x, F(axis.y_m * off_y));
    const F spread2 = lane::max(t2, lane::splat<F>(0.0f)) + kLineScale_m * kLineScale_m;
    const F facing_t = -0.5f * lane::fma(beam_x, off_x, F(beam_y * off_y));
    return axis.narrow * facing_t / lane::sqrt(spread2);
}

/// Shrink all points along the hits' main axis v by the factor f = 1 - a (1 - sqrt(lambda_2 /
/// lambda_1)), where a is the anisotropy. A point x becomes x - (1 - f) v v^T x.
template <class F>
inline void shrink_along_hits(const Neighbourhood<F> &points, const HitAxis<F> &axis,
                              float anisotropy)
{
    const F half = 0.5f * (anisotropy * axis.narrow);
    for (size_t i = 0; i < points.n_hits + points.n_free; ++i) {
        const F x_m = points.x_m[i];
        const F y_m = points.y_m[i];
        points.x_m[i] = x_m - half * ((1.0f + axis.c) * x_m + axis.s * y_m);
        points.y_m[i] = y_m - half * (axis.s * x_m + (1.0f - axis.c) * y_m);
    }
}

} // namespace gpom
