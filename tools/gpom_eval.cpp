// gpom-eval: the library's map and its rivals on the same data, judged at the same points.
#include "tools/lib/command_line.hpp"
#include "tools/lib/eval_report.hpp"
#include "tools/lib/host_map.hpp"
#include "tools/lib/occupancy_grid.hpp"
#include "tools/lib/params_toml.hpp"
#include "tools/lib/protocol.hpp"
#include "tools/lib/raster_csv.hpp"
#include "tools/lib/truth.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>

namespace
{

using namespace gpom_tools;

constexpr std::uint32_t kPictureColumns = 400;
constexpr std::uint32_t kPictureRows = 300;
constexpr double kGridMargin = 2.0; ///< Room for test points behind the outermost returns [m].
constexpr double kPi = 3.14159265358979323846;

struct Options {
    std::string scans_path;
    std::string truth_path;
    std::string params_path;
    std::string map_frame_path;
    std::string out_path;
    std::string command;
    std::size_t n_points = 20000;
    std::uint64_t seed = 0;
    std::optional<double> grid_cell_m; ///< For both grids; none: the best for each.
    double range_max_m = 49.0;
    double fraction = 0.04;
    double beam_width_deg = 2.0;
};

struct GridSetup {
    double cell_m;
    GridModel model;
};

struct GridSetups {
    GridSetup thin;
    GridSetup wide;
};

/// Chosen for each grid by all three figures on the very points that judge it, NLL within 0.01 of
/// the best tried: cells of 0.35 to 2 m on streets and 0.1 to 0.5 m for logs, p_hit 0.6 to 0.95,
/// p_miss 0.02 to 0.4, clamps from OctoMap's 0.12, 0.97 to 0.001, 0.98. AUC / FP@95 / NLL
/// near beams, means over `gpom-sim --seed N`, N = 0 to 4, and `gpom-eval street --grid-cell C`:
///   thin  C = 0.5  .708 / .581 / .520   1  .787 / .409 / .453   1.5  .821 / .374 / .431
///         2  .827 / .489 / .438; OctoMap's constants at 1 m: .782 / .418 / .575
///   wide  C = 0.5  .877 / .319 / .407   1  .871 / .318 / .408   1.5  .866 / .321 / .410
constexpr GridModel kStreetModel{0.7, 0.1, 0.02, 0.98};
constexpr GridSetups kStreetGrids{{1.5, kStreetModel}, {0.5, kStreetModel}};

/// The same for logs, means over intel, csail and seattle at a fraction of 0.04:
///   thin  0.1 m  .969 / .181 / .309   0.2 m  .983 / .054 / .193   0.3 m  .976 / .060 / .185
///   wide, 0.2 m  1 degree .984 / .046 / .172   2 degrees .984 / .046 / .171   4 .984 / .048 / .173
constexpr GridSetups kLogGrids{{0.2, {0.95, 0.4, 0.02, 0.98}}, {0.2, {0.95, 0.3, 0.02, 0.98}}};

/// What all methods get, and what they are judged by.
struct Trial {
    std::string mode;
    std::vector<Scan> scans;           ///< Make the maps.
    std::vector<GridBeam> beams;       ///< The same as single beams.
    std::vector<GridBeam> other_beams; ///< Held out; none on streets.
    std::vector<TestPoint> points;
    std::vector<bool> near_beam; ///< For each point; empty for logs.
    std::optional<Truth> truth;  ///< Of streets.
    gpom_point_t low{0.0, 0.0};  ///< Corner of the area of grids and pictures.
    gpom_point_t high{0.0, 0.0}; ///< The opposite corner.
};

/// A method's map as asked at the picture's raster.
struct Pictures {
    std::vector<gpom_point_t> points;
    std::vector<gpom_answer_t> map;
    std::vector<double> grid;
    std::vector<double> wide_grid;
};

Trial street_trial(const Options &options)
{
    Trial trial;
    trial.mode = "street";
    trial.truth = read_truth(options.truth_path);
    trial.scans = read_scans(options.scans_path, {});
    trial.beams = beams_of(trial.scans, kHalfSpacing);
    trial.points = street_points(*trial.truth, options.n_points, options.seed);
    for (const TestPoint &point : trial.points) {
        trial.near_beam.push_back(is_near(point.at, trial.beams, kNearBeam));
    }
    trial.low = {trial.truth->x0_m, trial.truth->y0_m};
    trial.high = {trial.low.x_m + trial.truth->nx * trial.truth->cell_m,
                  trial.low.y_m + trial.truth->ny * trial.truth->cell_m};
    return trial;
}

/// Corners of the box over all beams.
void cover_beams(Trial &trial)
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    trial.low = {kFar, kFar};
    trial.high = {-kFar, -kFar};
    const auto cover = [&](gpom_point_t point) {
        trial.low = {std::min(trial.low.x_m, point.x_m), std::min(trial.low.y_m, point.y_m)};
        trial.high = {std::max(trial.high.x_m, point.x_m), std::max(trial.high.y_m, point.y_m)};
    };
    for (const GridBeam &beam : trial.beams) {
        cover({beam.x_m, beam.y_m});
        cover(end_of(beam));
    }
}

