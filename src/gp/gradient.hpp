/// \file gradient.hpp
/// Mean and variance of a neighbourhood, as in local_gp.hpp, and their derivatives by the place of
/// the query.
///
/// With A = (K + N) / sf2, k = k* / sf2, a = A^-1 y and b = A^-1 k:
///
///     mean = k . a,                  d mean = dk . a - b' dA a
///     variance = sf2 (k** - k . b),  d variance = sf2 (dk** - 2 dk . b + b' dA b)
///
/// A changes with the query, because the neighbours move relative to each other (eq. 10). With the
/// query as one point more, a = 0 and b = -1 there, both are sums over all pairs of points of
/// dA_ij = slope_ij d separation_ij:
///
///     d mean = - sum of b_i a_j dA_ij,  d variance = sf2 times the sum of b_i b_j dA_ij
#pragma once

#include "src/gp/context.hpp"
#include "src/lane/dual.hpp"

namespace gpom
{

/// A smaller root of a separation counts as this one, so that a slope is finite.
constexpr float kRootMin = 1e-18f;

/// d k / d separation of k / sf2, from the separation and k itself. Matern-1/2 and Askey have a
/// kink at distance 0. There the slope is finite. The difference of the two points, by which it is
/// multiplied, is 0. So the derivative is 0: the mean of those on the two sides.
template <gpom_kernel_t K, class F> inline F slope_of(F separation, F covariance)
{
    constexpr float kLn2 = 0.693147181f;
    const F root_min = lane::splat<F>(kRootMin);
    if constexpr (K == GPOM_KERNEL_NN) {
        const F square = lane::max(F(separation * (2.0f - separation)), lane::splat<F>(FLT_MIN));
        return -1.0f / lane::sqrt(square);
    } else if constexpr (K == GPOM_KERNEL_SE) {
        return -kLn2 * covariance;
    } else if constexpr (K == GPOM_KERNEL_MATERN12) {
        return (-0.5f * kLn2) * covariance / lane::max(lane::sqrt(separation), root_min);
    } else if constexpr (K == GPOM_KERNEL_MATERN32) {
        return -0.5f * covariance / (1.0f + lane::sqrt(separation));
    } else {
        const F r = lane::sqrt(separation);
        const F u = lane::max(F(1.0f - r), lane::splat<F>(0.0f));
        return -1.5f * (u * u) / lane::max(r, root_min);
    }
}

/// The derivatives of a feature by x and y.
template <class F> struct FeatureSlopes {
    Feature<F> by_x, by_y;
};

/// A vector in the space of features. Only the neural network's has a third component.
template <class F> struct Pull {
    F a, b, c;
};

/// a and b of a point, times its feature: for the neural network.
template <class F> struct Weighted {
    Pull<F> by_a, by_b;
};

/// What a gradient needs besides the arrays of a query. n is the number of points in whole tiles.
template <class F> struct SlopeWork {
    FeatureSlopes<F> *features; ///< n.
    Weighted<F> *weighted;      ///< n.
    bool does_noise_move;       ///< Neighbours fade.
    F *pairs; ///< pair_values() of the pairs of point i with those before it from row_at(i) on,
              ///< i <= n. Point n is the query.
};

/// How many numbers are kept of a pair of points p and p'. Neural network: the slope. Others: the
/// vector slope (p - p').
constexpr size_t pair_values(int32_t kernel) { return kernel == GPOM_KERNEL_NN ? 1 : 2; }

/// Number of the first pair of point i.
constexpr size_t row_at(size_t i) { return i * (i - 1) / 2; }

/// k / sf2 of two points. The numbers of the pair are written to `pair`.
template <gpom_kernel_t K, class F>
inline F covariance_of_pair(const Feature<F> &own, const Feature<F> &other, F *pair)
{
    const F apart = separation<K>(own, other);
    const F covariance = unit_covariance<K>(apart);
    const F slope = slope_of<K>(apart, covariance);
    if constexpr (K == GPOM_KERNEL_NN) {
        pair[0] = slope;
    } else {
        pair[0] = slope * (own.a - other.a);
        pair[1] = slope * (own.b - other.b);
    }
    return covariance;
}

/// Where the covariances of a point with others go, `stride` elements apart, and the pairs.
template <class F> struct PairRow {
    F *row;
    size_t stride;
    F *pairs;
};

/// Covariances of a point with n others, and the pairs.
template <gpom_kernel_t K, class F>
inline void covariances_of_pairs(const Feature<F> own, const Feature<F> *others, size_t n,
                                 const PairRow<F> to)
{
    for (size_t p = 0; p < n; ++p) {
        to.row[to.stride * p] =
            covariance_of_pair<K>(own, others[p], to.pairs + pair_values(K) * p);
    }
}

/// Solve L^T a = u and L^T b = v in place. Block rows are read from the last to the first, each
/// panel from front to back.
template <class F> inline void backward(const Factor<F> &factor, size_t n_tiles, F *u, F *v)
{
    for (size_t i = n_tiles; i-- > 0;) {
        const F *panel = factor.l + panel_at(i);
        const F *const diagonal = panel + kTile * kTile * i;
        F *const a = u + kTile * i;
        F *const b = v + kTile * i;
#pragma GCC unroll 4
        for (size_t i_last = 0; i_last < kTile; ++i_last) {
            const size_t c = kTile - 1 - i_last;
            F sum_a = a[c];
            F sum_b = b[c];
#pragma GCC unroll 4
            for (size_t r = c + 1; r < kTile; ++r) {
                sum_a = lane::minus_product(sum_a, diagonal[kTile * c + r], a[r]);
                sum_b = lane::minus_product(sum_b, diagonal[kTile * c + r], b[r]);
            }
            a[c] = sum_a * diagonal[kTile * c + c];
            b[c] = sum_b * diagonal[kTile * c + c];
        }
        const F a_i[kTile] = {a[0], a[1], a[2], a[3]};
        const F b_i[kTile] = {b[0], b[1], b[2], b[3]};
        for (size_t p = 0; p < kTile * i; ++p, panel += kTile) {
            F sum_a = u[p];
            F sum_b = v[p];
#pragma GCC unroll 4
            for (size_t r = 0; r < kTile; ++r) {
                sum_a = lane::minus_product(sum_a, panel[r], a_i[r]);
                sum_b = lane::minus_product(sum_b, panel[r], b_i[r]);
            }
            u[p] = sum_a;
            v[p] = sum_b;
        }
    }
}

/// Derivatives of mean and variance / sf2.
template <class F> struct MomentSlopes {
    F mean_x, mean_y, variance_x, variance_y;
};

/// The sums of a point over all others. Each A_ij = k(s_ij) depends on the features p_i and p_j.
/// With g_ij = slope_ij (p_i - p_j):
///
///     dA_ij = 2 g_ij . (dp_i - dp_j)                           (separation |p_i - p_j|^2)
///     sum over i, j of b_i a_j dA_ij = 2 sum of dp_i . (b_i by_a_i + a_i by_b_i)
///     by_a_i = sum over j of a_j g_ij,  by_b_i = sum over j of b_j g_ij
///
/// For the neural network, with separation 1 - 2 g_i . g_j, p_i - p_j is -p_j instead.
template <class F> struct Pulls {
    Pull<F> by_a, by_b;
};

/// Add one pair with a point whose a and b are given. The point `own` has the later number if
/// is_own_later: the numbers of the pair are those of the later point.
template <gpom_kernel_t K, bool is_own_later, class F>
inline void add_pull(Pulls<F> &pulls, const F *pair, const GpWork<F> &work,
                     const SlopeWork<F> &moving, size_t i_other)
{
    if constexpr (K == GPOM_KERNEL_NN) {
        const Weighted<F> &other = moving.weighted[i_other];
        pulls.by_a.a = lane::minus_product(pulls.by_a.a, pair[0], other.by_a.a);
        pulls.by_a.b = lane::minus_product(pulls.by_a.b, pair[0], other.by_a.b);
        pulls.by_a.c = lane::minus_product(pulls.by_a.c, pair[0], other.by_a.c);
        pulls.by_b.a = lane::minus_product(pulls.by_b.a, pair[0], other.by_b.a);
        pulls.by_b.b = lane::minus_product(pulls.by_b.b, pair[0], other.by_b.b);
        pulls.by_b.c = lane::minus_product(pulls.by_b.c, pair[0], other.by_b.c);
    } else if constexpr (is_own_later) {
        pulls.by_a.a = lane::fma(pair[0], work.u[i_other], pulls.by_a.a);
        pulls.by_a.b = lane::fma(pair[1], work.u[i_other], pulls.by_a.b);
        pulls.by_b.a = lane::fma(pair[0], work.v[i_other], pulls.by_b.a);
        pulls.by_b.b = lane::fma(pair[1], work.v[i_other], pulls.by_b.b);
    } else {
        pulls.by_a.a = lane::minus_product(pulls.by_a.a, pair[0], work.u[i_other]);
        pulls.by_a.b = lane::minus_product(pulls.by_a.b, pair[1], work.u[i_other]);
        pulls.by_b.a = lane::minus_product(pulls.by_b.a, pair[0], work.v[i_other]);
        pulls.by_b.b = lane::minus_product(pulls.by_b.b, pair[1], work.v[i_other]);
    }
}

/// The point that moves: a neighbour, or the query with a = 0 and b = -1.
template <class F> struct MovingPoint {
    const Feature<F> &feature;
    const FeatureSlopes<F> &slopes;
    F a, b;
};

template <gpom_kernel_t K, class F> inline F dot(const Pull<F> &pull, const Feature<F> &slope)
{
    const F sum = lane::fma(pull.a, slope.a, F(pull.b * slope.b));
    if constexpr (K == GPOM_KERNEL_NN) {
        return lane::fma(pull.c, slope.c, sum);
    } else {
        return sum;
    }
}

/// Add the pulls of a point to the derivatives.
template <gpom_kernel_t K, class F>
inline void add_pulls(MomentSlopes<F> &sums, const MovingPoint<F> &own, const Pulls<F> &pulls)
{
    const F a2 = 2.0f * own.a;
    const F b2 = 2.0f * own.b;
    const F b4 = 4.0f * own.b;
    const FeatureSlopes<F> &by = own.slopes;
    Pull<F> on_mean = {lane::fma(b2, pulls.by_a.a, F(a2 * pulls.by_b.a)),
                       lane::fma(b2, pulls.by_a.b, F(a2 * pulls.by_b.b)), F{}};
    if constexpr (K == GPOM_KERNEL_NN) {
        on_mean.c = lane::fma(b2, pulls.by_a.c, F(a2 * pulls.by_b.c));
    }
    sums.mean_x = sums.mean_x - dot<K>(on_mean, by.by_x);
    sums.mean_y = sums.mean_y - dot<K>(on_mean, by.by_y);
    sums.variance_x = lane::fma(b4, dot<K>(pulls.by_b, by.by_x), sums.variance_x);
    sums.variance_y = lane::fma(b4, dot<K>(pulls.by_b, by.by_y), sums.variance_y);
}

/// Add the element of a point on the diagonal of A, which changes by (by_x, by_y).
template <class F>
inline void add_diagonal(MomentSlopes<F> &sums, const MovingPoint<F> &own, F by_x, F by_y)
{
    const F ab = own.a * own.b;
    const F bb = own.b * own.b;
    sums.mean_x = lane::minus_product(sums.mean_x, ab, by_x);
    sums.mean_y = lane::minus_product(sums.mean_y, ab, by_y);
    sums.variance_x = lane::fma(bb, by_x, sums.variance_x);
    sums.variance_y = lane::fma(bb, by_y, sums.variance_y);
}

/// Add a point to the derivatives. Of the variances k(x, x) only the neural network's depends on x.
template <gpom_kernel_t K, class F>
inline void add_point(MomentSlopes<F> &sums, const MovingPoint<F> &own, const Pulls<F> &pulls)
{
    add_pulls<K>(sums, own, pulls);
    if constexpr (K == GPOM_KERNEL_NN) {
        const F twice_d = own.feature.d + own.feature.d;
        const F slope = 2.0f * slope_of<K>(twice_d, twice_d);
        add_diagonal(sums, own, F(slope * own.slopes.by_x.d), F(slope * own.slopes.by_y.d));
    }
}

/// The pulls of all neighbours on the query.
template <gpom_kernel_t K, class F>
inline Pulls<F> pulls_on_query(const GpWork<F> &work, const SlopeWork<F> &moving, const F *pairs,
                               size_t n)
{
    Pulls<F> pulls = {};
    for (size_t j = 0; j < n; ++j) {
        add_pull<K, true>(pulls, pairs + pair_values(K) * j, work, moving, j);
    }
    return pulls;
}

/// The pulls of the query and of all neighbours on neighbour i.
template <gpom_kernel_t K, class F>
inline Pulls<F> pulls_on(const Neighbourhood<Dual<F>> &points, const GpWork<F> &work,
                         const SlopeWork<F> &moving, const MovingPoint<F> &query, size_t i)
{
    constexpr size_t n_values = pair_values(K);
    const size_t n = points.n_hits + points.n_free;
    const F *const pair_of_query = moving.pairs + n_values * (row_at(kTile * points.n_tiles()) + i);
    Pulls<F> pulls = {};
    if constexpr (K == GPOM_KERNEL_NN) {
        pulls.by_b = {pair_of_query[0] * query.feature.a, pair_of_query[0] * query.feature.b,
                      pair_of_query[0] * query.feature.c};
    } else {
        pulls.by_b = {pair_of_query[0], pair_of_query[1], F{}};
    }
    const F *pair = moving.pairs + n_values * row_at(i);
    for (size_t j = 0; j < i; ++j, pair += n_values) {
        add_pull<K, true>(pulls, pair, work, moving, j);
    }
    pair = moving.pairs + n_values * (row_at(i + 1) + i);
    for (size_t j = i + 1; j < n; pair += n_values * j, ++j) {
        add_pull<K, false>(pulls, pair, work, moving, j);
    }
    return pulls;
}

template <class F> inline Pull<F> product(F factor, const Feature<F> &p)
{
    return {factor * p.a, factor * p.b, factor * p.c};
}

/// All sums, after backward().
template <gpom_kernel_t K, class F>
inline MomentSlopes<F> moment_slopes(const KernelConstants constants,
                                     const Neighbourhood<Dual<F>> &points, const GpWork<F> &work,
                                     const SlopeWork<F> &moving, const MovingPoint<F> &query)
{
    const F zero = lane::splat<F>(0.0f);
    const float inv_sf2 = 1.0f / constants.sf2;
    const bool does_noise_move = moving.does_noise_move;
    const size_t n = points.n_hits + points.n_free;
    const F *const of_query = moving.pairs + pair_values(K) * row_at(kTile * points.n_tiles());
    if constexpr (K == GPOM_KERNEL_NN) {
        for (size_t i = 0; i < n; ++i) {
            moving.weighted[i] = {product(work.u[i], work.features[i]),
                                  product(work.v[i], work.features[i])};
        }
    }
    MomentSlopes<F> sums = {zero, zero, zero, zero};
    for (size_t i = 0; i < n; ++i) {
        const MovingPoint<F> own = {work.features[i], moving.features[i], work.u[i], work.v[i]};
        const Pulls<F> pulls = pulls_on<K>(points, work, moving, query, i);
        add_point<K>(sums, own, pulls);
        if (does_noise_move) {
            const Dual<F> noise = inv_sf2 * points.noise[i];
            add_diagonal(sums, own, noise.by_x, noise.by_y);
        }
    }
    add_point<K>(sums, query, pulls_on_query<K>(work, moving, of_query, n));
    return sums;
}

/// Block row i of (K + N) / sf2, as covariance_block_row(), and the slopes of its elements.
template <gpom_kernel_t K, class F>
inline void moving_block_row(const Neighbourhood<Dual<F>> &points, GpWork<F> &work,
                             const SlopeWork<F> &moving, F inv_sf2, size_t i)
{
    F *const panel = work.factor.l + panel_at(i);
    for (size_t r = 0; r < kTile; ++r) {
        const size_t n = kTile * i + r;
        const Feature<F> own = work.features[n];
        covariances_of_pairs<K>(own, work.features, n,
                                {panel + r, kTile, moving.pairs + pair_values(K) * row_at(n)});
        panel[kTile * n + r] = lane::fma(points.noise[n].value, inv_sf2, unit_variance<K>(own));
    }
}

/// The feature of a place that moves by (x_m.by_x, y_m.by_x) [1] if the query moves along x, or the
/// same along y. With the scale s of feature() and X = weight x, the neural network has
/// ds = -2 s^3 X . dX.
template <gpom_kernel_t K, class F>
inline Feature<F> feature_slope(const KernelConstants constants, const Feature<F> &place, F dx,
                                F dy)
{
    const F zero = lane::splat<F>(0.0f);
    const F a = constants.weight * dx;
    const F b = constants.weight * dy;
    if constexpr (K == GPOM_KERNEL_NN) {
        // s (X, Y) is in (b, c), s^2 in d. So ds / s is -2 (b, c) . s dX.
        const F s = lane::sqrt(place.d);
        const F moved_x = s * a;
        const F moved_y = s * b;
        const F rate = -2.0f * lane::fma(place.b, moved_x, F(place.c * moved_y));
        return {place.a * rate, lane::fma(place.b, rate, moved_x),
                lane::fma(place.c, rate, moved_y), 2.0f * place.d * rate};
    } else {
        return {a, b, zero, zero};
    }
}

/// The query's place in the frame of the covariance [m].
template <class F> struct MovingPlace {
    Dual<F> x_m, y_m;
};

/// predict() with derivatives. Mean and variance are the same to the bit.
template <gpom_kernel_t K, class F>
inline Moments<Dual<F>> predict_moving(const KernelConstants constants,
                                       const Neighbourhood<Dual<F>> &points, GpWork<F> &work,
                                       const SlopeWork<F> &moving, const MovingPlace<F> &frame)
{
    const F zero = lane::splat<F>(0.0f);
    const F inv_sf2 = lane::splat<F>(1.0f / constants.sf2);
    const Feature<F> place = feature<K>(constants, frame.x_m.value, frame.y_m.value);
    const FeatureSlopes<F> slopes = {
        feature_slope<K>(constants, place, frame.x_m.by_x, frame.y_m.by_x),
        feature_slope<K>(constants, place, frame.x_m.by_y, frame.y_m.by_y)};
    const MovingPoint<F> query = {place, slopes, zero, lane::splat<F>(-1.0f)};
    Moments<F> now = {zero, zero, zero}; // variance: what the neighbours explain of it
    work.factor.bad = zero;
    pad(points);
    const size_t n = kTile * points.n_tiles();
    for (size_t j = 0; j < n; ++j) {
        const Dual<F> x_m = points.x_m[j] + frame.x_m;
        const Dual<F> y_m = points.y_m[j] + frame.y_m;
        const Feature<F> point = feature<K>(constants, x_m.value, y_m.value);
        work.features[j] = point;
        moving.features[j] = {feature_slope<K>(constants, point, x_m.by_x, y_m.by_x),
                              feature_slope<K>(constants, point, x_m.by_y, y_m.by_y)};
        work.u[j] = lane::splat<F>(j < points.n_hits ? 1.0f : -1.0f);
    }
    covariances_of_pairs<K>(query.feature, work.features, n,
                            {work.v, 1, moving.pairs + pair_values(K) * row_at(n)});
    for (size_t i = 0; i < points.n_tiles(); ++i) {
        moving_block_row<K>(points, work, moving, inv_sf2, i);
        factor_block_row(work.factor, i);
        forward_block(work.factor, i, work.u, work.v);
        for (size_t j = kTile * i; j < kTile * (i + 1); ++j) {
            now.mean = lane::fma(work.v[j], work.u[j], now.mean);
            now.variance = lane::fma(work.v[j], work.v[j], now.variance);
        }
    }
    const F prior = unit_variance<K>(query.feature);
    backward(work.factor, points.n_tiles(), work.u, work.v);
    const MomentSlopes<F> by = moment_slopes<K>(constants, points, work, moving, query);
    const Dual<F> left =
        lane::max(Dual<F>{prior - now.variance, by.variance_x, by.variance_y}, fixed(zero));
    const auto good = work.factor.bad == zero;
    return {lane::select(good, Dual<F>{now.mean, by.mean_x, by.mean_y}, fixed(zero)),
            constants.sf2 * lane::select(good, left, fixed(prior)), fixed(work.factor.bad)};
}

} // namespace gpom
