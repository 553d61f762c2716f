// gpom-odometry: measures how much odometry between poses improves the map, on a simulated drive.
#include "ports/host/command_line.hpp"
#include "ports/host/file_error.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/linux/pose/odometry.hpp"
#include "tools/eval/metrics.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/eval/trial.hpp"
#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

using namespace gpom_tools;
using gpomd::Motion;
using gpomd::Odometry;
using gpomd::PoseCov;
using gpomd::PoseMatch;
using gpomd::PoseRing;
using gpomd::StampedPose;

namespace
{

using Json = nlohmann::ordered_json;

struct Options {
    std::string params_path, json_path;
    StreetConfig street;
    LiveConfig live;
    std::size_t n_points = 20000;
    double pose_period_s = 2.0;
    double pose_place_sd_m = 0.02, pose_yaw_sd_rad = 0.004;
    double speed_mean_mps = 5.0, speed_swing_mps = 3.0, swing_m = 30.0; ///< Town traffic.
    double odometry_hz = 50.0;
    gpomd::OdometryConfig odometry = {200000, 5000000, 0.02, 0.005, 0.01, 0.001};
};

/// A drive, and the readings of its sensors.
struct Drive {
    std::vector<Scan> scans;        ///< Scans with their true poses and times.
    std::vector<StampedPose> poses; ///< Poses of the localiser, one for each scan.
    std::vector<Motion> motions;
};

/// How scans between poses get their pose.
enum class Between { every_has_one, odometry, plain_odometry, interpolated, dropped };

struct Row {
    std::string key, label;
    Between between;
    bool is_weighed;

    bool has_odometry() const
    {
        return between == Between::odometry || between == Between::plain_odometry;
    }
};

const Row kRows[] = {
    {"every", "every scan has one, weighed", Between::every_has_one, true},
    {"every_unweighed", "every scan has one, not weighed", Between::every_has_one, false},
    {"weighed", "odometry between, weighed", Between::odometry, true},
    {"unweighed", "odometry between, not weighed", Between::odometry, false},
    {"plain_weighed", "odometry, errors not learnt, weighed", Between::plain_odometry, true},
    {"plain_unweighed", "odometry, errors not learnt, not weighed", Between::plain_odometry, false},
    {"interpolated", "interpolated between", Between::interpolated, true},
    {"dropped", "scans without one dropped", Between::dropped, true}};

std::int64_t stamp_of(const Scan &scan) { return std::llround(1e6 * scan.t_s); }

/// Set the times of the scans. Scans come at equal steps of the way, so their times follow from the
/// speed.
void set_times(std::vector<Scan> &scans, const Options &options)
{
    double t_s = 0.0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].t_s = t_s;
        const double way_m = (static_cast<double>(i) + 0.5) * options.street.step_m;
        t_s += options.street.step_m /
               (options.speed_mean_mps +
                options.speed_swing_mps * std::sin(2.0 * M_PI * way_m / options.swing_m));
    }
}

/// The robot's true motion from one scan to the next, an arc.
Motion motion_between(const Scan &a, const Scan &b)
{
    const double dt_s = b.t_s - a.t_s;
    return {0, std::hypot(b.x_m - a.x_m, b.y_m - a.y_m) / dt_s,
            std::remainder(b.theta_rad - a.theta_rad, 2.0 * M_PI) / dt_s};
}

/// Add the motions that wheels and gyro measure. They have errors that are constant over the drive,
/// and white errors.
void add_odometry(Drive &drive, const Options &options, StreetRandom &random)
{
    const double scale = 1.0 + options.odometry.speed_scale_sd * random.gaussian();
    const double bias = options.odometry.yaw_rate_bias_sd * random.gaussian();
    const double speed_sd = options.odometry.speed_noise * std::sqrt(options.odometry_hz);
    const double turn_sd = options.odometry.yaw_rate_noise * std::sqrt(options.odometry_hz);
    const double end_s = drive.scans.back().t_s + 0.1;
    std::size_t i = 0; // index of the scan before
    for (double t_s = 0.0; t_s < end_s; t_s += 1.0 / options.odometry_hz) {
        while (i + 2 < drive.scans.size() && drive.scans[i + 1].t_s <= t_s) {
            ++i;
        }
        const Motion truth = motion_between(drive.scans[i], drive.scans[i + 1]);
        drive.motions.push_back({std::llround(1e6 * t_s),
                                 scale * truth.speed_mps + speed_sd * random.gaussian(),
                                 truth.yaw_rate_radps + bias + turn_sd * random.gaussian()});
    }
}

