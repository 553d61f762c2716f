#include "tools/sim/street.hpp"

#include "ports/host/text_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpom_tools
{
namespace
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kBucketM = 8.0;
constexpr double kSpeedMps = 4.0; ///< Speed of the robot. It gives the times of the scans.

/// Allowed range of a setting.
struct Limit {
    const char *name;
    double value, low, high;
};

std::string decimal(double value)
{
    std::string text;
    append_number(text, value);
    return text;
}

double rounded(double value, double per_unit) { return std::round(value * per_unit) / per_unit; }

int bucket_coordinate(double value_m, int n)
{
    return std::clamp(static_cast<int>(std::floor(value_m / kBucketM)), 0, n - 1);
}

/// Narrow [t0, t1] to the part where origin + t direction lies within [low, high].
void clip_to_slab(double low, double high, double origin, double direction, double t[2])
{
    if (std::fabs(direction) < 1e-12) {
        if (origin < low || origin > high) {
            t[0] = kNone;
        }
        return;
    }
    const double ta = (low - origin) / direction, tb = (high - origin) / direction;
    t[0] = std::max(t[0], std::min(ta, tb));
    t[1] = std::min(t[1], std::max(ta, tb));
}

double noisy_range_m(double range_m, double range_noise_m, double range_max_m, double gaussian)
{
    const double measured_m = range_m + range_noise_m * gaussian;
    const double millimetres_m = std::max(0.001, rounded(measured_m, 1e3));
    return millimetres_m < range_max_m ? millimetres_m : kNone;
}

Scan empty_scan(const StreetPose &pose, const StreetConfig &config)
{
    const double fov_rad = config.fov_deg * kPi / 180.0;
    Scan scan;
    scan.x_m = rounded(pose.x_m, 1e3);
    scan.y_m = rounded(pose.y_m, 1e3);
    scan.theta_rad = rounded(std::remainder(pose.theta_rad, 2.0 * kPi), 1e6);
    scan.range_max_m = config.range_max_m;
    scan.angle_min_rad = config.n_beams > 1 ? -0.5 * fov_rad : 0.0;
    // A full circle's last beam must not repeat its first.
    const int n_gaps = config.fov_deg >= 360.0 ? config.n_beams : config.n_beams - 1;
    scan.angle_step_rad = n_gaps > 0 ? fov_rad / n_gaps : 0.0;
    return scan;
}

/// The settings that differ from the plain recipe.
std::string change_comment(const StreetConfig &config)
{
    std::string text;
    if (config.cars_arrive_at > 0) {
        text += " cars_arrive_at=" + std::to_string(config.cars_arrive_at);
    }
    if (config.cars_leave_at >= 0) {
        text += " cars_leave_at=" + std::to_string(config.cars_leave_at);
    }
    return text + (config.there_and_back ? " there_and_back=1" : "");
}

} // namespace

std::string street_config_error(const StreetConfig &config)
{
    const Limit limits[] = {
        {"width", config.width_m, 40.0, 5000.0},
        {"height", config.height_m, 40.0, 5000.0},
        {"scans", static_cast<double>(config.n_scans), 1.0, 1e6},
        {"beams", static_cast<double>(config.n_beams), 1.0, kScanBeamsMax},
        {"fov-deg", config.fov_deg, 1.0, 360.0},
        {"range-max", config.range_max_m, 0.1, 1000.0},
        {"range-noise", config.range_noise_m, 0.0, 10.0},
        {"step", config.step_m, 0.01, 1000.0},
        {"truth-cell", config.truth_cell_m, 0.01, 10.0},
        {"cars-arrive-at", static_cast<double>(config.cars_arrive_at), 0.0, 1e6},
        {"cars-leave-at", static_cast<double>(config.cars_leave_at), -1.0, 1e6},
    };
    for (const Limit &limit : limits) {
        if (!(limit.value >= limit.low && limit.value <= limit.high)) { // refuses NaN, too
            return std::string(limit.name) + " must be " + decimal(limit.low) + " to " +
                   decimal(limit.high) + ", is " + decimal(limit.value);
        }
    }
    if (static_cast<double>(config.n_scans) * config.n_beams > 1e8) {
        return "scans times beams is over 100 million";
    }
    const double cell_m2 = config.truth_cell_m * config.truth_cell_m;
    if (config.width_m * config.height_m / cell_m2 > double{kTruthCellsMax}) {
        return "truth raster would have over 500 million cells; take a larger truth-cell";
    }
    return "";
}

