#include "tools/learn/model.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

constexpr double kInverseSqrtTwoPi = 0.3989422804014327;

/// k and -r dk/dr, both without sf2, at distance t in length scales.
struct Decay {
    double k;
    double slope;
};

Decay decay_of(gpom_kernel_t kernel, double t)
{
    switch (kernel) {
    case GPOM_KERNEL_MATERN12: {
        const double e = std::exp(-t);
        return {e, t * e};
    }
    case GPOM_KERNEL_MATERN32: {
        const double s = std::sqrt(3.0) * t;
        const double e = std::exp(-s);
        return {(1.0 + s) * e, s * s * e};
    }
    case GPOM_KERNEL_SE: {
        const double e = std::exp(-0.5 * t * t);
        return {e, t * t * e};
    }
    case GPOM_KERNEL_ASKEY: {
        const double u = std::max(1.0 - t, 0.0);
        return {u * u * u, 3.0 * t * u * u};
    }
    case GPOM_KERNEL_NN:
        break;
    }
    return {0.0, 0.0};
}

/// dk/d log ell = -r dk/dr, and r dr/da = dx d(dx)/da.
Covariance stationary(const LearntParams &params, const CovariancePoint &p,
                      const CovariancePoint &q)
{
    const double dx = p.x_m - q.x_m;
    const double dy = p.y_m - q.y_m;
    const double r2 = dx * dx + dy * dy;
    const Decay decay = decay_of(params.kernel, std::sqrt(r2) / params.ell_m);
    const double slope = params.sf2 * decay.slope;
    const double by_anisotropy =
        r2 > 0.0 ? -slope * dx * (p.x_by_anisotropy - q.x_by_anisotropy) / r2 : 0.0;
    return {params.sf2 * decay.k, slope, 0.0, by_anisotropy};
}

/// Eq. 4: k = sf2 asin(c), c = 2 (s0 + s1 x . x') / sqrt(P P'), P = 1 + 2 (s0 + s1 |x|^2).
Covariance neural_network(const LearntParams &params, const CovariancePoint &p,
                          const CovariancePoint &q)
{
    const double s0 = params.s0, s1 = params.s1;
    const double dot = p.x_m * q.x_m + p.y_m * q.y_m;
    const double p2 = p.x_m * p.x_m + p.y_m * p.y_m;
    const double q2 = q.x_m * q.x_m + q.y_m * q.y_m;
    const double big_p = 1.0 + 2.0 * (s0 + s1 * p2);
    const double big_q = 1.0 + 2.0 * (s0 + s1 * q2);
    const double root = std::sqrt(big_p * big_q);
    const double c = std::clamp(2.0 * (s0 + s1 * dot) / root, -1.0, 1.0);
    const double by_c = params.sf2 / std::sqrt(std::max(1.0 - c * c, 1e-300));
    const double c_by_s0 = 2.0 * s0 / root - c * s0 * (1.0 / big_p + 1.0 / big_q);
    const double c_by_s1 = 2.0 * s1 * dot / root - c * s1 * (p2 / big_p + q2 / big_q);
    const double dot_by_a = p.x_by_anisotropy * q.x_m + p.x_m * q.x_by_anisotropy;
    const double c_by_a =
        2.0 * s1 * dot_by_a / root -
        2.0 * c * s1 * (p.x_m * p.x_by_anisotropy / big_p + q.x_m * q.x_by_anisotropy / big_q);
    return {params.sf2 * std::asin(c), by_c * c_by_s0, by_c * c_by_s1, by_c * c_by_a};
}

/// The log distance that a log weight multiplies. It fades to the log distance of the end.
double faded_log_distance(double rho, double log_distance)
{
    return rho * log_distance + (1.0 - rho) * std::log(kLogDistanceMax + kLogDistanceMin);
}

/// vote cs + line + log terms + beta. All of them fade to their values far from all beams.
double offset_of(const LearntParams &params, const Neighbourhood &neighbourhood)
{
    const double rho = remaining_correlation(params, neighbourhood);
    double offset = params.beta + (1.0 - rho) * params.beta_far +
                    params.vote * rho * neighbourhood.vote + params.line * rho * neighbourhood.line;
    for (std::size_t i = 0; i < params.log_weights.size(); ++i) {
        offset += params.log_weights[i] * faded_log_distance(rho, neighbourhood.log_distances[i]);
    }
    return offset;
}

} // namespace

Covariance covariance_of(const LearntParams &params, const CovariancePoint &p,
                         const CovariancePoint &q)
{
    return params.kernel == GPOM_KERNEL_NN ? neural_network(params, p, q)
                                           : stationary(params, p, q);
}

