// Fitting the model to places of known occupancy.
#ifndef GPOM_TOOLS_LEARN_FIT_HPP
#define GPOM_TOOLS_LEARN_FIT_HPP

#include "tools/eval/metrics.hpp"
#include "tools/learn/data.hpp"
#include "tools/learn/model.hpp"
#include "tools/learn/optimiser.hpp"

#include <functional>
#include <string>
#include <vector>

namespace gpom_tools
{

constexpr double kAlphaMax = 60.0; ///< Separable data would drive it to infinity.
constexpr double kGapMax = 0.3;    ///< The largest gap that is tried [m].
/// The prior probability stays in [0.35, 0.65]: |argument of its Phi| is at most this.
constexpr double kPriorArgumentMax = 0.38532046640756773;

/// With beta_far the prior probability stays in [0.31, 0.69]: inside the thresholds of the files.
constexpr double kFarArgumentMax = 0.4958503473474533;

struct FitOptions {
    Ingredients ingredients;
    FixedParams fixed;
    double ell_max_m = 12.0; ///< Askey's support may be three times it: the same decay at 0.
    int n_hits = 8;
    int n_free = 8;
    unsigned n_threads = 0;   ///< 0: all cores.
    bool has_once = false;    ///< sn2_once is learnt, too: the map tells hits seen once (live.h).
    double free_weight = 1.0; ///< What a free place counts where an occupied one counts 1.
};

/// Coordinates of the optimiser: logarithms of ell or s0, s1, sf2, sn2 / sf2, sn2_free / sf2,
/// sn2_once / sn2, alpha; the argument of the prior probability's Phi in place of beta, so that its
/// bounds are a box; and the rest as it is. Only those that may change count.
class FitSpace {
public:
    FitSpace(gpom_kernel_t kernel, const FitOptions &options);

    Box box() const;
    Eigen::VectorXd coordinates(const LearntParams &params) const;
    /// The base's parameters with the coordinates' in their place.
    LearntParams params(const LearntParams &base, const Eigen::VectorXd &x) const;
    /// From derivatives by the parameters to those by the coordinates.
    Eigen::VectorXd gradient(const LearntParams &params, const Gradient &by_params) const;

private:
    Gradient chained(const LearntParams &params, Gradient by_params) const;

    gpom_kernel_t kernel_;
    bool two_noises_, has_once_;
    std::vector<int> free_; ///< Of Derivative, in its order; kByBeta is the prior's argument.
    Gradient low_, high_;
};

/// With no less noise than gpom_params_check() allows, which depends on gap and anisotropy.
LearntParams with_legal_noise(LearntParams params);

/// Mean loss over neighbourhoods, weighted (FitOptions::free_weight); its gradient unless NULL. The
/// same with any number of threads.
double mean_loss(const LearntParams &params, const std::vector<Neighbourhood> &neighbourhoods,
                 const FitOptions &options, Gradient *gradient);

/// A sentence for each parameter that ended at the edge of its search: which, and what to do.
std::vector<std::string> edge_warnings(const LearntParams &params, const FitOptions &options);

/// One attempt: where it started and where it ended.
struct FitAttempt {
    std::string label;
    double loss;
    int n_evaluations;
};

struct Fit {
    LearntParams params;
    double loss; ///< Mean negative log likelihood of the learning places.
    std::vector<FitAttempt> attempts;
};

using Advance = std::function<void(double share)>;

/// Leave-one-beam-out, or against truth: minimise mean_loss() over everything that may be learnt.
/// Several starts; then gap, depth and cap by coordinate descent over a few values each.
Fit fit_kernel(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
               const Advance &advance);

/// beta_far by the places anywhere, all else as it is; nothing without those or without fade_m.
LearntParams fit_far(LearntParams params, const LearnData &data, FitOptions options);

NeighbourRule rule_of(const LearntParams &params);

/// What the model predicts at places.
std::vector<Prediction> predictions_of(const LearntParams &params,
                                       const std::vector<LearnWorld> &worlds,
                                       const std::vector<LearnPlace> &places, unsigned n_threads);

} // namespace gpom_tools

#endif
