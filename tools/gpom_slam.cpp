// gpom-slam: builds a map from a raw log by aligning each scan, and measures the way it found.
#include "ports/host/command_line.hpp"
#include "ports/host/file_error.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/map/answer_csv.hpp"
#include "tools/map/map_options.hpp"
#include "tools/map/raster_csv.hpp"
#include "tools/slam/errors.hpp"
#include "tools/slam/gpom_matcher.hpp"
#include "tools/slam/hector.hpp"
#include "tools/slam/icp.hpp"
#include "tools/slam/starts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

using namespace gpom_tools;

namespace
{

struct Options {
    std::string params_path, scans_path, corrected_path, relations_path, csv_path, points_path,
        map_path;
    ReadOptions reading;
    LiveConfig live;
    GpomMatcherOptions building, finished; ///< For a map that grows, and for one that stands.
    DriveOptions drive;
    StartOptions starts;
    std::vector<std::string> methods = {"odometry", "gpom", "hector", "icp"};
    std::vector<std::size_t> n_returns = {180};
};

/// The square that holds all poses, with room for drift.
struct Area {
    Pose middle;
    double side_m;
};

bool has_corrections(const std::vector<DrivenScan> &log)
{
    return std::any_of(log.begin(), log.end(),
                       [](const DrivenScan &scan) { return scan.corrected.has_value(); });
}

Area area_of(const std::vector<DrivenScan> &log)
{
    Pose low = {1e300, 1e300, 0.0}, high = {-1e300, -1e300, 0.0};
    const bool has_corrected = has_corrections(log);
    for (const DrivenScan &scan : log) {
        if (has_corrected && !scan.corrected) {
            continue;
        }
        const Pose &pose = scan.corrected ? *scan.corrected : scan.odometry;
        low = {std::min(low.x_m, pose.x_m), std::min(low.y_m, pose.y_m), 0.0};
        high = {std::max(high.x_m, pose.x_m), std::max(high.y_m, pose.y_m), 0.0};
    }
    const double side_m = std::max(high.x_m - low.x_m, high.y_m - low.y_m) + 60.0;
    return {{(low.x_m + high.x_m) / 2, (low.y_m + high.y_m) / 2, 0.0}, std::min(side_m, 300.0)};
}

std::unique_ptr<Matcher> make_matcher(const std::string &method, const std::vector<DrivenScan> &log,
                                      const Options &options, GpomMatcherOptions gpom,
                                      std::size_t n_returns)
{
    const Area area = area_of(log);
    if (method == "gpom") {
        gpom.align.n_returns_max = static_cast<std::uint16_t>(n_returns);
        gpom.step_ops = options.live.step_ops;
        const gpom_point_t origin = {std::round(area.middle.x_m), std::round(area.middle.y_m)};
        return std::make_unique<GpomMatcher>(
            live_config(read_params(options.params_path), options.live, origin), gpom);
    }
    if (method == "hector") {
        HectorOptions hector;
        hector.n_returns = n_returns;
        return std::make_unique<HectorMatcher>(area.middle, area.side_m, hector);
    }
    return method == "icp" ? std::make_unique<IcpMatcher>(n_returns) : nullptr;
}

std::vector<DrivenScan> read_log(const Options &options)
{
    std::vector<DrivenScan> log =
        read_raw_log(options.scans_path, options.corrected_path, options.reading);
    if (log.size() < 2) {
        throw FileError(options.scans_path, 0, "fewer than two scans");
    }
    return log;
}

void print_errors(const std::vector<DrivenScan> &log, const std::vector<Visited> &way)
{
    const RelativeError near = relative_error(log, way, 1.0), far = relative_error(log, way, 10.0);
    std::printf(" %8.3f %7.3f %7.3f %6.2f", absolute_rms_m(log, way), near.place_m, far.place_m,
                far.yaw_rad * 180.0 / M_PI);
}

void print_work(const Driven &driven, const Matcher &matcher)
{
    const double n = static_cast<double>(std::max<std::size_t>(driven.n_matched, 1));
    std::printf(" %6zu %5zu %5zu %7.0f %7zu %6.2f %7zu", driven.n_matched, driven.n_inserted,
                driven.n_doubtful, static_cast<double>(driven.n_searches) / n,
                driven.n_searches_max, driven.match_ms / n, matcher.n_beams());
}

void append_way(std::string &csv, const std::string &method, std::size_t n_returns,
                const std::vector<DrivenScan> &log, const std::vector<Visited> &way)
{
    for (const Visited &visited : way) {
        append_text(csv, "%s,%zu,%zu,%.6f,%.6f,%.6f,%.6f,%u\n", method.c_str(), n_returns,
                    visited.i_scan, log[visited.i_scan].scan.t_s, visited.pose.x_m,
                    visited.pose.y_m, visited.pose.yaw_rad, visited.flags);
    }
}

/// The returns of the scans with a corrected pose, or of all if none has one, at the poses found.
void append_points(std::string &csv, const std::string &method, const std::vector<DrivenScan> &log,
                   const std::vector<Visited> &way)
{
    const bool has_corrected = has_corrections(log);
    for (const Visited &visited : way) {
        const DrivenScan &scan = log[visited.i_scan];
        if (has_corrected && !scan.corrected) {
            continue;
        }
        for (const PolarReturn &r : returns_of(scan.scan, scan.scan.ranges_m.size())) {
            const Pose at =
                visited.pose * Pose{0.0, 0.0, r.bearing_rad} * Pose{r.range_m, 0.0, 0.0};
            append_text(csv, "%s,%.3f,%.3f\n", method.c_str(), at.x_m, at.y_m);
        }
    }
}

Driven driven_by(const std::string &method, const std::vector<DrivenScan> &log, Matcher *matcher,
                 const Options &options)
{
    return method == "corrected" ? corrected_drive(log) : drive(log, matcher, options.drive);
}

void print_relations(const std::vector<Relation> &relations, const std::vector<DrivenScan> &log,
                     const std::vector<Visited> &way)
{
    if (relations.empty()) {
        return;
    }
    const RelationError error = relation_error(relations, log, way);
    std::printf("  relations %zu: %.3f +- %.3f m, %.2f +- %.2f degree", error.n, error.place_m,
                error.place_sd_m, error.yaw_rad * 180.0 / M_PI, error.yaw_sd_rad * 180.0 / M_PI);
}

/// The files that a drive writes.
struct DriveFiles {
    std::string way = "method,returns,scan,t,x,y,yaw,flags\n", points = "method,x,y\n", beams;