double remaining_correlation(const LearntParams &params, const Neighbourhood &neighbourhood)
{
    if (params.fade_m <= 0.0) {
        return 1.0;
    }
    const double fade2 = params.fade_m * params.fade_m;
    double nearest2 = fade2;
    for (const NeighbourPoint &point : neighbourhood.points) {
        nearest2 =
            std::min(nearest2, point.along_m * point.along_m + point.across_m * point.across_m);
    }
    return 1.0 - nearest2 / fade2;
}

void ModelWork::assemble(const LearntParams &params, const Neighbourhood &neighbourhood,
                         bool derivatives)
{
    n_ = neighbourhood.points.size();
    const auto n = static_cast<Eigen::Index>(n_);
    const double shrink = 1.0 - params.anisotropy * (1.0 - neighbourhood.axis_ratio);
    rho_ = remaining_correlation(params, neighbourhood);
    points_.clear();
    noise_terms_.clear();
    y_.resize(n);
    noise_.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const NeighbourPoint &point = neighbourhood.points[static_cast<std::size_t>(i)];
        points_.push_back({shrink * point.along_m, point.across_m,
                           -(1.0 - neighbourhood.axis_ratio) * point.along_m});
        y_(i) = point.label;
        const NoiseTerms terms = noise_terms(params, point);
        noise_terms_.push_back(terms);
        noise_(i) = terms.by_sf2 + terms.by_sn2 + terms.by_sn2_free;
    }
    points_.push_back({0.0, 0.0, 0.0});
    for (Eigen::MatrixXd *matrix : {&k_, &by_shape0_, &by_shape1_, &by_anisotropy_}) {
        matrix->resize(n + 1, n + 1);
    }
    for (Eigen::Index j = 0; j <= n; ++j) {
        for (Eigen::Index i = j; i <= n; ++i) {
            const Covariance c = covariance_of(params, points_[static_cast<std::size_t>(i)],
                                               points_[static_cast<std::size_t>(j)]);
            k_(i, j) = c.k;
            if (derivatives) {
                by_shape0_(i, j) = c.by_shape0;
                by_shape1_(i, j) = c.by_shape1;
                by_anisotropy_(i, j) = c.by_anisotropy;
            }
        }
    }
}

ModelWork::NoiseTerms ModelWork::whole_noise(const LearntParams &params,
                                             const NeighbourPoint &point)
{
    const double once = std::max(params.sn2_once, params.sn2);
    if (point.label < 0.0) {
        return {0.0, 0.0, params.sn2_free, 0.0};
    }
    switch (point.noise) {
    case HitNoise::kPast: // as raised() of noise.hpp with an excess of 1
        return {prior_variance(params), 2.0 * params.sn2, 0.0, 0.0};
    case HitNoise::kOnce: // sn2 times a factor: it depends on both parameters
        return {0.0, once, 0.0, once};
    case HitNoise::kSeen:
        break;
    }
    return {0.0, params.sn2, 0.0, 0.0};
}

/// Noise of a point: (v + k**) / w - k** with the weight w of a fading neighbour. Equal points are
/// one point with the noise divided by their number.
ModelWork::NoiseTerms ModelWork::noise_terms(const LearntParams &params,
                                             const NeighbourPoint &point)
{
    const NoiseTerms whole = whole_noise(params, point);
    const double n_whole = point.count * point.weight;
    const double faded = (1.0 - point.weight) * prior_variance(params);
    return {(whole.by_sf2 + faded) / n_whole, whole.by_sn2 / n_whole, whole.by_sn2_free / n_whole,
            whole.by_sn2_once / n_whole};
}

void ModelWork::solve()
{
    const auto n = static_cast<Eigen::Index>(n_);
    system_ = k_.topLeftCorner(n, n);
    system_.diagonal() += noise_;
    factor_.compute(system_); // reads only the lower triangle
    k_star_ = k_.row(n).head(n).transpose();
    a_ = factor_.solve(y_);
    b_ = factor_.solve(k_star_);
}

LatentMoments ModelWork::moments() const
{
    const auto n = static_cast<Eigen::Index>(n_);
    return {rho_ * k_star_.dot(a_), std::max(k_(n, n) - rho_ * rho_ * k_star_.dot(b_), 0.0)};
}

