#include "tools/learn/fit.hpp"

#include "tools/map/parallel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace gpom_tools
{
namespace
{

// Iterations from each start; only the best fit goes on to convergence.
constexpr int kStartIterations = 50;
constexpr int kStepIterations = 30; // iterations for each value of gap, depth and cap
constexpr int kProbeIterations = 6; // iterations before a value may be given up
constexpr double kHopeless = 3e-3;  // a value is given up if its loss is still this much worse
                                    // than the best
constexpr int kPolishIterations = 100;
constexpr double kStepGainMin = 2e-4; ///< Least improvement of the loss for which a neighbourhood
                                      ///< is changed.

bool is_rough(gpom_kernel_t kernel)
{
    return kernel == GPOM_KERNEL_MATERN12 || kernel == GPOM_KERNEL_ASKEY;
}

/// Smallest noise in the search, as a share of sf2.
double noise_ratio_min(gpom_kernel_t kernel) { return is_rough(kernel) ? 1e-5 : 1e-2; }

/// Longest length scale in the search. gpom_params_check() allows at most 1000 m.
double ell_longest_m(gpom_kernel_t kernel, const FitOptions &options)
{
    return std::min(options.ell_max_m * (kernel == GPOM_KERNEL_ASKEY ? 3.0 : 1.0), 1000.0);
}

double log_end() { return std::log(kLogDistanceMax + kLogDistanceMin); }

double weight_sum(const LearntParams &params)
{
    return std::accumulate(params.log_weights.begin(), params.log_weights.end(), 0.0);
}

double prior_spread(const LearntParams &params)
{
    return std::sqrt(1.0 + params.alpha * params.alpha * prior_variance(params));
}

/// A place to start from: length scale (of NN: s0 and s1), noise ratios, sigmoid.
struct Start {
    const char *label;
    double ell_m, s0, s1;
    double noise_ratio, noise_ratio_free;
    double sf2, alpha, anisotropy;
};

constexpr Start kStarts[] = {
    {"long, little noise", 8.0, 50.0, 1.0, 0.01, 0.1, 1.0, 6.0, 0.0},
    {"short, noisy", 1.5, 1.0, 1.0, 0.1, 0.3, 1.0, 3.0, 0.0},
    {"middling, shrunk", 4.0, 5.0, 10.0, 0.02, 0.2, 2.0, 4.0, 0.7},
    {"long, steep", 12.0, 200.0, 0.3, 0.002, 0.02, 0.5, 15.0, 0.4},
};

LearntParams params_of(const Start &start, gpom_kernel_t kernel, const FitOptions &options)
{
    LearntParams params;
    params.kernel = kernel;
    params.n_hits = options.n_hits;
    params.n_free = options.n_free;
    params.ell_m = start.ell_m * (kernel == GPOM_KERNEL_ASKEY ? 3.0 : 1.0);
    params.s0 = start.s0;
    params.s1 = start.s1;
    params.sf2 = start.sf2;
    params.sn2 = start.noise_ratio * start.sf2;
    params.sn2_free =
        (options.ingredients.noise ? start.noise_ratio_free : start.noise_ratio) * start.sf2;
    params.alpha = start.alpha;
    params.anisotropy = options.ingredients.anisotropy ? start.anisotropy : 0.0;
    return with_fixed(params, options.fixed);
}

/// Fit the continuous parameters for one choice of neighbourhoods.
Minimum descend(const LearntParams &start, const FitSpace &space,
                const std::vector<Neighbourhood> &neighbourhoods, const FitOptions &options,
                int iterations_max)
{
    const Objective objective = [&](const Eigen::VectorXd &x, Eigen::VectorXd &gradient) {
        const LearntParams params = space.params(start, x);
        Gradient by_params;
        const double loss = mean_loss(params, neighbourhoods, options, &by_params);
        gradient = space.gradient(params, by_params);
        return loss;
    };
    return minimise(objective, space.coordinates(start), space.box(), iterations_max);
}

/// A parameter that changes neighbourhoods, and the values to try for it.
struct Step {
    const char *name;
    std::vector<double> values;
    void (*set)(LearntParams &, double);
    double (*get)(const LearntParams &);
};

std::vector<Step> steps_of(const Ingredients &ingredients, const FixedParams &fixed)
{
    std::vector<Step> steps;
    if (ingredients.cap && !fixed.scan_points_max) {
        steps.push_back({"scan_points_max",
                         {0.0, 1.0, 2.0, 3.0, 4.0},
                         [](LearntParams &p, double v) { p.scan_points_max = static_cast<int>(v); },
                         [](const LearntParams &p) { return double(p.scan_points_max); }});
    }
    if (ingredients.depth && !fixed.depth_m) {
        steps.push_back({"depth_m",
                         {0.0, 0.1, 0.3, 0.6, 1.0, 2.0},
                         [](LearntParams &p, double v) { p.depth_m = v; },
                         [](const LearntParams &p) { return p.depth_m; }});
    }
    if (!fixed.gap_m) {
        steps.push_back({"gap_m",
                         {0.0, 0.02, 0.05, 0.1, 0.2, kGapMax},
                         [](LearntParams &p, double v) { p.gap_m = v; },
                         [](const LearntParams &p) { return p.gap_m; }});
    }
    return steps;
}

/// State of the fit of one kernel.
class Fitting {
public:
    Fitting(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
            const Advance &advance)
        : kernel_(kernel), data_(data), options_(options), advance_(advance),
          space_(kernel, options), steps_(steps_of(options.ingredients, options.fixed))
    {
        fit_.loss = std::numeric_limits<double>::infinity();
        n_jobs_ = std::size(kStarts) + 1;
        for (const Step &step : steps_) {
            n_jobs_ += step.values.size() - 1;
        }
    }

    Fit run()
    {
        const auto at_start = neighbourhoods(params_of(kStarts[0], kernel_, options_));
        for (const Start &start : kStarts) {
            attempt(params_of(start, kernel_, options_), at_start, start.label, kStartIterations);
        }
        for (const Step &step : steps_) {
            try_values(step);
        }
        attempt(fit_.params, neighbourhoods(fit_.params), "from the best", kPolishIterations);
        return std::move(fit_);
    }

private:
    std::vector<Neighbourhood> neighbourhoods(const LearntParams &params) const
    {
        return neighbourhoods_of(data_.worlds, data_.learning, rule_of(params), options_.n_threads);
    }

    /// Record the result of a start, and keep it if it is better by more than `gain_min`.
    void take(const LearntParams &start, const Minimum &minimum, const std::string &label,
              double gain_min)
    {
        fit_.attempts.push_back({label, minimum.value, minimum.n_evaluations});
        if (minimum.value < fit_.loss - gain_min) {
            fit_.loss = minimum.value;
            fit_.params = with_legal_noise(space_.params(start, minimum.x));
        }
        advance_(static_cast<double>(++n_done_) / static_cast<double>(n_jobs_));
    }

    void attempt(const LearntParams &start, const std::vector<Neighbourhood> &at,
                 const std::string &label, int iterations_max)
    {
        take(start, descend(start, space_, at, options_, iterations_max), label, 0.0);
    }

    /// Fit with other neighbourhoods. Give up early if the loss is still much worse than the best.
    Minimum probe(const LearntParams &trial) const
    {
        const std::vector<Neighbourhood> at = neighbourhoods(trial);
        const Minimum first = descend(trial, space_, at, options_, kProbeIterations);
        if (first.value > fit_.loss + kHopeless) {
            return first;
        }
        Minimum second =
            descend(space_.params(trial, first.x), space_, at, options_, kStepIterations);
        second.n_evaluations += first.n_evaluations;
        return second;
    }

    /// Coordinate descent along one parameter: try every value, each time from the best fit so far.
    void try_values(const Step &step)
    {
        const LearntParams before = fit_.params;
        for (const double value : step.values) {
            if (value == step.get(before)) {
                continue;
            }
            LearntParams trial = fit_.params;
            step.set(trial, value);
            char label[60];
            std::snprintf(label, sizeof label, "%s = %g", step.name, value);
            take(trial, probe(trial), label, kStepGainMin);
        }
    }

    gpom_kernel_t kernel_;
    const LearnData &data_;
    const FitOptions &options_;
    const Advance &advance_;
    FitSpace space_;
    std::vector<Step> steps_;
    Fit fit_;
    std::size_t n_jobs_ = 0;
    std::size_t n_done_ = 0;
};

} // namespace

LearntParams with_legal_noise(LearntParams params)
{
    const bool is_apart = params.gap_m * (1.0 - params.anisotropy) >= 0.05;
    const double least = params.sf2 * (is_rough(params.kernel) && is_apart ? 1e-5 : 1e-3);
    params.sn2 = std::max(params.sn2, least);
    params.sn2_free = std::max(params.sn2_free, least);
    params.sn2_once = params.sn2_once > 0.0 ? std::max(params.sn2_once, params.sn2) : 0.0;
    return params;
}

FitSpace::FitSpace(gpom_kernel_t kernel, const FitOptions &options)
    : kernel_(kernel), two_noises_(options.ingredients.noise), has_once_(options.has_once)
{
    const bool nn = kernel == GPOM_KERNEL_NN;
    const double ell_max_m = ell_longest_m(kernel, options);
    const double ratio_low = std::log(noise_ratio_min(kernel));
    const double ell_min_m = kernel == GPOM_KERNEL_ASKEY ? 0.6001 : 0.2001;
    low_ << std::log(nn ? 1e-2 : ell_min_m), std::log(1e-4), std::log(1e-2), ratio_low, ratio_low,
        0.0, std::log(0.05), -kPriorArgumentMax, 0.0, -10.0, -20.0, -3.0, -3.0, -3.0, -3.0, 0.0;
    high_ << std::log(nn ? 1e4 : ell_max_m), std::log(1e4), std::log(1e2), std::log(1e2),
        std::log(1e2), std::log(30.0), std::log(kAlphaMax), kPriorArgumentMax, 1.0, 10.0, 20.0, 3.0,
        3.0, 3.0, 3.0, 0.0;
    const Ingredients &may = options.ingredients;
    for (int i = 0; i < kDerivatives; ++i) {
        const bool fixed = (i == kByShape1 && !nn) || (i == kBySn2Free && !may.noise) ||
                           (i == kBySn2Once && !options.has_once) ||
                           (i == kByAnisotropy && !may.anisotropy) || (i == kByVote && !may.vote) ||
                           (i == kByLine && !may.line) || (i >= kByLogWeight && !may.logs) ||
                           i == kByBetaFar; // learnt by fit_far()
        if (!fixed) {
            free_.push_back(i);
        }
    }
}

Box FitSpace::box() const { return {low_(free_), high_(free_)}; }

Eigen::VectorXd FitSpace::coordinates(const LearntParams &params) const
{
    Gradient all;
    all << std::log(kernel_ == GPOM_KERNEL_NN ? params.s0 : params.ell_m), std::log(params.s1),
        std::log(params.sf2), std::log(params.sn2 / params.sf2),
        std::log(params.sn2_free / params.sf2),
        std::log(std::max(params.sn2_once / params.sn2, 1.0)), std::log(params.alpha),
        (params.beta + weight_sum(params) * log_end()) / prior_spread(params), params.anisotropy,
        params.vote, params.line, params.log_weights[0], params.log_weights[1],
        params.log_weights[2], params.log_weights[3], 0.0;
    return all(free_);
}

LearntParams FitSpace::params(const LearntParams &base, const Eigen::VectorXd &x) const
{
    Gradient all;
    all << 0.0, std::log(base.s1), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, base.anisotropy, base.vote,
        base.line, base.log_weights[0], base.log_weights[1], base.log_weights[2],
        base.log_weights[3], 0.0;
    all(free_) = x;
    LearntParams params = base;
    (kernel_ == GPOM_KERNEL_NN ? params.s0 : params.ell_m) = std::exp(all(kByShape0));
    params.s1 = std::exp(all(kByShape1));
    params.sf2 = std::exp(all(kBySf2));
    params.sn2 = params.sf2 * std::exp(all(kBySn2));
    params.sn2_free = two_noises_ ? params.sf2 * std::exp(all(kBySn2Free)) : params.sn2;
    params.sn2_once = has_once_ ? params.sn2 * std::exp(all(kBySn2Once)) : 0.0;
    params.alpha = std::exp(all(kByAlpha));
    params.anisotropy = all(kByAnisotropy);
    params.vote = all(kByVote);
    params.line = all(kByLine);
    for (int i = 0; i < 4; ++i) {
        params.log_weights[static_cast<std::size_t>(i)] = all(kByLogWeight + i);
    }
    params.beta = all(kByBeta) * prior_spread(params) - weight_sum(params) * log_end();
    return params;
}

Gradient FitSpace::chained(const LearntParams &params, Gradient g) const
{
    const double spread = prior_spread(params);
    const double argument = (params.beta + weight_sum(params) * log_end()) / spread;
    const double kss = prior_variance(params);
    const double by_beta = g(kByBeta);
    // beta = argument sqrt(1 + alpha^2 kss) - sum of weights * log of the end.
    const double by_log_kss =
        by_beta * argument * params.alpha * params.alpha * kss / (2.0 * spread);
    g(kByAlpha) += 2.0 * by_log_kss;
    g(kBySf2) += by_log_kss + g(kBySn2) + g(kBySn2Free); // noises are ratios to sf2
    if (kernel_ == GPOM_KERNEL_NN) {
        const double c = 2.0 * params.s0 / (1.0 + 2.0 * params.s0);
        const double kss_by_s0 = params.sf2 * c * (1.0 - c) / std::sqrt(1.0 - c * c);
        g(kByShape0) += by_log_kss * kss_by_s0 / kss;
    }
    for (int i = 0; i < 4; ++i) {
        g(kByLogWeight + i) -= by_beta * log_end();
    }
    if (!two_noises_) {
        g(kBySn2) += g(kBySn2Free);
    }
    g(kByBeta) = by_beta * spread;
    return g;
}

Eigen::VectorXd FitSpace::gradient(const LearntParams &params, const Gradient &by_params) const
{
    return chained(params, by_params)(free_);
}

double mean_loss(const LearntParams &params, const std::vector<Neighbourhood> &neighbourhoods,
                 const FitOptions &options, Gradient *gradient)
{
    const std::size_t n = neighbourhoods.size();
    std::vector<double> losses(chunk_count(n), 0.0), weights(chunk_count(n), 0.0);
    std::vector<Gradient> gradients(chunk_count(n), Gradient::Zero());
    for_chunks(n, options.n_threads, [&](std::size_t i_chunk, std::size_t first, std::size_t last) {
        thread_local ModelWork work;
        for (std::size_t i = first; i < last; ++i) {
            const double weight = neighbourhoods[i].occupied ? 1.0 : options.free_weight;
            Gradient own = Gradient::Zero();
            losses[i_chunk] += weight * loss_of(params, neighbourhoods[i], work,
                                                gradient != nullptr ? &own : nullptr);
            gradients[i_chunk] += weight * own;
            weights[i_chunk] += weight;
        }
    });
    const double scale = 1.0 / std::accumulate(weights.begin(), weights.end(), 0.0);
    if (gradient != nullptr) {
        *gradient =
            scale * std::accumulate(gradients.begin(), gradients.end(), Gradient(Gradient::Zero()));
    }
    return scale * std::accumulate(losses.begin(), losses.end(), 0.0);
}

std::vector<std::string> edge_warnings(const LearntParams &params, const FitOptions &options)
{
    constexpr double kNear = 0.999;
    const bool nn = params.kernel == GPOM_KERNEL_NN;
    const double ell_max_m = ell_longest_m(params.kernel, options);
    std::vector<std::string> warnings;
    if (!nn && params.ell_m >= kNear * ell_max_m) {
        warnings.push_back("ell_m ended at its longest, " + std::to_string(ell_max_m) +
                           " m: places far from all beams may read occupied; give scans with more "
                           "open space, or another --ell-max, and look at the map");
    }
    if (params.alpha >= kNear * kAlphaMax) {
        warnings.push_back("alpha ended at its greatest, " + std::to_string(kAlphaMax) +
                           ": the places separate almost without error, so that probabilities may "
                           "be too sure elsewhere; give more or other scans");
    }
    if (!options.fixed.gap_m && params.gap_m >= kNear * kGapMax) {
        warnings.push_back("gap_m ended at its greatest, " + std::to_string(kGapMax) +
                           " m: poses or ranges are less exact than that; look at them, or give "
                           "--fix gap_m=");
    }
    return warnings;
}

Fit fit_kernel(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
               const Advance &advance)
{
    return Fitting(kernel, data, options, advance).run();
}

LearntParams fit_far(LearntParams params, const LearnData &data, FitOptions options)
{
    if (params.fade_m <= 0.0 || data.anywhere.empty()) {
        return params;
    }
    const std::vector<Neighbourhood> at =
        neighbourhoods_of(data.worlds, data.anywhere, rule_of(params), options.n_threads);
    options.free_weight = 1.0; // equal weights, because there are as many free as occupied places
    const double spread = prior_spread(params);
    const double near = (params.beta + weight_sum(params) * log_end()) / spread;
    const Objective objective = [&](const Eigen::VectorXd &x, Eigen::VectorXd &gradient) {
        params.beta_far = (x(0) - near) * spread;
        Gradient by_params;
        const double loss = mean_loss(params, at, options, &by_params);
        gradient = Eigen::VectorXd::Constant(1, spread * by_params(kByBetaFar));
        return loss;
    };
    const Box box = {Eigen::VectorXd::Constant(1, -kFarArgumentMax),
                     Eigen::VectorXd::Constant(1, kFarArgumentMax)};
    const Minimum minimum =
        minimise(objective, Eigen::VectorXd::Constant(1, near), box, kPolishIterations);
    params.beta_far = (minimum.x(0) - near) * spread;
    return params;
}

NeighbourRule rule_of(const LearntParams &params)
{
    return {params.gap_m,
            params.depth_m,
            static_cast<std::size_t>(params.scan_points_max),
            static_cast<std::size_t>(params.n_hits),
            static_cast<std::size_t>(params.n_free),
            static_cast<std::size_t>(params.n_fading)};
}

std::vector<Prediction> predictions_of(const LearntParams &params,
                                       const std::vector<LearnWorld> &worlds,
                                       const std::vector<LearnPlace> &places, unsigned n_threads)
{
    const std::vector<Neighbourhood> neighbourhoods =
        neighbourhoods_of(worlds, places, rule_of(params), n_threads);
    std::vector<Prediction> predictions(places.size());
    for_chunks(places.size(), n_threads, [&](std::size_t, std::size_t first, std::size_t last) {
        ModelWork work;
        for (std::size_t i = first; i < last; ++i) {
            predictions[i] = {probability_of(params, neighbourhoods[i], work), places[i].occupied};
        }
    });
    return predictions;
}

} // namespace gpom_tools