    void write(const Options &options) const
    {
        std::vector<FileContent> files;
        const auto add = [&](const std::string &path, const std::string &bytes) {
            if (!path.empty()) {
                files.push_back({path, bytes});
            }
        };
        add(options.csv_path, way);
        add(options.points_path, points);
        add(options.map_path, beams);
        replace_files(files);
    }
};

void run_drive(const std::string &method, std::size_t n_returns, const std::vector<DrivenScan> &log,
               const Options &options, DriveFiles &files)
{
    const std::unique_ptr<Matcher> matcher =
        make_matcher(method, log, options, options.building, n_returns);
    const Driven driven = driven_by(method, log, matcher.get(), options);
    std::printf("%-9s %4zu", method.c_str(), matcher != nullptr ? n_returns : 0);
    print_errors(log, driven.way);
    if (matcher != nullptr) {
        print_work(driven, *matcher);
    }
    if (!options.relations_path.empty()) {
        print_relations(read_relations(options.relations_path), log, driven.way);
    }
    std::printf("\n");
    std::fflush(stdout);
    append_way(files.way, method, n_returns, log, driven.way);
    if (!options.points_path.empty()) {
        append_points(files.points, method, log, driven.way);
    }
    if (const auto *const gpom = dynamic_cast<const GpomMatcher *>(matcher.get())) {
        files.beams = beams_csv(gpom->map().kept());
    }
}

void run_drives(const Options &options)
{
    const std::vector<DrivenScan> log = read_log(options);
    std::printf("                absolute  1 m     10 m    10 m  scans  inser  in    searches a "
                "scan  ms     kept\n"
                "method    beams rms [m]  [m]     [m]    [deg] found  ted    doubt   mean    most "
                "a scan  beams\n");
    DriveFiles files;
    for (const std::string &method : options.methods) {
        const bool has_matcher = method != "odometry" && method != "corrected";
        for (std::size_t i = 0; i < (has_matcher ? options.n_returns.size() : 1); ++i) {
            run_drive(method, options.n_returns[i], log, options, files);
        }
    }
    files.write(options);
}

/// Shares of starts that end right, for each offset.
void print_shares(const std::vector<Start> &starts)
{
    for (const StartOffset &off : kOffsets) {
        std::size_t n = 0, n_right = 0;
        for (const Start &start : starts) {
            if (start.off.place_m == off.place_m && std::abs(start.off.yaw_deg) == off.yaw_deg) {
                ++n;
                n_right += start.is_right() ? 1 : 0;
            }
        }
        std::printf("  %.1f m %2.0f: %5.1f %%", off.place_m, off.yaw_deg,
                    100.0 * static_cast<double>(n_right) / static_cast<double>(n));
    }
}

void print_flags(const std::vector<Start> &starts)
{
    std::size_t n_right = 0, n_wrong = 0, n_right_flagged = 0, n_wrong_silent = 0;
    std::vector<double> places;
    double nees = 0.0;
    std::map<unsigned, std::pair<std::size_t, std::size_t>> by_flags;
    double searches = 0.0;
    for (const Start &start : starts) {
        (start.is_right() ? n_right : n_wrong) += 1;
        n_right_flagged += start.is_right() && start.found.flags != 0 ? 1 : 0;
        n_wrong_silent += !start.is_right() && start.found.flags == 0 ? 1 : 0;
        auto &count = by_flags[start.found.flags];
        (start.is_right() ? count.first : count.second) += 1;
        searches += static_cast<double>(start.found.n_searches);
        if (start.is_right()) {
            places.push_back(start.place_m);
            nees += start.nees;
        }
    }
    std::sort(places.begin(), places.end());
    std::printf(
        "\n  right %zu, median %.3f m, flagged %.1f %%, mean NEES %.2f; wrong %zu, without a "
        "flag %.1f %%; searches %.0f\n  flags (right, wrong):",
        n_right, places.empty() ? NAN : places[places.size() / 2],
        100.0 * static_cast<double>(n_right_flagged) / static_cast<double>(n_right),
        nees / static_cast<double>(n_right), n_wrong,
        100.0 * static_cast<double>(n_wrong_silent) /
            static_cast<double>(std::max<std::size_t>(n_wrong, 1)),
        searches / static_cast<double>(starts.size()));
    for (const auto &[flags, count] : by_flags) {
        std::printf(" %u: %zu, %zu;", flags, count.first, count.second);
    }
    std::printf("\n");
    std::fflush(stdout);
}

void run_starts(const Options &options)
{
    const std::vector<DrivenScan> log = read_log(options);
    std::string csv = "method,returns,scan,off_m,off_deg,error_m,error_deg,flags,residual_m,nees,"
                      "matched,new,weak_sd_m,weak_sd_rad,searches\n";
    for (const std::string &method : options.methods) {
        for (const std::size_t n_returns : options.n_returns) {
            const std::unique_ptr<Matcher> matcher =
                make_matcher(method, log, options, options.finished, n_returns);
            if (matcher == nullptr) {
                continue;
            }
            const std::vector<Start> starts = try_starts(log, *matcher, options.starts);
            std::printf("%-7s %zu", method.c_str(), n_returns);
            print_shares(starts);
            print_flags(starts);
            for (const Start &s : starts) {
                append_text(
                    csv, "%s,%zu,%zu,%.1f,%.0f,%.4f,%.3f,%u,%.4f,%.3f,%.3f,%.3f,%.3f,%.4f,%zu\n",
                    method.c_str(), n_returns, s.i_scan, s.off.place_m, s.off.yaw_deg, s.place_m,
                    s.yaw_deg, s.found.flags, s.found.residual_m, s.nees,
                    static_cast<double>(s.found.n_matched) / static_cast<double>(s.found.n_returns),
                    static_cast<double>(s.found.n_new) / static_cast<double>(s.found.n_returns),
                    s.found.weak_sd_m, s.found.weak_sd_rad, s.found.n_searches);
            }
        }
    }
    if (!options.csv_path.empty()) {
        replace_files({{options.csv_path, csv}});
    }
}

CLI::App *add_command(CLI::App &app, const std::string &name, const std::string &what,
                      Options &options)
{
    CLI::App *const command = app.add_subcommand(name, what);
    command->add_option("--params", options.params_path, "Hyperparameters, TOML")
        ->required()
        ->type_name("FILE");
    command->add_option("--scans", options.scans_path, "Log with poses of odometry")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--corrected", options.corrected_path,
                     "Log of the same scans with corrected poses")
        ->type_name("FILE");
    command->add_option("--csv", options.csv_path, "File for all poses")->type_name("FILE");
    command->add_option("--methods", options.methods, "Methods to compare")
        ->check(CLI::IsMember({"odometry", "gpom", "hector", "icp", "corrected"}))
        ->delimiter(',');
    command->add_option("--returns", options.n_returns, "Most returns of a scan that are used")
        ->check(CLI::Range(8u, GPOM_ALIGN_RETURNS_MAX))
        ->delimiter(',');
    command->add_option("--range-max", options.reading.range_max_m, "Usable range [m]");
    add_scan_options(*command, options.reading);
    add_live_options(*command, options.live);
    add_capacity_option(*command, options.live);
    return command;
}