void ModelWork::moments_adjoint(double by_mean, double by_variance, Adjoint &adjoint) const
{
    // With a = A^-1 y and b = A^-1 k*, dmu = a . dk* - b . dA a and
    // dvar = dk** - 2 b . dk* + b . dA b; both triangles of dA are gathered in the lower one.
    // The faded mean is rho mu, the faded variance k** - rho^2 (k** - var).
    const auto n = static_cast<Eigen::Index>(n_);
    const double by_faded_variance = by_variance;
    by_mean *= rho_;
    by_variance *= rho_ * rho_;
    adjoint.resize(n + 1, n + 1);
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = j; i < n; ++i) {
            const double both = i == j ? 0.5 : 1.0;
            adjoint(i, j) = both * (2.0 * by_variance * b_(i) * b_(j) -
                                    by_mean * (b_(i) * a_(j) + b_(j) * a_(i)));
        }
        adjoint(n, j) = by_mean * a_(j) - 2.0 * by_variance * b_(j);
    }
    adjoint(n, n) = by_faded_variance;
}

void ModelWork::accumulate(const Adjoint &adjoint, Gradient &gradient) const
{
    const auto n = static_cast<Eigen::Index>(n_);
    for (Eigen::Index j = 0; j <= n; ++j) {
        for (Eigen::Index i = j; i <= n; ++i) {
            const double w = adjoint(i, j);
            gradient(kByShape0) += w * by_shape0_(i, j);
            gradient(kByShape1) += w * by_shape1_(i, j);
            gradient(kBySf2) += w * k_(i, j);
            gradient(kByAnisotropy) += w * by_anisotropy_(i, j);
        }
    }
    for (Eigen::Index i = 0; i < n; ++i) {
        const NoiseTerms &terms = noise_terms_[static_cast<std::size_t>(i)];
        gradient(kBySf2) += adjoint(i, i) * terms.by_sf2;
        gradient(kByShape0) += adjoint(i, i) * terms.by_sf2 / k_(n, n) * by_shape0_(n, n);
        gradient(kBySn2) += adjoint(i, i) * terms.by_sn2;
        gradient(kBySn2Free) += adjoint(i, i) * terms.by_sn2_free;
        gradient(kBySn2Once) += adjoint(i, i) * terms.by_sn2_once;
    }
}

double probability_of(const LearntParams &params, const Neighbourhood &neighbourhood,
                      ModelWork &work)
{
    work.assemble(params, neighbourhood, false);
    work.solve();
    const LatentMoments moments = work.moments();
    return normal_cdf((params.alpha * moments.mean + offset_of(params, neighbourhood)) /
                      std::sqrt(1.0 + params.alpha * params.alpha * moments.variance));
}

SigmoidLoss sigmoid_loss(double alpha, double offset, const LatentMoments &moments, bool occupied)
{
    const double argument = alpha * moments.mean + offset;
    const double spread2 = 1.0 + alpha * alpha * moments.variance;
    const double spread = std::sqrt(spread2);
    const double sign = occupied ? 1.0 : -1.0;
    const double z = argument / spread;
    const double p = kLossFloor + (1.0 - 2.0 * kLossFloor) * normal_cdf(sign * z);
    const double by_z =
        -sign * (1.0 - 2.0 * kLossFloor) * kInverseSqrtTwoPi * std::exp(-0.5 * z * z) / p;
    const double by_spread2 = -0.5 * by_z * argument / (spread2 * spread);
    return {-std::log(p), by_z / spread,
            by_z / spread * alpha * moments.mean +
                2.0 * by_spread2 * alpha * alpha * moments.variance,
            by_z / spread * alpha, by_spread2 * alpha * alpha};
}

double loss_of(const LearntParams &params, const Neighbourhood &neighbourhood, ModelWork &work,
               Gradient *gradient)
{
    work.assemble(params, neighbourhood, gradient != nullptr);
    work.solve();
    const SigmoidLoss loss = sigmoid_loss(params.alpha, offset_of(params, neighbourhood),
                                          work.moments(), neighbourhood.occupied);
    if (gradient == nullptr) {
        return loss.value;
    }
    thread_local Adjoint adjoint;
    work.moments_adjoint(loss.by_mean, loss.by_variance, adjoint);
    work.accumulate(adjoint, *gradient);
    (*gradient)(kByAlpha) += loss.by_alpha_log;
    (*gradient)(kByBeta) += loss.by_argument;
    const double rho = remaining_correlation(params, neighbourhood);
    (*gradient)(kByBetaFar) += loss.by_argument * (1.0 - rho);
    (*gradient)(kByVote) += loss.by_argument * rho * neighbourhood.vote;
    (*gradient)(kByLine) += loss.by_argument * rho * neighbourhood.line;
    for (int i = 0; i < 4; ++i) {
        const double log_distance = neighbourhood.log_distances[static_cast<std::size_t>(i)];
        (*gradient)(kByLogWeight + i) += loss.by_argument * faded_log_distance(rho, log_distance);
    }
    return loss.value;
}

} // namespace gpom_tools
