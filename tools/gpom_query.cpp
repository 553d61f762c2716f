// gpom-query: reads scans and points, writes answers.
#include "ports/host/command_line.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/progress.hpp"
#include "ports/host/scan_options.hpp"
#include "ports/host/text_lines.hpp"
#include "tools/map/answer_csv.hpp"
#include "tools/map/host_map.hpp"
#include "tools/map/map_options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>

using namespace gpom_tools;

namespace
{

/// Points answered between two updates of the progress bar.
constexpr std::size_t kChunk = 20000;

struct Options {
    std::string scans_path, params_path, points_path, out_path;
    std::vector<double> raster; ///< x0, y0, cell, nx, ny.
    std::vector<double> origin = {0.0, 0.0};
    ReadOptions reading;
    std::optional<double> beam_max; ///< Absent: as many as the scans have.
    bool gradients = false;         ///< Derivatives of the answers, too.
    std::string kept_path;          ///< File for the kept beams, CSV.
    bool live = false;              ///< Keep only useful beams, as a vehicle does.
    LiveConfig live_config;
};

void declare_options(CLI::App &app, Options &options)
{
    app.add_option("--scans", options.scans_path, "Scans: CSV or CARMEN log, plain, gzip or bzip2")
        ->required()
        ->type_name("FILE");
    app.add_option("--params", options.params_path, "Hyperparameters, TOML")
        ->required()
        ->type_name("FILE");
    CLI::Option *const points =
        app.add_option("--points", options.points_path, "Points to answer, x,y a line [m]")
            ->type_name("FILE");
    app.add_option("--raster", options.raster,
                   "Instead of --points: x0,y0,cell,nx,ny; corner of cell 0 and cell size [m]")
        ->delimiter(',')
        ->expected(5)
        ->excludes(points);
    app.add_option("--out", options.out_path, "Answers: x,y,mean,variance,probability,class a line")
        ->required()
        ->type_name("FILE");
    app.add_flag("--gradients", options.gradients,
                 "Also write the derivatives by x and y: mean_x,...,probability_y [1/m]");
    app.add_option("--origin", options.origin,
                   "Origin X,Y of the map [m]; beams must lie within 8 km of it")
        ->delimiter(',')
        ->expected(2)
        ->capture_default_str();
    app.add_option("--range-max", options.reading.range_max_m,
                   "Usable range of a CARMEN log's sensor [m]")
        ->capture_default_str();
    add_scan_options(app, options.reading);
    app.add_option(
           "--beam-max", options.beam_max,
           "Capacity of the map [beams]; default: all beams of the scans, with --live 16384")
        ->check(CLI::Number);
    CLI::Option *const live = app.add_flag(
        "--live", options.live, "Keep only useful beams, as a vehicle's map does, scan by scan");
    for (CLI::Option *const option : add_live_options(app, options.live_config)) {
        option->needs(live);
    }
    app.add_option("--kept", options.kept_path, "Kept beams to write, CSV")->type_name("FILE");
}

/// A whole number from the command line. A number out of range, such as 1e12, is an error and does
/// not wrap around.
double whole_number(double value, double low, double high, const std::string &name)
{
    if (!(value >= low && value <= high) || value != std::floor(value)) {
        char range[80];
        std::snprintf(range, sizeof range, "must be a whole number from %.0f to %.0f", low, high);
        throw std::runtime_error(name + ": " + range);
    }
    return value;
}

gpom_raster_t raster_of(const std::vector<double> &values)
{
    gpom_raster_t raster = {values[0], values[1], values[2], 0, 0};
    const bool finite = std::isfinite(raster.x0_m) && std::isfinite(raster.y0_m);
    if (!finite || !(raster.cell_m > 0.0) || !std::isfinite(raster.cell_m)) {
        throw std::runtime_error("--raster: corner must be finite and the cell size over 0");
    }
    raster.nx =
        static_cast<std::uint32_t>(whole_number(values[3], 1, GPOM_RASTER_SIDE_MAX, "--raster nx"));
    raster.ny =
        static_cast<std::uint32_t>(whole_number(values[4], 1, GPOM_RASTER_SIDE_MAX, "--raster ny"));
    if (values[3] * values[4] > kRasterCellsMax) {
        throw std::runtime_error("--raster: more than 1e8 cells; query it in parts");
    }
    return raster;
}

std::vector<gpom_point_t> points_of(const Options &options)
{
    if (!options.raster.empty()) {
        return cell_centres(raster_of(options.raster));
    }
    if (options.points_path.empty()) {
        throw std::runtime_error("--points or --raster is required; see gpom-query --help");
    }
    return read_points(options.points_path);
}

/// The scans must lie near the origin. If they do not, the error suggests an origin.
void check_reach(const std::vector<Scan> &scans, const gpom_point_t &origin)
{
    if (!std::isfinite(origin.x_m) || !std::isfinite(origin.y_m)) {
        throw std::runtime_error("--origin: must be two finite numbers");
    }
    for (const Scan &scan : scans) {
        if (std::hypot(scan.x_m - origin.x_m, scan.y_m - origin.y_m) > GPOM_REACH_M) {
            const gpom_point_t middle = middle_of(scans);
            char text[200];
            std::snprintf(text, sizeof text,
                          "scan at (%.1f, %.1f) is over 8 km from the origin (%.1f, %.1f); "
                          "try --origin %.0f,%.0f",
                          scan.x_m, scan.y_m, origin.x_m, origin.y_m, middle.x_m, middle.y_m);
            throw std::runtime_error(text);
        }
    }
}

HostMap map_of(const Options &options, const std::vector<Scan> &scans)
{
    const gpom_params_t params = read_params(options.params_path);
    const gpom_point_t origin = {options.origin[0], options.origin[1]};
    check_reach(scans, origin);
    const double all =
        static_cast<double>(options.live ? options.live_config.beam_max : beam_count(scans));
    const double wanted = options.beam_max.value_or(all);
    const auto beam_max =
        static_cast<std::size_t>(whole_number(wanted, 1, GPOM_BEAM_MAX, "--beam-max"));
    if (!options.live) {
        HostMap map(params, beam_max, origin);
        map.insert(scans);
        return map;
    }
    LiveConfig live = options.live_config;
    live.beam_max = static_cast<std::uint32_t>(beam_max);
    HostMap map(live_config(params, live, origin), live.late_m);
    Progress progress("mapping");
    for (std::size_t i = 0; i < scans.size(); ++i) {
        map.insert(scans[i]);
        map.step(live.step_ops);
        progress.update(i + 1, scans.size());
    }
    return map;
}

/// Answers by `query`, some points at a time.
template <class Query> auto answers_of(const std::vector<gpom_point_t> &points, const Query &query)
{
    decltype(query(points)) answers;
    answers.reserve(points.size());
    Progress progress("answering");
    for (std::size_t i = 0; i < points.size(); i += kChunk) {
        const auto first = points.begin() + static_cast<std::ptrdiff_t>(i);
        const auto last = first + static_cast<std::ptrdiff_t>(std::min(kChunk, points.size() - i));
        const auto part = query(std::vector<gpom_point_t>(first, last));
        answers.insert(answers.end(), part.begin(), part.end());
        progress.update(answers.size(), points.size());
    }
    return answers;
}

struct AnswerFile {
    std::vector<gpom_answer_t> answers;
    std::string text;
};

AnswerFile answer_file(const HostMap &map, const std::vector<gpom_point_t> &points, bool gradients)
{
    if (!gradients) {
        auto answers = answers_of(points, [&map](const auto &part) { return map.query(part); });
        std::string text = answers_csv(points, answers);
        return {std::move(answers), std::move(text)};
    }
    const auto all = answers_of(points, [&map](const auto &part) { return map.gradients(part); });
    std::vector<gpom_answer_t> answers;
    for (const gpom_gradient_t &gradient : all) {
        answers.push_back(gradient.answer);
    }
    return {std::move(answers), gradients_csv(points, all)};
}

void report(const HostMap &map, const std::vector<gpom_answer_t> &answers)
{
    const gpom_stats_t stats = map.stats();
    const auto n_ignored =
        stats.beams_nan + stats.beams_not_positive + stats.beams_too_near + stats.beams_masked;
    std::printf("%llu scans: %llu hits, %llu beams without return, %llu readings ignored; "
                "%zu points answered\n",
                static_cast<unsigned long long>(stats.scans_inserted),
                static_cast<unsigned long long>(stats.beams_hit),
                static_cast<unsigned long long>(stats.beams_no_return),
                static_cast<unsigned long long>(n_ignored), answers.size());
    const auto count_flag = [&answers](unsigned flag) {
        return std::count_if(answers.begin(), answers.end(),
                             [flag](const gpom_answer_t &a) { return (a.flags & flag) != 0; });
    };
    const auto n_bad = count_flag(GPOM_ANSWER_PIVOT);
    if (n_bad > 0) {
        std::fprintf(stderr,
                     "gpom-query: warning: %lld points had a matrix that is not positive "
                     "definite and got the prior; raise sn2\n",
                     static_cast<long long>(n_bad));
    }
    const auto n_cut = count_flag(GPOM_ANSWER_CUT);
    if (n_cut > 0) {
        std::fprintf(stderr,
                     "gpom-query: warning: %lld points lie among so many beams that their search "
                     "was cut; keep fewer of them (--live)\n",
                     static_cast<long long>(n_cut));
    }
}

/// Print what happened to the beams that are not kept.
void report_live(const HostMap &map)
{
    const gpom_stats_t stats = map.stats();
    std::printf(
        "%u beams in the map: %llu confirmed what was known, %llu contradicted it, %llu were "
        "redundant; %llu evicted, %llu not confirmed, %llu hits and %llu free segments "
        "cleared\n",
        gpom_map_beam_count(map.get()), static_cast<unsigned long long>(stats.beams_known),
        static_cast<unsigned long long>(stats.beams_contradicting),
        static_cast<unsigned long long>(stats.beams_redundant),
        static_cast<unsigned long long>(gpom_stats_evicted(&stats)),
        static_cast<unsigned long long>(stats.beams_not_confirmed),
        static_cast<unsigned long long>(stats.hits_cleared),
        static_cast<unsigned long long>(stats.free_cleared));
}

void query(const Options &options)
{
    const std::vector<gpom_point_t> points = points_of(options);
    const std::vector<Scan> scans = read_scans(options.scans_path, options.reading);
    const HostMap map = map_of(options, scans);
    const AnswerFile file = answer_file(map, points, options.gradients);
    std::vector<FileContent> files = {{options.out_path, file.text}};
    if (!options.kept_path.empty()) {
        files.push_back({options.kept_path, beams_csv(map.kept())});
    }
    replace_files(files);
    report(map, file.answers);
    if (options.live) {
        report_live(map);
    }
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Build a map from scans and answer points: mean, variance and probability of\n"
                 "occupancy, and class.",
                 "gpom-query");
    Options options;
    declare_options(app, options);
    return run_tool(app, argc, argv, [&options] { query(options); });
}