void add_align_options(CLI::App &command, GpomMatcherOptions &gpom)
{
    gpom_align_config_t &align = gpom.align;
    command.add_option("--independent", align.n_independent, "Independent returns of a scan");
    command.add_option("--residual-good", align.residual_good_m,
                       "With a greater residual other headings are tried [m]");
    command.add_option("--residual-max", align.residual_max_m, "A scan fits up to this [m]");
    command.add_option("--heading-step", align.heading_step_rad, "Step of other headings [rad]");
    command.add_option("--iterations", align.n_iterations, "Most iterations from one heading");
    command.add_flag("--insert-cov", gpom.inserts_cov,
                     "Insert scans with the covariance of their alignment");
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Build a map from a raw log, scan by scan, and measure the way that was found.",
                 "gpom-slam");
    app.require_subcommand(1);
    Options options;
    gpom_align_config_init(&options.finished.align);
    options.building = options.finished;
    options.building.align.residual_good_m = 0.04f; // a map of few scans fits worse
    options.building.align.residual_max_m = 0.06f;
    options.live.beam_max = 65536;
    CLI::App *const drives = add_command(app, "drive", "Drive the log", options);
    drives->add_option("--relations", options.relations_path, "Relations of the SLAM benchmark")
        ->type_name("FILE");
    drives->add_option("--points", options.points_path, "File for the returns at the poses found")
        ->type_name("FILE");
    drives->add_option("--map", options.map_path, "File for the kept beams of the last gpom map")
        ->type_name("FILE");
    drives->add_option("--insert-way", options.drive.insert_m, "Way between inserted scans [m]");
    add_align_options(*drives, options.building);
    CLI::App *const starts =
        add_command(app, "starts", "Align from starts that are off, on right maps", options);
    starts->add_option("--every", options.starts.every, "Align each so many-th scan");
    starts->add_option("--seed", options.starts.seed, "Seed of the directions");
    add_align_options(*starts, options.finished);
    return run_tool(app, argc, argv,
                    [&] { drives->parsed() ? run_drives(options) : run_starts(options); });
}
