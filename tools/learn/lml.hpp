// Learning as in the paper: first the log marginal likelihood, then the sigmoid by leave-one-out.
#ifndef GPOM_TOOLS_LEARN_LML_HPP
#define GPOM_TOOLS_LEARN_LML_HPP

#include "tools/learn/fit.hpp"

namespace gpom_tools
{

struct LmlOptions {
    bool composite = false;     ///< Use the neighbourhoods of the places to learn from, instead of
                                ///< one subset.
    std::size_t n_points = 600; ///< Size of the random subset: half hits, half free points.
    std::size_t n_composite = 400;
    std::uint64_t seed = 0;
};

/// Most points of the subset.
constexpr std::size_t kLmlPointsMax = 1000;
/// Spacing of the free points on a free segment [m].
constexpr double kLmlFreeSpacing = 1.0;

/// A random subset of hits and of free points on free segments, relative to its own middle.
Neighbourhood random_subset(const LearnWorld &world, double gap_m, std::size_t n_points,
                            std::uint64_t seed);

/// Eq. 6, in which the paper leaves out a y, per point: -log p(y | X) / n. Adds its gradient with
/// respect to covariance parameters and noises, unless NULL.
double negative_lml(const LearntParams &params, const Neighbourhood &points, ModelWork &work,
                    Gradient *gradient);

/// Moments of every point, predicted from the other points (eqs. 8 and 9 with K + sn2 I). The
/// variance is that of the latent function, 1 / [(K + N)^-1]ii minus the noise.
std::vector<LatentMoments> left_out_moments(const LearntParams &params, const Neighbourhood &points,
                                            ModelWork &work);

/// Fit eq. 6 by simulated annealing and then L-BFGS-B. Then fit alpha and beta of eq. 7 by
/// leave-one-out. The loss of the fit is the loss of the sigmoid. The model is always the paper's,
/// with one noise for hits and free points. With separate noises, the likelihood would explain the
/// labels by treating all hits as noise (csail: AUC 0.82).
Fit fit_lml(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
            const LmlOptions &lml, const Advance &advance);

} // namespace gpom_tools

#endif
