// Learning as in the paper: log marginal likelihood, then the sigmoid by leave-one-out.
#ifndef GPOM_TOOLS_LEARN_LML_HPP
#define GPOM_TOOLS_LEARN_LML_HPP

#include "tools/learn/fit.hpp"

namespace gpom_tools
{

struct LmlOptions {
    bool composite = false;     ///< Over the learning places' neighbourhoods, not one subset.
    std::size_t n_points = 600; ///< Of the random subset: half hits, half free points.
    std::size_t n_composite = 400;
    std::uint64_t seed = 0;
};

/// Most points of the exact subset.
constexpr std::size_t kLmlPointsMax = 1000;
/// Spacing of the free points on a free segment [m].
constexpr double kLmlFreeSpacing = 1.0;

/// A random subset of hits and of discretised free points, about its own middle.
Neighbourhood random_subset(const LearnWorld &world, double gap_m, std::size_t n_points,
                            std::uint64_t seed);

/// Eq. 6 with its lost y, a point: -log p(y | X) / n, its gradient by the covariance's parameters
/// and noises added unless NULL.
double negative_lml(const LearntParams &params, const Neighbourhood &points, ModelWork &work,
                    Gradient *gradient);

/// Moments of every point from the others (eqs. 8 and 9 with K + sn2 I); the variance is the latent
/// function's, 1 / [(K + N)^-1]ii less the noise.
std::vector<LatentMoments> left_out_moments(const LearntParams &params, const Neighbourhood &points,
                                            ModelWork &work);

/// Simulated annealing, then L-BFGS-B on eq. 6; then alpha and beta on eq. 7 by leave-one-out.
/// The fit's loss is that of the sigmoid. Always the paper's model: were the noises of hits and
/// free points apart, the labels would be explained by calling all hits noise (csail: AUC 0.82).
Fit fit_lml(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
            const LmlOptions &lml, const Advance &advance);

} // namespace gpom_tools

#endif