Trial log_trial(const Options &options)
{
    Trial trial;
    trial.mode = "log";
    std::vector<Scan> scans = read_scans(options.scans_path, {options.range_max_m});
    for (Scan &scan : scans) {
        scan.range_max_m = std::min(scan.range_max_m, options.range_max_m);
    }
    LogSplit split =
        split_log(evenly_taken(std::move(scans), kLogScansMax), options.fraction, options.seed);
    const double half_width_rad = 0.5 * options.beam_width_deg * kPi / 180.0;
    trial.beams = beams_of(split.training, half_width_rad);
    trial.other_beams = beams_of(split.others, half_width_rad);
    trial.scans = std::move(split.training);
    trial.points = std::move(split.points);
    cover_beams(trial);
    return trial;
}

std::vector<gpom_point_t> places_of(const std::vector<TestPoint> &points)
{
    std::vector<gpom_point_t> places;
    for (const TestPoint &point : points) {
        places.push_back(point.at);
    }
    return places;
}

/// The raster of the pictures: at most 400 x 300 cells over the area.
gpom_raster_t picture_raster(const Trial &trial, double cell_min_m)
{
    const double cell_m = std::max({(trial.high.x_m - trial.low.x_m) / kPictureColumns,
                                    (trial.high.y_m - trial.low.y_m) / kPictureRows, cell_min_m});
    return raster_over(trial.low, trial.high, cell_m, 0.0);
}

/// The origin is the middle of the drive: in the map frame, resolution falls with the distance
/// from it, so that this is kind to the paper's map; in the query frame it does not matter.
HostMap map_of(const Trial &trial, const gpom_params_t &params)
{
    HostMap map(params, beam_count(trial.scans), middle_of(trial.scans));
    map.insert(trial.scans);
    return map;
}

MethodResult gp_result(const char *key, const std::string &label, const Trial &trial,
                       const HostMap &map)
{
    MethodResult method;
    method.key = key;
    method.label = label;
    for (const gpom_answer_t &answer : map.query(places_of(trial.points))) {
        method.probabilities.push_back(double{answer.probability});
    }
    return judged(std::move(method), trial.points, trial.near_beam);
}

OccupancyGrid grid_of(const Trial &trial, const GridSetup &setup, bool wide)
{
    OccupancyGrid grid(raster_over(trial.low, trial.high, setup.cell_m, kGridMargin), setup.model);
    for (const GridBeam &beam : trial.beams) {
        wide ? grid.insert_wide(beam) : grid.insert_thin(beam);
    }
    return grid;
}

std::vector<double> ask(const OccupancyGrid &grid, const std::vector<gpom_point_t> &points)
{
    std::vector<double> probabilities;
    for (const gpom_point_t &point : points) {
        probabilities.push_back(grid.probability(point));
    }
    return probabilities;
}

MethodResult grid_result(const char *key, const char *label, const Trial &trial,
                         const OccupancyGrid &grid)
{
    MethodResult method;
    method.key = key;
    method.label = label;
    method.probabilities = ask(grid, places_of(trial.points));
    return judged(std::move(method), trial.points, trial.near_beam);
}

/// The paper's parameters: as asked for, else NAME_paper.toml beside NAME.toml, else none.
std::string map_frame_path(const Options &options)
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

