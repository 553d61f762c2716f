// The model's probability for one neighbourhood and its derivatives, in double precision.
#ifndef GPOM_TOOLS_LEARN_MODEL_HPP
#define GPOM_TOOLS_LEARN_MODEL_HPP

#include "tools/learn/neighbours.hpp"
#include "tools/learn/params.hpp"

#include <Eigen/Dense>

namespace gpom_tools
{

/// Indices of a gradient. For positive parameters the derivative is with respect to their
/// logarithm.
enum Derivative : int {
    kByShape0 = 0, ///< log ell, or log s0 of kernel NN.
    kByShape1,     ///< log s1 of kernel NN.
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

/// Learning keeps probabilities away from 0 and 1 in a smooth way: a share kLossFloor of the places
/// may have any label.
constexpr double kLossFloor = 1e-4;

/// Latent mean and variance at the query, eqs. 2 and 3.
struct LatentMoments {
    double mean;
    double variance;
};

/// k and its derivatives with respect to the covariance's parameters.
struct Covariance {
    double k;
    double by_shape0;
    double by_shape1;
    double by_anisotropy;
};

/// A point with the coordinates that the covariance uses: already scaled by the anisotropy, with
/// the derivative with respect to the anisotropy.
struct CovariancePoint {
    double x_m, y_m;
    double x_by_anisotropy;
};

Covariance covariance_of(const LearntParams &params, const CovariancePoint &p,
                         const CovariancePoint &q);

/// Weights of every covariance in a scalar: d value = sum over i > j of w(i, j) dk(i, j) + sum over
/// i of w(i, i) d(k(i, i) + noise). Only the lower triangle is used. The last index is the query.
using Adjoint = Eigen::MatrixXd;

/// The covariance matrix of one neighbourhood, its factor and its derivatives. The memory is reused
/// for the next neighbourhood. The query is the last point, without noise.
class ModelWork {
public:
    /// Compute the covariances, and their derivatives if asked.
    void assemble(const LearntParams &params, const Neighbourhood &neighbourhood, bool derivatives);
    /// Factor K + N and solve for y and k*.
    void solve();
    LatentMoments moments() const;
    /// Add the derivatives for an adjoint to the covariance entries of a gradient. Needs
    /// derivatives.
    void accumulate(const Adjoint &adjoint, Gradient &gradient) const;
    /// Compute the adjoint of by_mean * mean + by_variance * variance.
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
    /// Noise variances, and their derivatives with respect to the logarithms of the parameters in
    /// them.
    struct NoiseTerms {
        double by_sf2, by_sn2, by_sn2_free, by_sn2_once;
    };
    static NoiseTerms whole_noise(const LearntParams &params, const NeighbourPoint &point);
    static NoiseTerms noise_terms(const LearntParams &params, const NeighbourPoint &point);

    Eigen::VectorXd y_, a_, b_, k_star_, noise_;
    std::vector<NoiseTerms> noise_terms_;
};

/// Correlation of f at the query with what its neighbours say about f: 1 - d^2 / fade_m^2, with d
/// the distance to the nearest neighbour. 0 from fade_m on.
double remaining_correlation(const LearntParams &params, const Neighbourhood &neighbourhood);

/// Probability of occupancy by eq. 7 with all additional terms.
double probability_of(const LearntParams &params, const Neighbourhood &neighbourhood,
                      ModelWork &work);

/// -log of the probability of the true occupancy. Adds its gradient to *gradient unless NULL.
double loss_of(const LearntParams &params, const Neighbourhood &neighbourhood, ModelWork &work,
               Gradient *gradient);

/// The loss as a function of the sigmoid's argument, for moments that are already known.
struct SigmoidLoss {
    double value;
    double by_argument, by_alpha_log, by_mean, by_variance;
};
SigmoidLoss sigmoid_loss(double alpha, double offset, const LatentMoments &moments, bool occupied);

} // namespace gpom_tools

#endif