Drive drive_of(const Options &options, const StreetWorld &world)
{
    Drive drive;
    drive.scans = simulate_scans(world, options.street, [](std::size_t, std::size_t) {});
    set_times(drive.scans, options);
    StreetRandom random(options.street.seed + 1000, StreetRandom::Stream::noise);
    for (const Scan &scan : drive.scans) {
        drive.poses.push_back({stamp_of(scan),
                               scan.x_m + options.pose_place_sd_m * random.gaussian(),
                               scan.y_m + options.pose_place_sd_m * random.gaussian(),
                               scan.theta_rad + options.pose_yaw_sd_rad * random.gaussian()});
    }
    add_odometry(drive, options, random);
    return drive;
}

/// Poses that the map of this row gets: the first scan's pose, then each pose that comes a period
/// after the last.
PoseRing poses_of(const Drive &drive, const Row &row, const Options &options)
{
    PoseRing ring;
    std::int64_t next_us = 0;
    for (const StampedPose &pose : drive.poses) {
        if (row.between == Between::every_has_one || pose.stamp_us >= next_us) {
            ring.push(pose);
            next_us = pose.stamp_us + std::llround(1e6 * options.pose_period_s);
        }
    }
    return ring;
}

/// Learn the odometry's errors as gpomd does, from the poses that have come by a time.
void learn_from(const PoseRing &ring, std::int64_t stamp_us, const PoseCov &cov, Odometry &odometry)
{
    StampedPose from = {}, to = {};
    if (ring.not_after(stamp_us, to) && ring.not_after(to.stamp_us - 1000000, from)) {
        float pose_cov[9];
        std::copy_n(cov, 9, pose_cov);
        odometry.learn(from, to, pose_cov);
    }
}

/// Find a scan's pose as gpomd does. `cov` is the covariance of earlier poses. False: gpomd drops
/// the scan.
bool find_pose(const Odometry &odometry, const Row &row, const PoseRing &ring, StampedPose &pose,
               PoseCov &cov)
{
    const std::int64_t stamp_us = pose.stamp_us;
    StampedPose from = {};
    if (row.has_odometry() && ring.not_after(stamp_us, from)) {
        return odometry.carry(from, stamp_us, pose, cov) == PoseMatch::found;
    }
    const std::int64_t gap_us = row.between == Between::interpolated ? INT64_MAX : 0;
    return ring.at(stamp_us, gap_us, pose) == PoseMatch::found;
}

struct Built {
    std::size_t n_scans; ///< Number of scans that had a pose.
    double error_m;      ///< Root mean square error of their places.
};

Built build(HostMap &map, const Drive &drive, const Row &row, const Options &options)
{
    const PoseRing ring = poses_of(drive, row, options);
    const auto odometry_memory = std::make_unique<Odometry>();
    Odometry &odometry = *odometry_memory;
    odometry.init(options.odometry);
    for (const Motion &motion : drive.motions) {
        odometry.push(motion);
    }
    Built built = {0, 0.0};
    for (const Scan &scan : drive.scans) {
        StampedPose pose = {stamp_of(scan), 0.0, 0.0, 0.0};
        const double place_var = options.pose_place_sd_m * options.pose_place_sd_m;
        PoseCov cov = {place_var, 0,         0,
                       0,         place_var, 0,
                       0,         0,         options.pose_yaw_sd_rad * options.pose_yaw_sd_rad};
        if (row.between == Between::odometry) {
            learn_from(ring, pose.stamp_us, cov, odometry);
        }
        if (!find_pose(odometry, row, ring, pose, cov)) {
            continue;
        }
        const double error_m = std::hypot(pose.x_m - scan.x_m, pose.y_m - scan.y_m);
        built.error_m += error_m * error_m;
        ++built.n_scans;
        Scan believed = scan;
        believed.x_m = pose.x_m;
        believed.y_m = pose.y_m;
        believed.theta_rad = pose.yaw_rad;
        float weights[9];
        std::copy_n(cov, 9, weights);
        map.insert(believed, row.is_weighed ? weights : nullptr);
        map.step(options.live.step_ops);
    }
    built.error_m = std::sqrt(built.error_m / static_cast<double>(built.n_scans));
    return built;
}

