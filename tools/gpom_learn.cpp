// gpom-learn: learns hyperparameters from scans.
#include "ports/host/command_line.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/progress.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/learn/lml.hpp"
#include "tools/learn/report.hpp"
#include "tools/map/map_options.hpp"
#include "tools/params_tool/writer.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>

using namespace gpom_tools;

namespace
{

constexpr std::size_t kLogPlaces = 3000;
constexpr std::size_t kLivePlaces = 6000;
constexpr std::size_t kStreetPlaces = 1500;
constexpr std::size_t kHeldOutPlaces = 4000;

struct Options {
    std::vector<std::string> scans_paths, truth_paths;
    std::string out_path, header_path, record_path, command;
    std::string kernel = "all";
    std::string method = "lobo";
    std::string fixed;
    std::optional<std::string> model; ///< Absent: full. With --method lml: paper.
    std::uint64_t seed = 0;
    std::optional<double> fraction; ///< Absent: a live map of a log, or all beams of a street.
    double free_weight = 1.0;
    std::optional<std::uint64_t> training_of;
    LiveConfig live;
    std::vector<CLI::Option *> live_options;
    std::optional<std::size_t> n_points;
    ReadOptions reading;
    double first_m = 0.0;
    double ell_max_m = 12.0;
    int n_hits = 8;
    int n_free = 8;
    bool composite = false;
};

bool is_street(const Options &options) { return !options.truth_paths.empty(); }

/// True if the parameters are for a live map of a log. That is the case unless --fraction is given.
bool is_live(const Options &options) { return !is_street(options) && !options.fraction; }

void declare_data(CLI::App &app, Options &options)
{
    app.add_option("--scans", options.scans_paths,
                   "Scans to learn from, CSV or CARMEN log, plain, gzip or bzip2; may be repeated")
        ->required()
        ->type_name("FILE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--truth", options.truth_paths,
                   "Truth by gpom-sim, one for each --scans: learn at random places of\n"
                   "the area near beams, also behind walls and vehicles")
        ->type_name("FILE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--fraction", options.fraction,
                   "Learn for a map that keeps all beams of this share of the scans' beams\n"
                   "[default: learn for a live map of all beams; with --truth 1]")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--points", options.n_points,
                   "Places to learn from in each file [6000; with --fraction 3000; with\n"
                   "--truth 1500];\n"
                   "with --method lml points of the subset [600], at most 1000")
        ->check(CLI::Range(std::size_t{50}, std::size_t{1'000'000}));
    app.add_option("--first-metres", options.first_m,
                   "Learn only from this first part of the way [m]; 0: from the whole way")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--range-max", options.reading.range_max_m,
                   "Usable range [m]; a longer reading means no return")
        ->check(CLI::Range(0.1, 1000.0))
        ->capture_default_str();
    add_scan_options(app, options.reading);
    app.add_option("--seed", options.seed, "Seed of all random choices")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
}

void declare_options(CLI::App &app, Options &options)
{
    declare_data(app, options);
    app.add_option("--out", options.out_path, "Parameters to write, TOML")
        ->required()
        ->type_name("FILE");
    app.add_option("--record", options.record_path,
                   "The same as a binary record for gpom_params_load()")
        ->type_name("FILE");
    app.add_option("--header", options.header_path,
                   "The same as a C header for firmware: the constant\ngpom_params_learnt")
        ->type_name("FILE");
    app.add_option("--kernel", options.kernel,
                   "nn, matern12, matern32, se, askey, or all: take the best on held-out places")
        ->capture_default_str();
    app.add_option("--method", options.method,
                   "lobo: predict places from the map without their own beam, or compare with\n"
                   "the truth. lml: the paper's marginal likelihood, then leave-one-out")
        ->check(CLI::IsMember({"lobo", "lml"}))
        ->capture_default_str();
    app.add_option(
        "--model", options.model,
        "Parts of the model to learn: paper (none of these), full (all), or a comma list\n"
        "of noise, anisotropy, vote, line, logs, depth, cap [full; lml: only paper]");
    app.add_option("--fix", options.fixed,
                   "Fix parameters instead of learning them: a comma list of fade_m=, gap_m=,\n"
                   "depth_m=, scan_points_max=, fading=. By default fade_m is 0 (the map never\n"
                   "fades to its prior) and fading is 0 (neighbours come and go at once)")
        ->type_name("NAME=VALUE");
    app.add_option("--hits", options.n_hits, "Nearest hits per query")
        ->check(CLI::Range(1, 63))
        ->capture_default_str();
    app.add_option("--free", options.n_free, "Nearest free segments per query")
        ->check(CLI::Range(1, 63))
        ->capture_default_str();
    app.add_option("--ell-max", options.ell_max_m,
                   "Longest length scale [m]. It decides how far the map reaches")
        ->check(CLI::Range(0.3, 1000.0))
        ->capture_default_str();
    app.add_option("--free-weight", options.free_weight,
                   "Weight of a free place; an occupied one has 1. A larger weight makes walls\n"
                   "thinner and the calibration worse; 1.4 suits indoor maps")
        ->check(CLI::Range(0.1, 10.0))
        ->capture_default_str();
    app.add_option("--training-of", options.training_of,
                   "Learn only from the returns that gpom-live judge with this --seed puts into\n"
                   "its map")
        ->check(CLI::NonNegativeNumber);
    options.live_options = add_live_options(app, options.live);
    options.live_options.push_back(add_capacity_option(app, options.live));
    app.add_flag("--composite", options.composite,
                 "With --method lml: use local neighbourhoods instead of one subset");
}

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

