// gpom-eval: compares the library's map with its rivals on the same data, at the same test points.
#include "ports/host/command_line.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/eval/evaluate.hpp"
#include "tools/map/raster_csv.hpp"

#include <algorithm>
#include <filesystem>

namespace
{

using namespace gpom_tools;

constexpr std::uint32_t kPictureColumns = 400;
constexpr std::uint32_t kPictureRows = 300;
constexpr double kCoarseCellsMin = 30.0;
constexpr double kWindowWidth = 40.0; // [m], at most, like the next two
constexpr double kWindowHeight = 30.0;
constexpr double kWindowCell = 0.1;

/// Answers of each method's map at the cells of the picture.
struct Pictures {
    std::vector<gpom_point_t> points;
    std::vector<gpom_answer_t> map;
    std::vector<double> grid;
    std::vector<double> wide_grid;
};

/// The paper's Figs. 5 and 6: the whole area in coarse cells, and one part of it in fine cells.
struct View {
    std::string name;
    std::vector<gpom_point_t> points;
    std::vector<gpom_answer_t> map;
    std::vector<double> grid; ///< Occupancy grid with widened beams. Its cells are those of the
                              ///< view, or its own if they are finer.
};

/// The raster of the pictures: at most 400 x 300 cells over the area.
gpom_raster_t picture_raster(const Trial &trial, double cell_min_m)
{
    const double cell_m = std::max({(trial.high.x_m - trial.low.x_m) / kPictureColumns,
                                    (trial.high.y_m - trial.low.y_m) / kPictureRows, cell_min_m});
    return raster_over(trial.low, trial.high, cell_m, 0.0);
}

void print_summary(const EvalOptions &options, const Trial &trial, const Outcome &outcome)
{
    const Metrics &all = outcome.methods.front().all;
    std::printf("%s: %zu scans, %zu beams in the map; %zu test points, %.1f %% occupied",
                options.scans_path.c_str(), trial.scans.size(), trial.beams.size(), all.n_points,
                100.0 * all.share_occupied);
    if (outcome.methods.front().near) {
        const Metrics &near = *outcome.methods.front().near;
        std::printf("; %zu near beams, %.1f %% occupied", near.n_points,
                    100.0 * near.share_occupied);
    }
    std::printf("\n\n%s%s", report_table(outcome.methods).c_str(),
                profile_table(outcome.methods, trial.truth.has_value()).c_str());
    for (const std::string &note : outcome.notes) {
        std::printf("left out: %s\n", note.c_str());
    }
    if (!outcome.neighbours.empty()) {
        std::printf("%s", neighbour_table(outcome.neighbours).c_str());
    }
}

std::string hits_csv(const Trial &trial)
{
    std::string text = "x,y,in_map\n";
    for (const auto *beams : {&trial.beams, &trial.other_beams}) {
        for (const GridBeam &beam : *beams) {
            if (beam.hit) {
                const gpom_point_t end = end_of(beam);
                append_text(text, "%.4f,%.4f,%d\n", end.x_m, end.y_m, beams == &trial.beams);
            }
        }
    }
    return text;
}

std::string poses_csv(const std::vector<Scan> &scans)
{
    std::string text = "x,y,theta\n";
    for (const Scan &scan : scans) {
        append_text(text, "%.4f,%.4f,%.6f\n", scan.x_m, scan.y_m, scan.theta_rad);
    }
    return text;
}

Pictures pictures_of(const Trial &trial, const HostMap &map, const LogOddsGrids &grids)
{
    const gpom_raster_t raster = picture_raster(trial, trial.truth ? 0.25 : 0.05);
    const std::vector<gpom_point_t> points = cell_centres(raster);
    return {points, map.query(raster), ask(grids.thin.grid, points), ask(grids.wide.grid, points)};
}

/// The coarsest of the cells 5, 2, 1 and 0.5 m that gives about 30 columns or rows.
double coarse_cell(const Trial &trial)
{
    const double side_m = std::max(trial.high.x_m - trial.low.x_m, trial.high.y_m - trial.low.y_m);
    for (const double cell_m : {5.0, 2.0, 1.0}) {
        if (side_m >= kCoarseCellsMin * cell_m) {
            return cell_m;
        }
    }
    return 0.5;
}

View coarse_view(const Trial &trial, const HostMap &map, const LogOddsGrids &grids)
{
    const double cell_m = coarse_cell(trial);
    const gpom_raster_t raster = raster_over(trial.low, trial.high, cell_m, 0.0);
    const std::vector<gpom_point_t> points = cell_centres(raster);
    return {"coarse", points, map.query(raster),
            ask(wide_grid_like(grids.wide, trial, cell_m), points)};
}

/// A window around the robot's place in the middle of the drive, inside the area.
View window_view(const Trial &trial, const HostMap &map, const LogOddsGrids &grids)
{
    const auto start = [](double middle_m, double length_m, double low_m, double high_m) {
        return std::max(std::min(middle_m - 0.5 * length_m, high_m - length_m), low_m);
    };
    const Scan &half_way = trial.scans[trial.scans.size() / 2];
    const double width_m = std::min(kWindowWidth, trial.high.x_m - trial.low.x_m);
    const double height_m = std::min(kWindowHeight, trial.high.y_m - trial.low.y_m);
    const gpom_point_t low = {start(half_way.x_m, width_m, trial.low.x_m, trial.high.x_m),
                              start(half_way.y_m, height_m, trial.low.y_m, trial.high.y_m)};
    const gpom_point_t high = {low.x_m + width_m, low.y_m + height_m};
    const gpom_raster_t raster = raster_over(low, high, kWindowCell, 0.0);
    const std::vector<gpom_point_t> points = cell_centres(raster);
    return {"window", points, map.query(raster), ask(grids.wide.grid, points)};
}

void add_views(const EvalOptions &options, const Trial &trial, const HostMap &map,
               const LogOddsGrids &grids, std::vector<FileContent> &files)
{
    for (const View &view : {coarse_view(trial, map, grids), window_view(trial, map, grids)}) {
        const std::string path = options.out_path + "/" + view.name;
        files.push_back({path + ".csv", answers_csv(view.points, view.map)});
        files.push_back({path + "_grid.csv", probabilities_csv(view.points, view.grid)});
    }
}

std::vector<FileContent> folder_files(const EvalOptions &options, const Trial &trial,
                                      const Pictures &pictures, const Outcome &outcome)
{
    const std::string folder = options.out_path + "/";
    std::vector<FileContent> files = {
        {folder + "eval.json", eval_json(options, trial, outcome).dump(1) + "\n"},
        {folder + "map.csv", answers_csv(pictures.points, pictures.map)},
        {folder + "grid.csv", probabilities_csv(pictures.points, pictures.grid)},
        {folder + "wide_grid.csv", probabilities_csv(pictures.points, pictures.wide_grid)},
        {folder + "hits.csv", hits_csv(trial)},
        {folder + "poses.csv", poses_csv(trial.scans)},
        {folder + "points.csv", points_csv(trial.test, outcome.methods)},
        {folder + "profile.csv", profile_csv(trial.test, outcome.methods)}};
    if (trial.truth) {
        files.push_back({folder + "truth.pgm", truth_pgm(*trial.truth, "copied by gpom-eval")});
    }
    std::error_code error;
    std::filesystem::create_directories(options.out_path, error);
    if (error) {
        throw FileError(options.out_path, 0, "cannot make this folder: " + error.message());
    }
    return files;
}

void evaluate_to_files(const EvalOptions &options, const Trial &trial)
{
    const Outcome outcome = evaluate(options, trial);
    std::vector<FileContent> files;
    if (!options.out_path.empty()) {
        const HostMap map = map_of(trial, read_params(options.params_path));
        files = folder_files(options, trial, pictures_of(trial, map, *outcome.log_odds), outcome);
        if (!trial.truth) {
            add_views(options, trial, map, *outcome.log_odds, files);
        }
    }
    if (!options.json_path.empty()) {
        files.push_back({options.json_path, eval_json(options, trial, outcome).dump(1) + "\n"});
    }
    replace_files(files);
    print_summary(options, trial, outcome);
}

void declare_common(CLI::App &mode, EvalOptions &options)
{
    mode.add_option("--scans", options.scans_path, "Scans: CSV or CARMEN log, plain, gzip or bzip2")
        ->required()
        ->type_name("FILE");
    mode.add_option("--params", options.params_path, "Parameters of the map, TOML")
        ->required()
        ->type_name("FILE");
    add_scan_options(mode, options.reading);
    mode.add_option("--map-frame-params", options.map_frame_path,
                    "Parameters of the paper's map: kernel nn, map frame\n"
                    "[NAME_paper.toml beside NAME.toml, if it is there]")
        ->type_name("FILE");
    mode.add_option("--also", options.also_paths,
                    "More parameter files to compare, with commas between; each is a row `gp_NAME`")
        ->delimiter(',')
        ->type_name("FILE");
    mode.add_option("--seed", options.seed, "Seed of the random test points")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    mode.add_option("--grid-cell", options.grid_cell_m,
                    "Cell size of both log-odds grids [m]; default: the one with the least NLL")
        ->check(between(0.01, 100.0));
    mode.add_option("--out", options.out_path,
                    "Folder for eval.json and the CSV files of gpom-plot")
        ->type_name("DIR");
    mode.add_option("--json", options.json_path, "File for the contents of eval.json only")
        ->type_name("FILE");
    mode.add_option("--rivals", options.rivals,
                    "Compare with the strong grid and OctoMap, too: on or off")
        ->transform(CLI::IsMember({"on", "off"}))
        ->default_str("on");
}

CLI::App *declare_street(CLI::App &app, EvalOptions &options)
{
    CLI::App *mode = app.add_subcommand(
        "street", "Judge by the truth of a simulated street, at random places in the whole area");
    declare_common(*mode, options);
    mode->add_option("--truth", options.truth_path, "Truth written by gpom-sim, PGM image")
        ->required()
        ->type_name("FILE");
    mode->add_option("--points", options.n_points, "Test points")
        ->check(CLI::Range(std::size_t{1}, std::size_t{10'000'000}))
        ->capture_default_str();
    mode->add_flag("--exact-gp", options.exact_gp,
                   "Compare with scikit-learn's exact GP, too, if installed");
    mode->add_option("--neighbours", options.neighbours,
                     "Compare the paper's model from few neighbours with the dense model of all\n"
                     "beams. Give numbers of hits, for example 8,16,32 (kernel askey: up to 256);\n"
                     "each is also the number of free segments")
        ->delimiter(',')
        ->check(CLI::Range(1u, GPOM_SPARSE_POINTS_MAX / 2));
    mode->add_option("--dense-points", options.n_dense_points,
                     "Number of test points near a beam for --neighbours")
        ->check(CLI::Range(std::size_t{2}, std::size_t{10'000'000}))
        ->capture_default_str();
    return mode;
}

void declare_log(CLI::App &app, EvalOptions &options)
{
    CLI::App *mode = app.add_subcommand("log", "Judge by beams of a log that the map did not get");
    declare_common(*mode, options);
    mode->add_option("--range-max", options.reading.range_max_m,
                     "Usable range [m]; a longer reading means no return")
        ->check(between(0.1, 1000.0))
        ->capture_default_str();
    mode->add_option("--fraction", options.fraction,
                     "Share of the returns that the map gets. With --split beams\n"
                     "at most 0.9, because the other returns judge the map")
        ->check(between(0.0, 1.0))
        ->capture_default_str();
    mode->add_option(
            "--split", options.split,
            "Judge by held-out \"beams\" of the scans that make the map, or by two \"runs\"\n"
            "of 40 consecutive scans that the map never got")
        ->check(CLI::IsMember({"beams", "runs"}))
        ->capture_default_str();
    mode->add_option(
            "--after-metres", options.after_m,
            "Leave out this first part of the way [m], for example the part of gpom-learn\n"
            "--first-metres")
        ->check(between(0.0, 1e9));
    mode->add_option("--beam-width-deg", options.beam_width_deg,
                     "Full opening angle of the widened grid's beams [degree]")
        ->check(between(0.0, 120.0))
        ->capture_default_str();
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Compare the map with its rivals on the same data, at the same test points.",
                 "gpom-eval");
    EvalOptions street, log;
    CLI::App *const street_mode = declare_street(app, street);
    declare_log(app, log);
    app.require_subcommand(1);
    for (int i = 0; i < argc; ++i) {
        (street.command += i > 0 ? " " : "") += argv[i];
    }
    log.command = street.command;
    return run_tool(app, argc, argv, [&] {
        const EvalOptions &options = street_mode->parsed() ? street : log;
        evaluate_to_files(options,
                          street_mode->parsed() ? street_trial(options) : log_trial(options));
    });
}
