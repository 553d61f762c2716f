// The model to be learnt, in double precision, and the parts of it that may be learnt.
#ifndef GPOM_TOOLS_LEARN_PARAMS_HPP
#define GPOM_TOOLS_LEARN_PARAMS_HPP

#include "gpom/params.h"

#include <array>
#include <optional>
#include <string>

namespace gpom_tools
{

/// Largest distance in the log terms [m], and a small distance that is added so that 0 has a
/// logarithm.
constexpr double kLogDistanceMax = 30.0;
constexpr double kLogDistanceMin = 0.02;

/// gpom_params_t without rounding. Names and neutral values are the same.
struct LearntParams {
    gpom_kernel_t kernel = GPOM_KERNEL_MATERN12;
    double sf2 = 1.0;
    double s0 = 60.0;
    double s1 = 1.0;
    double ell_m = 8.0;
    double sn2 = 0.2;
    double sn2_free = 0.2;
    double sn2_once = 0.0; ///< 0: same as sn2. It has no effect in maps that keep every beam.
    double alpha = 10.0;
    double beta = 0.0;
    double beta_far = 0.0; ///< Learnt only from places far from beams. 0 without fade_m.
    double gap_m = 0.1;
    double depth_m = 0.0;
    int scan_points_max = 0;
    double anisotropy = 0.0;
    double vote = 0.0;
    double line = 0.0;
    double fade_m = 0.0;                 ///< Set by the user, never learnt.
    std::array<double, 4> log_weights{}; ///< Weights of first hit, last hit, first free, last free.
    int n_hits = 8;
    int n_free = 8;
    int n_fading = 0; ///< Set by the user, never learnt.
    double p_occupied = 0.7;
    double p_free = 0.3;
};

/// Parts of the model that may leave their neutral values, besides kernel, noise, sigmoid and gap.
struct Ingredients {
    bool noise = false; ///< Free points have their own noise.
    bool anisotropy = false;
    bool vote = false;
    bool line = false;
    bool logs = false;
    bool depth = false;
    bool cap = false;
};

/// Parse "paper" (none), "full" (all) or a comma list of names. Throws std::runtime_error.
Ingredients parse_ingredients(const std::string &text);

/// Parameters that change neighbourhoods or reach, fixed at a value instead of learnt. fade_m is
/// never learnt, because places near beams hardly depend on it.
struct FixedParams {
    std::optional<double> fade_m, gap_m, depth_m;
    std::optional<int> scan_points_max, n_fading;
};

/// Parse "name=value,..." with the fields above. Throws std::runtime_error.
FixedParams parse_fixed(const std::string &text);

LearntParams with_fixed(LearntParams params, const FixedParams &fixed);

/// k(x*, x*) in the query's frame.
double prior_variance(const LearntParams &params);

/// Probability of occupancy far from all beams: every log distance is at its end, and there is no
/// vote.
double prior_probability(const LearntParams &params);

double normal_cdf(double z);

/// Round to float for the library. Throws std::runtime_error if the library refuses the parameters.
gpom_params_t to_library(const LearntParams &params);

/// The same to six digits, which hold all that learning knows: for files, which then are short and
/// agree with each other bit for bit. Throws likewise.
gpom_params_t to_six_digits(const LearntParams &params);

} // namespace gpom_tools

#endif
