#include "gpom/scan.h"

#include "src/live.hpp"
#include "src/map.hpp"
#include "src/se2.hpp"

#include <float.h>

using gpom::Beam;

namespace
{

constexpr double kTwoPi = 6.283185307179586;
constexpr double kAngleMax_rad = 1e6;

/// Greatest variance of a pose [m2, rad2]: what it is carried to stays finite.
constexpr float kVarianceMax = 1e12f;

/// The end of a beam is known well enough to speak against others if its standard deviation is at
/// most this share of keep_m.
constexpr float kSureShare = 0.25f;

/// 2^32 divided by the golden ratio: the quarter of the circle into which its nth multiple falls
/// is the two bits that stand for the nth time. They always differ between times that are 1 or 4
/// apart, almost always (94 %) 2 apart, else by chance, so that no rhythm of scans passes for one
/// time for ever.
constexpr uint32_t kGoldenRatio = 2654435769u;

// Written so that a NaN fails.
bool is_within(double x, double limit) { return x >= -limit && x <= limit; }

bool are_masks(const gpom_mask_t *masks, uint16_t n_masks)
{
    if (n_masks > 0 && masks == nullptr) {
        return false;
    }
    for (uint16_t i = 0; i < n_masks; ++i) {
        if (!is_within(static_cast<double>(masks[i].from_rad), kAngleMax_rad) ||
            !is_within(static_cast<double>(masks[i].to_rad), kAngleMax_rad)) {
            return false;
        }
    }
    return true;
}

bool is_sensor(const gpom_sensor_t *sensor)
{
    if (sensor == nullptr || !are_masks(sensor->masks, sensor->n_masks)) {
        return false;
    }
    const bool mount_ok = is_within(sensor->x_m, GPOM_REACH_M) &&
                          is_within(sensor->y_m, GPOM_REACH_M) &&
                          is_within(sensor->yaw_rad, kAngleMax_rad);
    const bool ranges_ok = sensor->range_min_m >= 0.0f &&
                           sensor->range_max_m > sensor->range_min_m &&
                           sensor->range_max_m <= static_cast<float>(GPOM_REACH_M) &&
                           sensor->range_var_m2 >= 0.0f && sensor->range_var_m2 <= FLT_MAX;
    return mount_ok && ranges_ok;
}

bool is_scan(const gpom_scan_t *scan)
{
    return scan != nullptr && scan->n_ranges <= GPOM_RANGES_MAX &&
           (scan->n_ranges == 0 || scan->ranges_m != nullptr) &&
           is_within(scan->angle_min_rad, kAngleMax_rad) &&
           is_within(scan->angle_step_rad, kAngleMax_rad / GPOM_RANGES_MAX);
}

/// Correlation of elements i and j; 0 where a variance is 0.
float correlation(const float *cov, int i, int j)
{
    const float scale = gpom::lane::sqrt(cov[4 * i]) * gpom::lane::sqrt(cov[4 * j]);
    return scale > 0.0f ? cov[3 * i + j] / scale : 0.0f;
}

/// Positive semidefinite: the leading minors of the correlation matrix, within rounding.
bool is_covariance(const float *cov)
{
    constexpr float kTolerance = 1e-3f;
    for (int i = 0; i < 3; ++i) {
        if (!(cov[4 * i] >= 0.0f && cov[4 * i] <= kVarianceMax)) {
            return false;
        }
        for (int j = 0; j < i; ++j) {
            const float bound =
                gpom::lane::sqrt(cov[4 * i]) * gpom::lane::sqrt(cov[4 * j]) * (1.0f + kTolerance);
            const float difference = gpom::lane::abs(cov[3 * i + j] - cov[3 * j + i]);
            if (!(gpom::lane::abs(cov[3 * i + j]) <= bound && difference <= kTolerance * bound)) {
                return false;
            }
        }
    }
    const float a = correlation(cov, 1, 0);
    const float b = correlation(cov, 2, 0);
    const float c = correlation(cov, 2, 1);
    return 1.0f + 2.0f * a * b * c - a * a - b * b - c * c >= -kTolerance;
}

bool is_pose(const gpom_pose_t &pose)
{
    return is_within(pose.x_m, DBL_MAX) && is_within(pose.y_m, DBL_MAX) &&
           is_within(pose.yaw_rad, kAngleMax_rad) &&
           (pose.cov == nullptr || is_covariance(pose.cov));
}

/// The angle in [0, 2 pi).
double wrap(double angle_rad)
{
    const double turns = static_cast<double>(static_cast<int32_t>(angle_rad / kTwoPi));
    const double rest = angle_rad - turns * kTwoPi;
    return rest < 0.0 ? rest + kTwoPi : rest;
}

bool is_masked(const gpom_sensor_t &sensor, double bearing_rad)
{
    for (uint16_t i = 0; i < sensor.n_masks; ++i) {
        const double from = static_cast<double>(sensor.masks[i].from_rad);
        const double to = static_cast<double>(sensor.masks[i].to_rad);
        const bool is_full_turn = to - from >= kTwoPi - 1e-6;
        if (is_full_turn || wrap(bearing_rad - from) <= wrap(to - from)) {
            return true;
        }
    }
    return false;
}

/// Count a reading that cannot be used. False: it can.
bool count_unusable(gpom_stats_t &stats, const gpom_sensor_t &sensor, float range_m,
                    double bearing_rad)
{
    uint64_t *cause = nullptr;
    if (range_m != range_m) {
        cause = &stats.beams_nan;
    } else if (range_m <= 0.0f) {
        cause = &stats.beams_not_positive;
    } else if (range_m < sensor.range_min_m) {
        cause = &stats.beams_too_near;
    } else if (is_masked(sensor, bearing_rad)) {
        cause = &stats.beams_masked;
    }
    if (cause == nullptr) {
        return false;
    }
    ++*cause;
    return true;
}

/// What all beams of one scan share.
struct ScanContext {
    const gpom_sensor_t &sensor;
    const float *pose_cov; ///< 3 x 3 by rows, or NULL.
    gpom::Pose T_map_sensor;
    Eigen::Vector2f sensor_m; ///< Sensor position relative to the map's origin.
    Eigen::Vector2f lever_m;  ///< From the robot to the sensor, map axes.
    uint16_t scan;            ///< Number of the scan, modulo 2^16.
};

/// Variance of the place of a beam's end, summed over x and y [m2].
float end_variance(const ScanContext &context, const Beam &beam)
{
    float var_m2 = context.sensor.range_var_m2;
    if (context.pose_cov != nullptr) {
        using RowMajor = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
        const Eigen::Matrix3f cov = Eigen::Map<const RowMajor>(context.pose_cov);
        const Eigen::Vector2f direction(beam.dir_x, beam.dir_y);
        var_m2 += gpom::position_variance(cov, context.lever_m + beam.range_m * direction);
    }
    return gpom::lane::max(var_m2, 0.0f); // rounding may take it below 0
}

/// How much position uncertainty at the end of a beam raises its noise (scan.h). With rho the prior
/// correlation between f at the true place and at the believed one, f(true) = rho f(believed) + a
/// part independent of it; dividing by rho gives noise (sn2 + (1 - rho^2) k) / rho^2, that is
/// sn2 + w (sn2 + k) with w = 1 / rho^2 - 1.
float excess_of(const gpom_map &map, float var_m2)
{
    if (var_m2 == 0.0f) {
        return 0.0f;
    }
    const gpom_params_t &params = map.config.params;
    const float sd_m = gpom::lane::sqrt(gpom::lane::min(var_m2, FLT_MAX));
    const float k = gpom::covariance_on_axis(params, 0.0f, sd_m);
    const float k_product =
        gpom::covariance_on_axis(params, 0.0f, 0.0f) * gpom::covariance_on_axis(params, sd_m, sd_m);
    const float rho2 = k * k / k_product;
    if (!(rho2 > 1.0f / gpom::kExcessMax)) {
        return gpom::kExcessMax;
    }
    return gpom::lane::max(1.0f / rho2 - 1.0f, 0.0f);
}

Beam beam_of(const gpom_map &map, const ScanContext &context, float range_m, double bearing_rad)
{
    const double turned_rad = context.sensor.upside_down != 0 ? -bearing_rad : bearing_rad;
    const gpom::Direction direction = gpom::direction_of(context.T_map_sensor.yaw_rad + turned_rad);
    Beam beam = {};
    beam.scan = context.scan;
    beam.stamp_ms = map.keeper.stamp_ms;
    beam.hit_time = map.keeper.time_mark & 3u;
    beam.x_m = context.sensor_m.x();
    beam.y_m = context.sensor_m.y();
    beam.dir_x = direction.x;
    beam.dir_y = direction.y;
    beam.returned = range_m < context.sensor.range_max_m ? 1u : 0u;
    beam.has_hit = beam.returned;
    beam.has_free = 1;
    beam.range_m = beam.returned != 0 ? range_m : context.sensor.range_max_m;
    return beam;
}

/// Hand all usable readings to those that choose what is kept.
void insert_beams(gpom_map &map, const gpom_scan_t &scan, const ScanContext &context)
{
    const float sure_m = kSureShare * map.config.keep_m;
    for (uint32_t i = 0; i < scan.n_ranges; ++i) {
        const double bearing_rad = scan.angle_min_rad + i * scan.angle_step_rad;
        if (count_unusable(map.stats, context.sensor, scan.ranges_m[i], bearing_rad)) {
            continue;
        }
        Beam beam = beam_of(map, context, scan.ranges_m[i], bearing_rad);
        const float var_m2 = end_variance(context, beam);
        beam.excess = excess_of(map, var_m2);
        gpom::consider(map, beam, var_m2 <= sure_m * sure_m);
    }
    gpom::settle(map);
}

/// Take note of when and where a scan was made.
void note_scan(gpom_map &map, int64_t stamp_us, const gpom::Point &robot)
{
    gpom::lowres_follow(map.lowres, robot, stamp_us);
    gpom::Keeper &keeper = map.keeper;
    if (map.stats.scans_inserted == 0 || stamp_us != keeper.stamp_us) {
        ++keeper.time_number;
        keeper.time_mark = static_cast<uint16_t>(keeper.time_number * kGoldenRatio >> 30);
    }
    keeper.stamp_us = stamp_us;
    keeper.stamp_ms = gpom::milliseconds_since(map.lowres.stamp0_us, stamp_us);
    keeper.robot = robot;
    keeper.scan_first_id = map.index.next_id;
    ++map.stats.scans_inserted;
}

} // namespace