std::string street_comment(const StreetConfig &config)
{
    return "gpom-street recipe=" + std::to_string(kStreetRecipe) +
           " seed=" + std::to_string(config.seed) + " width_m=" + decimal(config.width_m) +
           " height_m=" + decimal(config.height_m) + " scans=" + std::to_string(config.n_scans) +
           " beams=" + std::to_string(config.n_beams) + " fov_deg=" + decimal(config.fov_deg) +
           " range_max_m=" + decimal(config.range_max_m) +
           " range_noise_m=" + decimal(config.range_noise_m) + " step_m=" + decimal(config.step_m) +
           " truth_cell_m=" + decimal(config.truth_cell_m) + change_comment(config);
}

bool cars_are_parked(const StreetConfig &config, int i_scan)
{
    return i_scan >= config.cars_arrive_at &&
           (config.cars_leave_at < 0 || i_scan < config.cars_leave_at);
}

StreetRandom::StreetRandom(std::uint64_t seed, Stream stream)
    : bits_(seed * 4 + static_cast<std::uint64_t>(stream))
{
}

double StreetRandom::uniform(double low, double high)
{
    constexpr double kTo53Bits = 1.0 / 9007199254740992.0; // 2^-53
    return low + (high - low) * (static_cast<double>(bits_() >> 11) * kTo53Bits);
}

double StreetRandom::gaussian()
{
    // Box & Muller (1958); the second number of the pair is not used.
    const double u1 = 1.0 - uniform(0.0, 1.0);
    const double u2 = uniform(0.0, 1.0);
    return std::sqrt(-2.0 * std::log(u1)) * std::cos(2.0 * kPi * u2);
}

ObstacleGrid::ObstacleGrid(const StreetWorld &world)
    : n_{static_cast<int>(world.width_m / kBucketM) + 1,
         static_cast<int>(world.height_m / kBucketM) + 1}
{
    // Counting sort: the first pass counts each bucket's rectangles, the second places them.
    bucket_start_.assign(static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) + 1, 0);
    const auto for_buckets = [&](const Rect &rect, const auto &act) {
        const int ix1 = bucket_coordinate(rect.x1_m, n_[0]);
        for (int iy = bucket_coordinate(rect.y0_m, n_[1]);
             iy <= bucket_coordinate(rect.y1_m, n_[1]); ++iy) {
            for (int ix = bucket_coordinate(rect.x0_m, n_[0]); ix <= ix1; ++ix) {
                act(static_cast<std::size_t>(iy * n_[0] + ix));
            }
        }
    };
    for (const Rect &rect : world.obstacles) {
        for_buckets(rect, [&](std::size_t bucket) { ++bucket_start_[bucket]; });
    }
    for (std::size_t i = 1; i < bucket_start_.size(); ++i) {
        bucket_start_[i] += bucket_start_[i - 1];
    }
    rects_.resize(bucket_start_.back());
    for (const Rect &rect : world.obstacles) {
        for_buckets(rect, [&](std::size_t bucket) { rects_[--bucket_start_[bucket]] = rect; });
    }
}

std::size_t ObstacleGrid::bucket_at(double x_m, double y_m) const
{
    return static_cast<std::size_t>(bucket_coordinate(y_m, n_[1]) * n_[0] +
                                    bucket_coordinate(x_m, n_[0]));
}

bool ObstacleGrid::contains(double x_m, double y_m) const
{
    const std::size_t bucket = bucket_at(x_m, y_m);
    for (std::size_t i = bucket_start_[bucket]; i < bucket_start_[bucket + 1]; ++i) {
        const Rect &rect = rects_[i];
        if (x_m >= rect.x0_m && x_m < rect.x1_m && y_m >= rect.y0_m && y_m < rect.y1_m) {
            return true;
        }
    }
    return false;
}

double ObstacleGrid::bucket_hit_m(std::size_t bucket, const double origin[2],
                                  const double direction[2]) const
{
    double nearest_m = kNone;
    for (std::size_t i = bucket_start_[bucket]; i < bucket_start_[bucket + 1]; ++i) {
        const Rect &rect = rects_[i];
        double t[2] = {0.0, kNone};
        clip_to_slab(rect.x0_m, rect.x1_m, origin[0], direction[0], t);
        clip_to_slab(rect.y0_m, rect.y1_m, origin[1], direction[1], t);
        if (t[0] <= t[1]) {
            nearest_m = std::min(nearest_m, t[0]);
        }
    }
    return nearest_m;
}

