// The model's probability for one neighbourhood and its derivatives, in double precision.
#ifndef GPOM_TOOLS_LEARN_MODEL_HPP
#define GPOM_TOOLS_LEARN_MODEL_HPP

#include "tools/learn/neighbours.hpp"
#include "tools/learn/params.hpp"

#include <Eigen/Dense>

namespace gpom_tools
{

/// Places in a gradient; positive parameters are differentiated by their logarithm.
enum Derivative : int {
    kByShape0 = 0, ///< log ell, or log s0 of NN.
    kByShape1,     ///< log s1 of NN.
    kBySf2,
    kBySn2,
    kBySn2Free,
    kBySn2Once, ///< log (sn2_once / sn2).
    kByAlpha,
    kByBeta,
    kByAnisotropy,
    kByVote,
    kByLine,
    kByLogWeight, ///< The first of four.
    kByBetaFar = kByLogWeight + 4,
    kDerivatives
};
using Gradient = Eigen::Matrix<double, kDerivatives, 1>;

/// Probabilities are kept this far from 0 and 1 in what learning maximises, smoothly: a share
/// kLossFloor of the places may have any label.
constexpr double kLossFloor = 1e-4;

/// Latent mean and variance at the query, eqs. 2 and 3.
struct LatentMoments {
    double mean;
    double variance;
};

/// k and its derivatives by the covariance's parameters.
struct Covariance {
    double k;
    double by_shape0;
    double by_shape1;
    double by_anisotropy;
};

/// A point as the covariance sees it: coordinates already shrunk, and their derivative by the
/// anisotropy.
struct CovariancePoint {
    double x_m, y_m;
    double x_by_anisotropy;
};

Covariance covariance_of(const LearntParams &params, const CovariancePoint &p,
                         const CovariancePoint &q);

/// Weights of a scalar on every covariance: d value = sum over i > j of w(i, j) dk(i, j) + sum over
/// i of w(i, i) d(k(i, i) + noise). Only the lower triangle counts; the last index is the query.
using Adjoint = Eigen::MatrixXd;

/// One neighbourhood's covariance matrix, its factor and its derivatives; keeps its memory from one
/// neighbourhood to the next. The query counts as a last point without noise.
class ModelWork {
public:
    /// Covariances, and with derivatives if asked.
    void assemble(const LearntParams &params, const Neighbourhood &neighbourhood, bool derivatives);
    /// Factor K + N and solve for y and k*.
    void solve();
    LatentMoments moments() const;
    /// Add to the gradient's covariance entries what the adjoint says. Needs derivatives.
    void accumulate(const Adjoint &adjoint, Gradient &gradient) const;
    /// Adjoint of by_mean * mean + by_variance * variance.
    void moments_adjoint(double by_mean, double by_variance, Adjoint &adjoint) const;

    std::size_t size() const { return n_; }
    const Eigen::LLT<Eigen::MatrixXd> &factor() const { return factor_; }
    const Eigen::VectorXd &labels() const { return y_; }
    const Eigen::VectorXd &weights() const { return a_; } ///< (K + N)^-1 y
    const Eigen::VectorXd &noises() const { return noise_; }

private:
    std::size_t n_ = 0;
    double rho_ = 1.0; ///< remaining_correlation()
    std::vector<CovariancePoint> points_;
    Eigen::MatrixXd k_, by_shape0_, by_shape1_, by_anisotropy_, system_;
    Eigen::LLT<Eigen::MatrixXd> factor_;
    /// Noise variances, and their derivatives by the logarithms of what they are made of.
    struct NoiseTerms {
        double by_sf2, by_sn2, by_sn2_free, by_sn2_once;
    };
    static NoiseTerms whole_noise(const LearntParams &params, const NeighbourPoint &point);
    static NoiseTerms noise_terms(const LearntParams &params, const NeighbourPoint &point);

    Eigen::VectorXd y_, a_, b_, k_star_, noise_;
    std::vector<NoiseTerms> noise_terms_;
};

/// Between f at the query and what its neighbours tell of f: 1 - d^2 / fade_m^2, d being the
/// distance to the nearest of them, 0 from there on.
double remaining_correlation(const LearntParams &params, const Neighbourhood &neighbourhood);

/// Probability of occupancy by eq. 7 and the terms inside it.
double probability_of(const LearntParams &params, const Neighbourhood &neighbourhood,
                      ModelWork &work);

/// -log of the probability of what is there; its gradient is added to *gradient unless NULL.
double loss_of(const LearntParams &params, const Neighbourhood &neighbourhood, ModelWork &work,
               Gradient *gradient);

/// The same of a sigmoid's argument alone: for moments that are already known.
struct SigmoidLoss {
    double value;
    double by_argument, by_alpha_log, by_mean, by_variance;
};
SigmoidLoss sigmoid_loss(double alpha, double offset, const LatentMoments &moments, bool occupied);

} // namespace gpom_tools

#endif