void gpom_sensor_init(gpom_sensor_t *sensor)
{
    if (sensor == nullptr) {
        return;
    }
    *sensor = gpom_sensor_t{};
    sensor->range_max_m = 30.0f;
}

gpom_status_t gpom_scan_insert(gpom_map_t *map, const gpom_scan_t *scan,
                               const gpom_sensor_t *sensor, const gpom_pose_t *pose)
{
    if (!gpom::is_map(map) || pose == nullptr || !is_scan(scan) || !is_sensor(sensor)) {
        return GPOM_ERR_ARG;
    }
    if (!is_pose(*pose)) {
        ++map->stats.scans_bad_pose;
        return GPOM_ERR_ARG;
    }
    const gpom::Pose T_map_robot = {{pose->x_m, pose->y_m}, pose->yaw_rad};
    const gpom::Pose T_robot_sensor = {{sensor->x_m, sensor->y_m}, sensor->yaw_rad};
    const gpom::Pose T_map_sensor = T_map_robot * T_robot_sensor;
    gpom::follow_origin(*map, pose->x_m, pose->y_m);
    const Eigen::Vector2d origin_m(map->config.origin_x_m, map->config.origin_y_m);
    const Eigen::Vector2d sensor_m = T_map_sensor.position_m - origin_m;
    if (!(sensor_m.squaredNorm() <= GPOM_REACH_M * GPOM_REACH_M)) {
        ++map->stats.scans_out_of_reach;
        return GPOM_ERR_REACH;
    }
    const Eigen::Vector2f lever_m =
        (T_map_sensor.position_m - T_map_robot.position_m).cast<float>();
    const auto scan_number = static_cast<uint16_t>(map->stats.scans_inserted & 0xffffu);
    const Eigen::Vector2f robot_m = sensor_m.cast<float>() - lever_m;
    note_scan(*map, scan->stamp_us, {robot_m.x(), robot_m.y()});
    insert_beams(*map, *scan,
                 {*sensor, pose->cov, T_map_sensor, sensor_m.cast<float>(), lever_m, scan_number});
    return GPOM_OK;
}
