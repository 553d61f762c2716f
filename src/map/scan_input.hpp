/// \file scan_input.hpp
/// Checks of what comes with a scan: sensor, ranges, bearings, poses. They are those of
/// gpom_scan_insert() (scan.h).
///
/// The functions have internal linkage: each source file that includes this has its own. So the
/// compiler inlines them, and an image without alignment is as small as if there were none.
#pragma once

#include "src/base/check.hpp"
#include "src/map/map.hpp"
#include "src/map/se2.hpp"

#include "gpom/scan.h"

#include <float.h>

namespace gpom
{
namespace
{

constexpr double kAngleMax_rad = 1e6;

/// Greatest variance of a pose [m2, rad2]. Variances that are computed from it stay finite.
constexpr float kVarianceMax = 1e12f;

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

/// Correlation of elements i and j. It is 0 if one of their variances is 0.
float correlation(const float *cov, int i, int j)
{
    const float scale = lane::sqrt(cov[4 * i]) * lane::sqrt(cov[4 * j]);
    return scale > 0.0f ? cov[3 * i + j] / scale : 0.0f;
}

/// True for a positive semidefinite matrix. Checks the leading minors of the correlation matrix,
/// with a tolerance for rounding.
bool is_covariance(const float *cov)
{
    constexpr float kTolerance = 1e-3f;
    for (int i = 0; i < 3; ++i) {
        if (!(cov[4 * i] >= 0.0f && cov[4 * i] <= kVarianceMax)) {
            return false;
        }
        for (int j = 0; j < i; ++j) {
            const float bound =
                lane::sqrt(cov[4 * i]) * lane::sqrt(cov[4 * j]) * (1.0f + kTolerance);
            const float difference = lane::abs(cov[3 * i + j] - cov[3 * j + i]);
            if (!(lane::abs(cov[3 * i + j]) <= bound && difference <= kTolerance * bound)) {
                return false;
            }
        }
    }
    const float a = correlation(cov, 1, 0);
    const float b = correlation(cov, 2, 0);
    const float c = correlation(cov, 2, 1);
    return 1.0f + 2.0f * a * b * c - a * a - b * b - c * c >= -kTolerance;
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

bool is_pose(const gpom_pose_t &pose)
{
    return is_within(pose.x_m, GPOM_PLACE_MAX_M) && is_within(pose.y_m, GPOM_PLACE_MAX_M) &&
           is_within(pose.yaw_rad, kAngleMax_rad) &&
           (pose.cov == nullptr || is_covariance(pose.cov));
}

/// The poses of the beams are not checked.
bool is_sweep(const gpom_sweep_t *sweep)
{
    if (sweep == nullptr || sweep->n_ranges > GPOM_RANGES_MAX) {
        return false;
    }
    const bool has_arrays =
        sweep->ranges_m != nullptr && sweep->bearings_rad != nullptr && sweep->poses != nullptr;
    bool are_angles = true;
    for (uint32_t i = 0; has_arrays && i < sweep->n_ranges; ++i) {
        are_angles =
            are_angles && is_within(static_cast<double>(sweep->bearings_rad[i]), kAngleMax_rad);
    }
    return (has_arrays || sweep->n_ranges == 0) && are_angles;
}

/// The poses of the beams.
bool are_poses(const gpom_sweep_t &sweep)
{
    for (uint32_t i = 0; i < sweep.n_ranges; ++i) {
        if (!is_pose(sweep.poses[i])) {
            return false;
        }
    }
    return true;
}

/// Where the sensor is for a pose of the robot, in double.
struct SensorPlace {
    Pose T_map_sensor;
    Eigen::Vector2d from_origin_m; ///< Relative to the map's origin.
    Eigen::Vector2f lever_m;       ///< From the robot to the sensor, map axes.
};

SensorPlace place_of(const gpom_map &map, const gpom_sensor_t &sensor, const gpom_pose_t &pose)
{
    const Pose T_map_robot = {{pose.x_m, pose.y_m}, pose.yaw_rad};
    const Pose T_robot_sensor = {{sensor.x_m, sensor.y_m}, sensor.yaw_rad};
    const Pose T_map_sensor = T_map_robot * T_robot_sensor;
    const Eigen::Vector2d origin_m(map.config.origin_x_m, map.config.origin_y_m);
    return {T_map_sensor, T_map_sensor.position_m - origin_m,
            (T_map_sensor.position_m - T_map_robot.position_m).cast<float>()};
}

} // namespace
} // namespace gpom