double ObstacleGrid::first_hit_m(const StreetPose &beam, double range_max_m) const
{
    // Amanatides & Woo (1987): bucket by bucket along the beam.
    const double origin[2] = {beam.x_m, beam.y_m};
    const double direction[2] = {std::cos(beam.theta_rad), std::sin(beam.theta_rad)};
    int i[2], step[2];
    double t_next[2], t_step[2];
    for (int axis = 0; axis < 2; ++axis) {
        i[axis] = bucket_coordinate(origin[axis], n_[axis]);
        step[axis] = direction[axis] > 0.0 ? 1 : -1;
        const bool parallel = std::fabs(direction[axis]) < 1e-12;
        const double wall_m = kBucketM * (i[axis] + (step[axis] > 0 ? 1 : 0));
        t_step[axis] = parallel ? kNone : kBucketM / std::fabs(direction[axis]);
        t_next[axis] = parallel ? kNone : (wall_m - origin[axis]) / direction[axis];
    }
    double hit_m = kNone, way_m = 0.0;
    while (way_m < range_max_m && i[0] >= 0 && i[0] < n_[0] && i[1] >= 0 && i[1] < n_[1]) {
        const auto bucket = static_cast<std::size_t>(i[1] * n_[0] + i[0]);
        hit_m = std::min(hit_m, bucket_hit_m(bucket, origin, direction));
        const int axis = t_next[0] < t_next[1] ? 0 : 1;
        way_m = t_next[axis];
        if (hit_m <= way_m) {
            break; // later buckets cannot hold a nearer hit
        }
        t_next[axis] += t_step[axis];
        i[axis] += step[axis];
    }
    return hit_m < range_max_m ? hit_m : kNone;
}

StreetLaser::StreetLaser(const StreetConfig &config)
    : config_(config), random_(config.seed, StreetRandom::Stream::noise)
{
}

Scan StreetLaser::scan(const ObstacleGrid &obstacles, const StreetPose &pose)
{
    Scan scan = empty_scan(pose, config_);
    scan.t_s = rounded(static_cast<double>(n_scans_++) * config_.step_m / kSpeedMps, 1e6);
    for (int i = 0; i < config_.n_beams; ++i) {
        const double bearing_rad = scan.theta_rad + scan.angle_min_rad + i * scan.angle_step_rad;
        const double range_m =
            obstacles.first_hit_m({scan.x_m, scan.y_m, bearing_rad}, config_.range_max_m);
        scan.ranges_m.push_back(static_cast<float>(noisy_range_m(
            range_m, config_.range_noise_m, config_.range_max_m, random_.gaussian())));
    }
    return scan;
}

std::vector<Scan> simulate_scans(const StreetWorld &world, const StreetConfig &config,
                                 const ProgressCall &progress)
{
    const ObstacleGrid parked(world), empty(without_vehicles(world));
    StreetLaser laser(config);
    std::vector<Scan> scans;
    for (const StreetPose &pose : drive_streets(world, config)) {
        const bool cars = cars_are_parked(config, static_cast<int>(scans.size()));
        scans.push_back(laser.scan(cars ? parked : empty, pose));
        if (progress) {
            progress(scans.size(), static_cast<std::size_t>(config.n_scans));
        }
    }
    return scans;
}

Truth street_truth(const StreetWorld &world, double cell_m)
{
    Truth truth;
    truth.cell_m = cell_m;
    truth.nx = static_cast<int>(std::ceil(world.width_m / cell_m - 1e-9));
    truth.ny = static_cast<int>(std::ceil(world.height_m / cell_m - 1e-9));
    truth.occupied.assign(truth.index(0, truth.ny), 0);
    // Centres are at (i + 1/2) cell: the first one at or after an edge, for half-open rectangles.
    const auto first_cell = [&](double edge_m, int n) {
        return std::clamp(static_cast<int>(std::ceil(edge_m / cell_m - 0.5)), 0, n);
    };
    for (const Rect &rect : world.obstacles) {
        const int ix0 = first_cell(rect.x0_m, truth.nx), ix1 = first_cell(rect.x1_m, truth.nx);
        for (int iy = first_cell(rect.y0_m, truth.ny); iy < first_cell(rect.y1_m, truth.ny); ++iy) {
            for (int ix = ix0; ix < ix1; ++ix) {
                truth.occupied[truth.index(ix, iy)] = 1;
            }
        }
    }
    return truth;
}

} // namespace gpom_tools
