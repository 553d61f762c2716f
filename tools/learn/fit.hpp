// Fits the model to places of known occupancy.
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

constexpr double kAlphaMax = 60.0; ///< Data without overlap would drive alpha to infinity.
constexpr double kGapMax = 0.3;    ///< Largest gap in the search [m].
/// The prior probability stays in [0.35, 0.65]: this is the largest |argument| of its Phi.
constexpr double kPriorArgumentMax = 0.38532046640756773;

/// With beta_far the prior probability stays in [0.31, 0.69], inside the thresholds of the
/// parameter files.
constexpr double kFarArgumentMax = 0.4958503473474533;

struct FitOptions {
    Ingredients ingredients;
    FixedParams fixed;
    double ell_max_m = 12.0; ///< Longest length scale. Askey's support may be three times as long,
                             ///< because it then has the same decay at 0.
    int n_hits = 8;
    int n_free = 8;
    unsigned n_threads = 0;   ///< 0: all cores.
    bool has_once = false;    ///< Learn sn2_once, too. It needs a map that marks hits seen once
                              ///< (live.h).
    double free_weight = 1.0; ///< Weight of a free place. An occupied place has 1.
};

/// Coordinates of the optimiser: logarithms of ell or s0, s1, sf2, sn2 / sf2, sn2_free / sf2,
/// sn2_once / sn2, alpha. The argument of the prior probability's Phi replaces beta, so that its
/// bounds are a box. Other parameters are used as they are. Only parameters that may change are
/// coordinates.
class FitSpace {
public:
    FitSpace(gpom_kernel_t kernel, const FitOptions &options);

    Box box() const;
    Eigen::VectorXd coordinates(const LearntParams &params) const;
    /// The parameters of `base`, with the coordinates in their places.
    LearntParams params(const LearntParams &base, const Eigen::VectorXd &x) const;
    /// Convert derivatives with respect to parameters into derivatives with respect to coordinates.
    Eigen::VectorXd gradient(const LearntParams &params, const Gradient &by_params) const;

private:
    Gradient chained(const LearntParams &params, Gradient by_params) const;

    gpom_kernel_t kernel_;
    bool two_noises_, has_once_;
    std::vector<int> free_; ///< Indices of Derivative, in order. kByBeta is the argument of the
                            ///< prior probability's Phi.
    Gradient low_, high_;
};

/// Raise the noise to the least value that gpom_params_check() allows. It depends on gap and
/// anisotropy.
LearntParams with_legal_noise(LearntParams params);

/// Weighted mean loss over neighbourhoods (FitOptions::free_weight), and its gradient unless NULL.
/// The result does not depend on the number of threads.
double mean_loss(const LearntParams &params, const std::vector<Neighbourhood> &neighbourhoods,
                 const FitOptions &options, Gradient *gradient);

/// One sentence for each parameter that ended at the edge of its search, with what to do.
std::vector<std::string> edge_warnings(const LearntParams &params, const FitOptions &options);

/// One attempt: its start and its result.
struct FitAttempt {
    std::string label;
    double loss;
    int n_evaluations;
};

struct Fit {
    LearntParams params;
    double loss; ///< Mean negative log likelihood of the places to learn from.
    std::vector<FitAttempt> attempts;
};

using Advance = std::function<void(double share)>;

/// Minimise mean_loss() over all parameters that may be learnt, with left-out beams or against
/// truth. Starts from several points. Then finds gap, depth and cap by coordinate descent over a
/// few values each.
Fit fit_kernel(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
               const Advance &advance);

/// Learn beta_far from the places anywhere, with all other parameters fixed. Does nothing without
/// such places or without fade_m.
LearntParams fit_far(LearntParams params, const LearnData &data, FitOptions options);

NeighbourRule rule_of(const LearntParams &params);

/// Probabilities that the model predicts at places.
std::vector<Prediction> predictions_of(const LearntParams &params,
                                       const std::vector<LearnWorld> &worlds,
                                       const std::vector<LearnPlace> &places, unsigned n_threads);

} // namespace gpom_tools

#endif