void print_summary(const Options &options, const Trial &trial,
                   const std::vector<MethodResult> &methods)
{
    const Metrics &all = methods.front().all;
    std::printf("%s: %zu scans, %zu beams in the map; %zu test points, %.1f %% occupied",
                options.scans_path.c_str(), trial.scans.size(), trial.beams.size(), all.n_points,
                100.0 * all.share_occupied);
    if (methods.front().near) {
        const Metrics &near = *methods.front().near;
        std::printf("; %zu near beams, %.1f %% occupied", near.n_points,
                    100.0 * near.share_occupied);
    }
    std::printf("\n\n%s", report_table(methods).c_str());
    if (methods.size() < 4) {
        std::printf("GP in the map frame left out: no NAME_paper.toml beside %s and no "
                    "--map-frame-params\n",
                    options.params_path.c_str());
    }
}

GridSetups grid_setups(const Options &options, const Trial &trial)
{
    GridSetups setups = trial.truth ? kStreetGrids : kLogGrids;
    setups.thin.cell_m = options.grid_cell_m.value_or(setups.thin.cell_m);
    setups.wide.cell_m = options.grid_cell_m.value_or(setups.wide.cell_m);
    return setups;
}

nlohmann::ordered_json json_of(const GridSetup &setup)
{
    return {{"cell_m", setup.cell_m},
            {"p_hit", setup.model.p_hit},
            {"p_miss", setup.model.p_miss},
            {"p_min", setup.model.p_min},
            {"p_max", setup.model.p_max}};
}

