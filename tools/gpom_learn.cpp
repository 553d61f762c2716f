// gpom-learn: learns hyperparameters from scans.
#include "ports/host/command_line.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/learn/learn.hpp"
#include "tools/map/map_options.hpp"
#include "tools/params_tool/writer.hpp"

#include <cstdint>
#include <cstdio>
#include <stdexcept>

using namespace gpom_tools;

namespace
{

/// What the command line adds to the options of learning.
struct Options : LearnOptions {
    std::string out_path, header_path, record_path;
    std::vector<CLI::Option *> live_options;
};

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

void require_live_options_fit(const Options &options)
{
    for (const CLI::Option *option : options.live_options) {
        if (option->count() > 0 && !is_live(options)) {
            throw std::runtime_error(option->get_name() + ": only for live maps; not with " +
                                     (is_street(options) ? "--truth" : "--fraction"));
        }
    }
}

void learn_to_files(const Options &options)
{
    (void)plan_of(options); // what is wrong with other options is told first
    require_live_options_fit(options);
    const LearnOutcome outcome = learn(options);
    for (const std::string &warning : outcome.warnings) {
        std::fprintf(stderr, "gpom-learn: warning: %s\n", warning.c_str());
    }
    const std::vector<FileContent> files = files_of(options, outcome.params(), outcome.comment);
    replace_files(files);
    std::printf("%s\n%s\nHeld out: %s.\n%s\n\n%s", attempts_table(outcome.fits).c_str(),
                figures_table(outcome.fits, outcome.i_best).c_str(), outcome.how_held_out.c_str(),
                map_learnt_for(options).c_str(), files.front().bytes.c_str());
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
    return run_tool(app, argc, argv, [&options] { learn_to_files(options); });
}
