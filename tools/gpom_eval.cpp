// gpom-eval: compares the library's map with its rivals on the same data, at the same test points.
#include "ports/host/command_line.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/eval/neighbour_check.hpp"
#include "tools/eval/report.hpp"
#include "tools/eval/rivals.hpp"
#include "tools/eval/trial.hpp"
#include "tools/map/host_map.hpp"
#include "tools/map/raster_csv.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

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

/// All results, and notes on what was left out and why.
struct Outcome {
    std::vector<MethodResult> methods;
    nlohmann::ordered_json grids; ///< The cell sizes chosen for the log-odds grids.
    double prior_variance = 0.0;  ///< Prior variance of the first method's map.
    std::vector<NeighbourRow> neighbours;
    std::vector<std::string> notes;
};

/// The raster of the pictures: at most 400 x 300 cells over the area.
gpom_raster_t picture_raster(const Trial &trial, double cell_min_m)
{
    const double cell_m = std::max({(trial.high.x_m - trial.low.x_m) / kPictureColumns,
                                    (trial.high.y_m - trial.low.y_m) / kPictureRows, cell_min_m});
    return raster_over(trial.low, trial.high, cell_m, 0.0);
}

/// A map with its origin in the middle of the drive. In the map frame the resolution falls with the
/// distance from the origin, so this choice favours the paper's map. In the query frame the origin
/// does not matter.
HostMap map_of(const Trial &trial, const gpom_params_t &params)
{
    HostMap map(params, beam_count(trial.scans), middle_of(trial.scans));
    map.insert(trial.scans);
    return map;
}

MethodResult gp_result(const std::string &key, const std::string &label, const Trial &trial,
                       const HostMap &map)
{
    MethodResult method;
    method.key = key;
    method.label = label;
    for (const gpom_answer_t &answer : map.query(places_of(trial.test))) {
        method.probabilities.push_back(double{answer.probability});
    }
    return judged(std::move(method), trial.test);
}

/// Path of the paper's parameters: the option if given, otherwise NAME_paper.toml beside NAME.toml,
/// otherwise empty.
std::string map_frame_path(const EvalOptions &options)
{
    if (!options.map_frame_path.empty()) {
        return options.map_frame_path;
    }
    std::filesystem::path beside = options.params_path;
    beside.replace_filename(beside.stem().string() + "_paper.toml");
    return std::filesystem::exists(beside) ? beside.string() : "";
}

gpom_params_t read_map_frame_params(const std::string &path)
{
    const gpom_params_t params = read_params(path);
    if (params.kernel != GPOM_KERNEL_NN || params.frame != GPOM_FRAME_MAP) {
        throw FileError(path, 0,
                        "is for the paper's map; it needs kernel = \"nn\", frame = \"map\"");
    }
    return params;
}

std::string text_of(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
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

nlohmann::ordered_json eval_json(const EvalOptions &options, const Trial &trial,
                                 const Outcome &outcome)
{
    nlohmann::ordered_json json;
    json["mode"] = trial.mode;
    json["command"] = options.command;
    json["scans_file"] = options.scans_path;
    json["seed"] = options.seed;
    json["scans"] = trial.scans.size();
    json["beams"] = trial.beams.size();
    json["prior_variance"] = outcome.prior_variance;
    json.update(outcome.grids);
    if (trial.truth) {
        json["truth_file"] = options.truth_path;
    } else {
        json["split"] = options.split;
        json["fraction"] = options.fraction;
        json["range_max_m"] = options.reading.range_max_m;
        json["beam_width_deg"] = options.beam_width_deg;
        json["after_m"] = options.after_m;
    }
    json["params"] = {{"file", options.params_path}, {"text", text_of(options.params_path)}};
    const std::string map_frame = map_frame_path(options);
    if (!map_frame.empty()) {
        json["map_frame_params"] = {{"file", map_frame}, {"text", text_of(map_frame)}};
    }
    json.update(report_json(outcome.methods));
    if (!outcome.neighbours.empty()) {
        json["neighbours"] = neighbour_json(outcome.neighbours);
    }
    json["left_out"] = outcome.notes;
    return json;
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

void add_rivals(const EvalOptions &options, const Trial &trial, Outcome &outcome)
{
    if (options.rivals) {
        outcome.methods.push_back(judged_strong_grid(trial));
        outcome.methods.push_back(judged_octomap(trial));
    }
    if (!options.exact_gp) {
        return;
    }
    if (std::optional<MethodResult> exact = judged_exact_gp(trial)) {
        outcome.methods.push_back(std::move(*exact));
    } else {
        outcome.notes.push_back("exact GP: scikit-learn is not installed; run "
                                "tools/setup results");
    }
}

void evaluate(const EvalOptions &options, const Trial &trial)
{
    Outcome outcome;
    const std::string map_frame = map_frame_path(options);
    const gpom_params_t params = read_params(options.params_path);
    require_neighbours(options, params);
    const HostMap map = map_of(trial, params);
    outcome.prior_variance = double{gpom_params_prior_variance(&params)};
    outcome.methods.push_back(gp_result("gp_query", "GP, query frame", trial, map));
    if (!map_frame.empty()) {
        const HostMap paper = map_of(trial, read_map_frame_params(map_frame));
        outcome.methods.push_back(
            gp_result("gp_map", "GP, map frame (as the paper)", trial, paper));
    } else {
        outcome.notes.push_back("GP in the map frame: no NAME_paper.toml beside " +
                                options.params_path + " and no --map-frame-params");
    }
    for (const std::string &path : options.also_paths) {
        const std::string name = std::filesystem::path(path).stem().string();
        const HostMap also = map_of(trial, read_params(path));
        outcome.methods.push_back(gp_result("gp_" + name, "GP, " + name, trial, also));
    }
    const LogOddsGrids grids = chosen_grids(options, trial);
    outcome.grids = grid_constants(grids);
    outcome.methods.push_back(grids.thin.result);
    outcome.methods.push_back(grids.wide.result);
    add_rivals(options, trial, outcome);
    if (!options.neighbours.empty()) {
        outcome.neighbours = check_neighbours(options, trial, params);
    }
    std::vector<FileContent> files;
    if (!options.out_path.empty()) {
        files = folder_files(options, trial, pictures_of(trial, map, grids), outcome);
        if (!trial.truth) {
            add_views(options, trial, map, grids, files);
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
        evaluate(options, street_mode->parsed() ? street_trial(options) : log_trial(options));
    });
}