Json figures_of(const Drive &drive, const Row &row, const Options &options,
                const std::vector<TestPoint> &points)
{
    HostMap map(live_config(read_params(options.params_path), options.live, middle_of(drive.scans)),
                options.live.late_m);
    const Built built = build(map, drive, row, options);
    const std::vector<gpom_answer_t> answers = map.query(places_of(points));
    std::vector<Prediction> predictions;
    for (std::size_t i = 0; i < points.size(); ++i) {
        predictions.push_back({static_cast<double>(answers[i].probability), points[i].occupied});
    }
    const Metrics metrics = measure(std::move(predictions));
    return {{"key", row.key},
            {"label", row.label},
            {"nll", metrics.nll},
            {"auc", metrics.auc},
            {"ece", metrics.calibration_error},
            {"scans", built.n_scans},
            {"place_error_m", built.error_m}};
}

void report(const Options &options)
{
    const std::string absurd = street_config_error(options.street);
    if (!absurd.empty()) {
        throw std::runtime_error(absurd);
    }
    if (options.speed_swing_mps >= options.speed_mean_mps) {
        throw std::runtime_error("--speed-swing must be less than --speed");
    }
    const StreetWorld world = make_street_world(options.street);
    const Drive drive = drive_of(options, world);
    if (drive.scans.size() > PoseRing::kPoses ||
        drive.scans.back().t_s * options.odometry_hz > static_cast<double>(Odometry::kMotions)) {
        throw std::runtime_error("the drive is too long: fewer --scans, or a smaller --step");
    }
    const std::vector<GridBeam> beams = beams_of(evenly_taken(drive.scans, 50), 0.0);
    std::vector<TestPoint> points;
    const std::vector<TestPoint> all = street_points(
        street_truth(world, options.street.truth_cell_m), options.n_points, options.street.seed);
    std::copy_if(all.begin(), all.end(), std::back_inserter(points),
                 [&](const TestPoint &point) { return is_near(point.at, beams, kNearBeam); });
    Json json = {{"seed", options.street.seed}, {"points", points.size()}};
    for (const Row &row : kRows) {
        json["rows"].push_back(figures_of(drive, row, options, points));
    }
    const std::string text = json.dump(1) + "\n";
    if (options.json_path.empty()) {
        std::fputs(text.c_str(), stdout);
    } else {
        replace_files({{options.json_path, text}});
    }
}

void declare_options(CLI::App &app, Options &options)
{
    options.street.n_scans = 400;
    options.street.n_beams = 91;
    options.street.step_m = 0.5;
    app.add_option("--params", options.params_path, "Hyperparameters, TOML")
        ->required()
        ->type_name("FILE");
    app.add_option("--json", options.json_path, "File for the figures; default: stdout")
        ->type_name("FILE");
    app.add_option("--seed", options.street.seed, "Seed of street, drive and errors");
    app.add_option("--scans", options.street.n_scans, "Number of scans")
        ->check(CLI::Range(10, 1000));
    app.add_option("--beams", options.street.n_beams, "Beams in each scan");
    app.add_option("--step", options.street.step_m, "Way driven from scan to scan [m]");
    app.add_option("--range-max", options.street.range_max_m, "Maximum range [m]");
    app.add_option("--points", options.n_points, "Test points")->check(CLI::Range(100, 1000000));
    app.add_option("--period", options.pose_period_s, "Time between poses [s]");
    app.add_option("--speed", options.speed_mean_mps, "Mean speed [m/s]");
    app.add_option("--speed-swing", options.speed_swing_mps,
                   "Swing of the speed around the mean [m/s]");
    gpomd::OdometryConfig &odometry = options.odometry;
    app.add_option("--speed-scale-sd", odometry.speed_scale_sd, "Constant error of the speed [1]");
    app.add_option("--yaw-rate-bias-sd", odometry.yaw_rate_bias_sd,
                   "Constant error of the yaw rate [rad/s]");
    app.add_option("--speed-noise", odometry.speed_noise, "White error of the speed [m / sqrt(s)]");
    app.add_option("--yaw-rate-noise", odometry.yaw_rate_noise,
                   "White error of the yaw rate [rad / sqrt(s)]");
    for (CLI::Option *option : app.get_options()) {
        if (option->get_name() != "--help" && option->get_name() != "--params") {
            option->capture_default_str();
        }
    }
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Drive a street with few poses, with or without odometry between them, and\n"
                 "compare the maps with the truth. Writes figures as JSON.",
                 "gpom-odometry");
    Options options;
    declare_options(app, options);
    return run_tool(app, argc, argv, [&options] { report(options); });
}
