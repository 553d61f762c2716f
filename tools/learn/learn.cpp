#include "tools/learn/learn.hpp"

#include "ports/host/params_toml.hpp"
#include "ports/host/progress.hpp"
#include "tools/learn/lml.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace gpom_tools
{
namespace
{

constexpr std::size_t kLogPlaces = 3000;
constexpr std::size_t kLivePlaces = 6000;
constexpr std::size_t kStreetPlaces = 1500;
constexpr std::size_t kHeldOutPlaces = 4000;

std::vector<gpom_kernel_t> kernels_of(const std::string &name)
{
    std::vector<gpom_kernel_t> kernels;
    for (const gpom_kernel_t kernel : {GPOM_KERNEL_NN, GPOM_KERNEL_MATERN12, GPOM_KERNEL_MATERN32,
                                       GPOM_KERNEL_SE, GPOM_KERNEL_ASKEY}) {
        if (name == "all" || name == kernel_name(kernel)) {
            kernels.push_back(kernel);
        }
    }
    if (kernels.empty()) {
        throw std::runtime_error("--kernel: '" + name +
                                 "' is not one of nn, matern12, matern32, se, askey, all");
    }
    return kernels;
}

std::vector<LearnSource> sources_of(const LearnOptions &options)
{
    const bool street = !options.truth_paths.empty();
    const std::size_t n_logs = options.scans.size() + options.scans_paths.size();
    if (street && options.truth_paths.size() != n_logs) {
        throw std::runtime_error("--truth: " + std::to_string(options.truth_paths.size()) +
                                 " files for " + std::to_string(n_logs) +
                                 " of --scans; give one for each");
    }
    std::vector<LearnSource> sources;
    for (const std::vector<Scan> &scans : options.scans) {
        sources.push_back({"scans " + std::to_string(sources.size()), "", scans});
    }
    for (const std::string &path : options.scans_paths) {
        sources.push_back({path, "", {}});
    }
    for (std::size_t i = 0; street && i < sources.size(); ++i) {
        sources[i].truth_path = options.truth_paths[i];
    }
    return sources;
}

DataOptions data_options(const LearnOptions &options)
{
    const std::size_t n_default = is_street(options) ? kStreetPlaces
                                  : is_live(options) ? kLivePlaces
                                                     : kLogPlaces;
    const bool lml = options.method == "lml";
    DataOptions data;
    data.reading = options.reading;
    data.first_m = options.first_m;
    data.fraction = options.fraction.value_or(1.0);
    data.n_places = lml ? n_default : options.n_points.value_or(n_default);
    data.n_held_out = kHeldOutPlaces;
    data.seed = options.seed;
    data.live = options.live;
    data.gap_m = parse_fixed(options.fixed).gap_m.value_or(data.gap_m);
    data.training_of = options.training_of;
    return data;
}

FitOptions fit_options(const LearnOptions &options)
{
    if (options.n_hits + options.n_free > static_cast<int>(GPOM_POINTS_MAX)) {
        throw std::runtime_error("--hits, --free: together at most 64");
    }
    const bool lml = options.method == "lml";
    const std::string model = options.model.value_or(lml ? "paper" : "full");
    if (lml && model != "paper") {
        throw std::runtime_error("--model: with --method lml it can only be paper");
    }
    if (lml && !options.fixed.empty()) {
        throw std::runtime_error("--fix: not with --method lml");
    }
    return {parse_ingredients(model), parse_fixed(options.fixed),
            options.ell_max_m,        options.n_hits,
            options.n_free,           0,
            is_live(options),         options.free_weight};
}

LmlOptions lml_options(const LearnOptions &options)
{
    LmlOptions lml;
    lml.composite = options.composite;
    lml.n_points = options.n_points.value_or(lml.n_points);
    lml.seed = options.seed;
    if (options.method == "lml" && lml.n_points > kLmlPointsMax) {
        throw std::runtime_error("--points: at most 1000 with --method lml");
    }
    return lml;
}

LearnData data_of(const LearnPlan &plan)
{
    const bool street = !plan.sources.front().truth_path.empty();
    if (plan.is_live) {
        return live_data(plan.sources, plan.data);
    }
    return street ? street_data(plan.sources, plan.data) : log_data(plan.sources, plan.data);
}

std::vector<JudgedFit> fits_of(const LearnPlan &plan, const LearnData &data)
{
    Progress progress("learning");
    std::vector<JudgedFit> fits;
    for (const gpom_kernel_t kernel : plan.kernels) {
        const Advance advance = [&](double share) {
            const double done = 1000.0 * (static_cast<double>(fits.size()) + share);
            progress.update(static_cast<std::size_t>(done), 1000 * plan.kernels.size());
        };
        Fit fit = plan.by_lml ? fit_lml(kernel, data, plan.fitting, plan.lml, advance)
                              : fit_kernel(kernel, data, plan.fitting, advance);
        fit.params = fit_far(fit.params, data, plan.fitting);
        Metrics held_out = measure(predictions_of(fit.params, data.worlds, data.held_out, 0));
        fits.push_back({std::move(fit), std::move(held_out)});
    }
    return fits;
}

std::string how_learnt(const LearnOptions &options, const LearnData &data)
{
    if (options.method == "lml") {
        return std::string("Log marginal likelihood of ") +
               (options.composite ? "local neighbourhoods" : "a random subset") +
               ", then alpha and beta by leave-one-out.";
    }
    return (is_street(options) ? "Against ground truth: " : "Whole beams left out: ") +
           std::to_string(data.learning.size()) + " places of " +
           std::to_string(data.worlds.size()) + " files.\n" + map_learnt_for(options);
}

} // namespace

bool is_street(const LearnOptions &options) { return !options.truth_paths.empty(); }

bool is_live(const LearnOptions &options) { return !is_street(options) && !options.fraction; }

LearnPlan plan_of(const LearnOptions &options)
{
    const bool lml = options.method == "lml";
    if (lml && is_live(options)) {
        throw std::runtime_error(
            "--method lml learns only for a map that keeps all of its beams; give "
            "--fraction, 0.04 for one beam in 25");
    }
    return {sources_of(options),  data_options(options), kernels_of(options.kernel),
            fit_options(options), lml_options(options),  lml,
            is_live(options)};
}

std::string map_learnt_for(const LearnOptions &options)
{
    char text[160];
    if (is_live(options)) {
        std::snprintf(
            text, sizeof text,
            "For live maps of all beams, keep_m = %g, clear_scans = %u, at most %u beams.",
            double{options.live.keep_m}, options.live.clear_scans, options.live.beam_max);
    } else {
        std::snprintf(text, sizeof text, "For maps that keep all of their beams, %g %% of these.",
                      100.0 * options.fraction.value_or(1.0));
    }
    return text;
}

LearnOutcome learn(const LearnOptions &options)
{
    const LearnPlan plan = plan_of(options);
    const LearnData data = data_of(plan);
    LearnOutcome outcome = {fits_of(plan, data), 0, data.how_held_out, {}, ""};
    const auto best = std::min_element(
        outcome.fits.begin(), outcome.fits.end(),
        [](const JudgedFit &a, const JudgedFit &b) { return a.held_out.nll < b.held_out.nll; });
    outcome.i_best = static_cast<std::size_t>(best - outcome.fits.begin());
    outcome.warnings = edge_warnings(outcome.params(), plan.fitting);
    outcome.comment =
        params_comment(*best, options.command, how_learnt(options, data), data.how_held_out);
    for (const std::string &warning : outcome.warnings) {
        outcome.comment += "Warning: " + warning + ".\n";
    }
    return outcome;
}

} // namespace gpom_tools