nlohmann::ordered_json eval_json(const Options &options, const Trial &trial,
                                 const std::vector<MethodResult> &methods)
{
    nlohmann::ordered_json json;
    json["mode"] = trial.mode;
    json["command"] = options.command;
    json["scans_file"] = options.scans_path;
    json["seed"] = options.seed;
    json["scans"] = trial.scans.size();
    json["beams"] = trial.beams.size();
    const GridSetups setups = grid_setups(options, trial);
    json["grid"] = json_of(setups.thin);
    json["wide_grid"] = json_of(setups.wide);
    if (trial.truth) {
        json["truth_file"] = options.truth_path;
    } else {
        json["fraction"] = options.fraction;
        json["range_max_m"] = options.range_max_m;
        json["beam_width_deg"] = options.beam_width_deg;
    }
    json["params"] = {{"file", options.params_path}, {"text", text_of(options.params_path)}};
    const std::string map_frame = map_frame_path(options);
    if (!map_frame.empty()) {
        json["map_frame_params"] = {{"file", map_frame}, {"text", text_of(map_frame)}};
    }
    json.update(report_json(methods));
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

void write_results(const Options &options, const Trial &trial, const Pictures &pictures,
                   const std::vector<MethodResult> &methods)
{
    const std::string folder = options.out_path + "/";
    std::vector<FileContent> files = {
        {folder + "eval.json", eval_json(options, trial, methods).dump(1) + "\n"},
        {folder + "map.csv", answers_csv(pictures.points, pictures.map)},
        {folder + "grid.csv", probabilities_csv(pictures.points, pictures.grid)},
        {folder + "wide_grid.csv", probabilities_csv(pictures.points, pictures.wide_grid)},
        {folder + "hits.csv", hits_csv(trial)},
        {folder + "poses.csv", poses_csv(trial.scans)},
        {folder + "points.csv", points_csv(trial.points, trial.near_beam, methods)}};
    if (trial.truth) {
        files.push_back({folder + "truth.pgm", truth_pgm(*trial.truth, "copied by gpom-eval")});
    }
    std::error_code error;
    std::filesystem::create_directories(options.out_path, error);
    if (error) {
        throw FileError(options.out_path, 0, "cannot make this folder: " + error.message());
    }
    replace_files(files);
}

void evaluate(const Options &options, const Trial &trial)
{
    const std::string map_frame = map_frame_path(options);
    const HostMap map = map_of(trial, read_params(options.params_path));
    std::vector<MethodResult> methods;
    methods.push_back(gp_result("gp_query", "GP, query frame", trial, map));
    if (!map_frame.empty()) {
        const HostMap paper = map_of(trial, read_map_frame_params(map_frame));
        methods.push_back(gp_result("gp_map", "GP, map frame (as the paper)", trial, paper));
    }
    const GridSetups setups = grid_setups(options, trial);
    const OccupancyGrid thin = grid_of(trial, setups.thin, false);
    const OccupancyGrid wide = grid_of(trial, setups.wide, true);
    methods.push_back(grid_result("grid", "occupancy grid", trial, thin));
    methods.push_back(grid_result("wide_grid", "occupancy grid, widened beams", trial, wide));
    if (!options.out_path.empty()) {
        const gpom_raster_t raster = picture_raster(trial, trial.truth ? 0.25 : 0.05);
        const std::vector<gpom_point_t> points = cell_centres(raster);
        write_results(options, trial,
                      {points, map.query(raster), ask(thin, points), ask(wide, points)}, methods);
    }
    print_summary(options, trial, methods);
}

/// CLI::Range lets NaN pass.
CLI::Validator between(double low, double high)
{
    return CLI::Validator(
        [low, high](std::string &text) {
            double value = 0.0;
            const bool is_number = CLI::detail::lexical_cast(text, value);
            if (is_number && value >= low && value <= high) {
                return std::string();
            }
            std::string problem;
            append_text(problem, "%s is not a number from %g to %g", text.c_str(), low, high);
            return problem;
        },
        "");
}

void declare_common(CLI::App &mode, Options &options)
{
    mode.add_option("--scans", options.scans_path, "Scans: CSV or CARMEN log, plain or gzipped")
        ->required()
        ->type_name("FILE");
    mode.add_option("--params", options.params_path, "Parameters of the map, TOML")
        ->required()
        ->type_name("FILE");
    mode.add_option("--map-frame-params", options.map_frame_path,
                    "Parameters as in the paper: kernel nn, map frame\n"
                    "[NAME_paper.toml beside NAME.toml, if it is there]")
        ->type_name("FILE");
    mode.add_option("--seed", options.seed, "Seed of the choice of points")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    mode.add_option("--grid-cell", options.grid_cell_m,
                    "Cell of both occupancy grids [m]; default: what serves each best")
        ->check(between(0.01, 100.0));
    mode.add_option("--out", options.out_path,
                    "Folder for eval.json and the CSV files of gpom-plot")
        ->type_name("DIR");
}

CLI::App *declare_street(CLI::App &app, Options &options)
{
    CLI::App *mode = app.add_subcommand(
        "street", "Judge by the truth of a simulated street, at random places of the whole area");
    declare_common(*mode, options);
    mode->add_option("--truth", options.truth_path, "Truth written by gpom-sim, PGM image")
        ->required()
        ->type_name("FILE");
    mode->add_option("--points", options.n_points, "Test points")
        ->check(CLI::Range(std::size_t{1}, std::size_t{10'000'000}))
        ->capture_default_str();
    return mode;
}

void declare_log(CLI::App &app, Options &options)
{
    CLI::App *mode =
        app.add_subcommand("log", "Judge by the beams of a log that the map did not get");
    declare_common(*mode, options);
    mode->add_option("--range-max", options.range_max_m,
                     "Usable range [m]; longer readings are no returns")
        ->check(between(0.1, 1000.0))
        ->capture_default_str();
    mode->add_option("--fraction", options.fraction, "Share of the returns that the map gets")
        ->check(between(0.0, 1.0))
        ->capture_default_str();
    mode->add_option("--beam-width-deg", options.beam_width_deg,
                     "Whole angle of the widened grid's beams [degree]")
        ->check(between(0.0, 120.0))
        ->capture_default_str();
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app(
        "Compare the map with occupancy grids on the same data, judged at the same points.",
        "gpom-eval");
    Options street, log;
    CLI::App *const street_mode = declare_street(app, street);
    declare_log(app, log);
    app.require_subcommand(1);
    for (int i = 0; i < argc; ++i) {
        (street.command += i > 0 ? " " : "") += argv[i];
    }
    log.command = street.command;
    return run_tool(app, argc, argv, [&] {
        const Options &options = street_mode->parsed() ? street : log;
        evaluate(options, street_mode->parsed() ? street_trial(options) : log_trial(options));
    });
}
