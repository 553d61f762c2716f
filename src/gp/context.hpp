/// \file context.hpp
/// What the chosen neighbours say beyond the Gaussian process: the axis along which the surface
/// runs, and terms inside eq. 7. All of it is neutral by default (params.h).
#pragma once

#include "src/gp/local_gp.hpp"

namespace gpom
{

/// Beyond this distance context says nothing [m]; nearer, logarithms see 2 cm more.
constexpr float kContextReach_m = 30.0f;
constexpr float kLogFloor_m = 0.02f;

/// So far behind a line of hits, or before it, its vote is sure [m].
constexpr float kLineScale_m = 0.05f;

/// Distance to a neighbour, or the reach if it is farther or absent.
template <class F> inline F distance_of(const Neighbourhood<F> &points, size_t i)
{
    const F x_m = points.x_m[i];
    const F y_m = points.y_m[i];
    const F d_m = lane::sqrt(lane::fma(x_m, x_m, F(y_m * y_m)));
    const F reach_m = lane::splat<F>(kContextReach_m);
    return lane::select(points.noise[i] < kAbsentNoise, lane::min(d_m, reach_m), reach_m);
}

/// Added to the squared distance of a hit from the query where hits are weighted for their axis
/// [m2]: a hit nearer than 0.1 m weighs little more than one at 0.1 m.
constexpr float kAxisSoftness_m2 = 0.01f;

/// Divisors below this count as this: the sums of no hits at all [1], and distances over which a
/// neighbour fades [m].
constexpr float kDivisorMin = 1e-12f;

/// Hits whose scatter is below this have no axis [m2].
constexpr float kScatterMin_m2 = 1e-12f;

/// A query nearer to a hit than this stands on the hit [m].
constexpr float kOnHit_m = 1e-6f;

/// Least weight of a neighbour: what is left of it is less than rounding, and its noise finite.
constexpr float kWeightMin = 1e-6f;

/// Weight of a neighbour at the distance d_m: 1 up to from_m, 1 - t^2 beyond, t rising to 1 at
/// end_m. With the noise that fading_noise() makes of it, an answer does not feel which neighbour
/// is the last. If all are equally far away, all of them count.
template <class F> inline F fading_weight(F d_m, F from_m, F end_m)
{
    const F zero = lane::splat<F>(0.0f);
    const F t = lane::max(F(d_m - from_m), zero) /
                lane::max(F(end_m - from_m), lane::splat<F>(kDivisorMin));
    return lane::max(F(1.0f - t * t), lane::splat<F>(kWeightMin));
}

/// Noise variance of a neighbour of this weight: of what it says of f at its place, the share w of
/// the variance is left, as for a place that is not exactly known (noise.hpp: raised()).
template <class F> inline F fading_noise(F noise, float prior_variance, F weight)
{
    return (noise + prior_variance) / weight - prior_variance;
}

/// Added to squared distances in facing() where neighbours fade [m2]: there the cosine turns over a
/// few centimetres at a hit instead of all at once.
constexpr float kFacingSoftness_m2 = kLogFloor_m * kLogFloor_m;

/// Cosine between a hit's beam and the way from the hit, at (x, y) from the query, to the query;
/// 0 for a query on the hit.
template <class F> inline F facing(F x_m, F y_m, F dir_x, F dir_y, float softness_m2)
{
    const F d_m = lane::sqrt(F(lane::fma(x_m, x_m, F(y_m * y_m)) + softness_m2));
    const F along_m = -lane::fma(dir_x, x_m, F(dir_y * y_m));
    const F one = lane::splat<F>(1.0f);
    return lane::select(d_m < kOnHit_m, F(0.0f * one),
                        F(along_m / lane::max(d_m, F(kOnHit_m * one))));
}

/// How much a cosine counts: fades from 1 at the nearest hit to 0 at the reach.
template <class F> inline F nearness(const Neighbourhood<F> &points)
{
    return 1.0f - distance_of(points, 0) * (1.0f / kContextReach_m);
}

inline bool has_log_terms(const gpom_params_t &params)
{
    return params.log_hit_first != 0.0f || params.log_hit_last != 0.0f ||
           params.log_free_first != 0.0f || params.log_free_last != 0.0f;
}

/// Sum of the weighted log distances of the first and last neighbour of each kind.
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

/// What is added to alpha mu in eq. 7 far from all beams.
inline float prior_offset(const gpom_params_t &params)
{
    const float logs =
        log_positive(kContextReach_m + kLogFloor_m) *
        (params.log_hit_first + params.log_hit_last + params.log_free_first + params.log_free_last);
    return params.beta + params.beta_far + logs;
}

/// What eq. 7 needs of a query, beside alpha.
template <class F> struct Evidence {
    Moments<F> moments;
    F offset;
};

/// With the squared distance to the nearest point, rho = 1 - d^2 / fade_m^2 or 0 is the correlation
/// left between f at the query and what its neighbours tell: f is rho times theirs plus an
/// independent part of variance (1 - rho^2) k**. From fade_m on it is the prior, to the last bit.
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

/// Weighted sums over the hits about a centre: of weights, offsets and products of offsets.
template <class F> struct Sums {
    F weight, x, y, xx, xy, yy;
};

/// Hits near the query count most: their weights are divided by kAxisSoftness_m2 + d^2.
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

/// The main axis v of the hits' scatter about their mean: v v^T = (1 + c, s; s, 1 - c) / 2. With r
/// half the difference of the scatter's eigenvalues, r (c, s) = ((xx - yy) / 2, xy).
template <class F> struct HitAxis {
    F c, s;
    F narrow;   ///< 1 - sqrt(lambda_2 / lambda_1): 1 for hits on a line, 0 without an axis.
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

/// How far the query is behind the line through the hits (params.h, `line`). With the normal's
/// projection n n^T = (1 - c, -s; -s, 1 + c) / 2 neither its sign nor a branch is needed.
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

/// Shrink all coordinates along the hits' main axis v by f = 1 - a (1 - sqrt(lambda_2 / lambda_1)):
/// x - (1 - f) v v^T x.
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