std::vector<LearnSource> sources_of(const Options &options)
{
    const bool street = !options.truth_paths.empty();
    if (street && options.truth_paths.size() != options.scans_paths.size()) {
        throw std::runtime_error("--truth: " + std::to_string(options.truth_paths.size()) +
                                 " files for " + std::to_string(options.scans_paths.size()) +
                                 " of --scans; give one for each");
    }
    std::vector<LearnSource> sources;
    for (std::size_t i = 0; i < options.scans_paths.size(); ++i) {
        sources.push_back({options.scans_paths[i], street ? options.truth_paths[i] : ""});
    }
    return sources;
}

DataOptions data_options(const Options &options)
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

FitOptions fit_options(const Options &options)
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

LmlOptions lml_options(const Options &options)
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

/// The options after checking, so that errors are reported before long files are read.
struct Plan {
    std::vector<LearnSource> sources;
    DataOptions data;
    std::vector<gpom_kernel_t> kernels;
    FitOptions fitting;
    LmlOptions lml;
    bool by_lml, is_live;
};

Plan plan_of(const Options &options)
{
    const bool lml = options.method == "lml";
    if (lml && is_live(options)) {
        throw std::runtime_error(
            "--method lml learns only for a map that keeps all of its beams; give "
            "--fraction, 0.04 for one beam in 25");
    }
    for (const CLI::Option *option : options.live_options) {
        if (option->count() > 0 && !is_live(options)) {
            throw std::runtime_error(option->get_name() + ": only for live maps; not with " +
                                     (is_street(options) ? "--truth" : "--fraction"));
        }
    }
    return {sources_of(options),  data_options(options), kernels_of(options.kernel),
            fit_options(options), lml_options(options),  lml,
            is_live(options)};
}

LearnData data_of(const Plan &plan)
{
    const bool street = !plan.sources.front().truth_path.empty();
    if (plan.is_live) {
        return live_data(plan.sources, plan.data);
    }
    return street ? street_data(plan.sources, plan.data) : log_data(plan.sources, plan.data);
}

std::vector<JudgedFit> fits_of(const Plan &plan, const LearnData &data)
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

/// One sentence that says which maps the parameters fit. Other maps need parameters of their own.
std::string map_learnt_for(const Options &options)
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

std::string how_learnt(const Options &options, const LearnData &data)
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

/// The files to write, all with the same parameters.
std::vector<FileContent> files_of(const Options &options, const LearntParams &params,
                                  const std::string &comment)
{
    const gpom_params_t written = to_six_digits(params); // refused values leave no file
    std::vector<FileContent> files = {{options.out_path, params_toml(written, comment)}};
    if (!options.record_path.empty()) {
        files.push_back({options.record_path, params_record(written)});
    }
    if (!options.header_path.empty()) {
        files.push_back({options.header_path, params_header(written, "learnt", comment)});
    }
    return files;
}

void learn(const Options &options)
{
    const Plan plan = plan_of(options);
    const LearnData data = data_of(plan);
    const std::vector<JudgedFit> fits = fits_of(plan, data);
    const auto best =
        std::min_element(fits.begin(), fits.end(), [](const JudgedFit &a, const JudgedFit &b) {
            return a.held_out.nll < b.held_out.nll;
        });
    const LearntParams &params = best->fit.params;
    std::string comment =
        params_comment(*best, options.command, how_learnt(options, data), data.how_held_out);
    for (const std::string &warning : edge_warnings(params, plan.fitting)) {
        std::fprintf(stderr, "gpom-learn: warning: %s\n", warning.c_str());
        comment += "Warning: " + warning + ".\n";
    }
    const std::vector<FileContent> files = files_of(options, params, comment);
    replace_files(files);
    std::printf("%s\n%s\nHeld out: %s.\n%s\n\n%s", attempts_table(fits).c_str(),
                figures_table(fits, static_cast<std::size_t>(best - fits.begin())).c_str(),
                data.how_held_out.c_str(), map_learnt_for(options).c_str(),
                files.front().bytes.c_str());
}

/// The command line without the folders of its files, so that it is the same wherever it was run.
std::string command_of(int argc, const char *const *argv)
{
    std::string command = "gpom-learn";
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const std::size_t slash = word.find_last_of('/');
        command += " " + (slash == std::string::npos ? word : word.substr(slash + 1));
    }
    return command;
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Learn hyperparameters from scans, and measure them on held-out data.",
                 "gpom-learn");
    Options options;
    options.command = command_of(argc, argv);
    declare_options(app, options);
    return run_tool(app, argc, argv, [&options] { learn(options); });
}
