/// \file room_fixture.hpp
/// Rooms of straight walls, scans of them by brute force, and alignments.
#pragma once

#include "gpom/align.h"
#include "tests/common/reference.hpp"

#include <Eigen/Dense>

namespace reference
{

/// A straight wall between two points.
struct Wall {
    Xy from, to;
};
using Room = std::vector<Wall>;

/// A polygon of walls.
inline Room polygon(const std::vector<Xy> &corners)
{
    Room room;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        room.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
    return room;
}

/// An L-shaped room with a pillar: every pose looks different.
inline Room l_room()
{
    Room room = polygon({{0, 0}, {9, 0}, {9, 4}, {5, 4}, {5, 7}, {0, 7}});
    for (const Wall &wall : polygon({{2, 4.4}, {2.6, 4.4}, {2.6, 5}, {2, 5}})) {
        room.push_back(wall);
    }
    return room;
}

/// Distance from a point to the first wall in a direction, each wall looked at. kInf: none.
inline double ray_m(const Room &room, Xy at, double angle_rad)
{
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    double nearest_m = INFINITY;
    for (const Wall &wall : room) {
        const double ex = wall.to.x - wall.from.x, ey = wall.to.y - wall.from.y;
        const double det = ex * s - ey * c;
        const double px = wall.from.x - at.x, py = wall.from.y - at.y;
        const double range_m = (ex * py - ey * px) / det, share = (c * py - s * px) / det;
        if (range_m > 0.0 && share >= 0.0 && share <= 1.0) {
            nearest_m = std::min(nearest_m, range_m);
        }
    }
    return nearest_m;
}

/// A scan of a full turn from a pose, with Gaussian noise.
inline TestScan room_scan(const Room &room, const gpom_pose_t &pose, int n, Random &random,
                          double noise_m)
{
    TestScan scan;
    scan.pose = pose;
    scan.angle_min_rad = -M_PI;
    scan.angle_step_rad = 2.0 * M_PI / n;
    for (int i = 0; i < n; ++i) {
        const double angle_rad = pose.yaw_rad - M_PI + i * scan.angle_step_rad;
        const double gauss = random.uniform(-1, 1) + random.uniform(-1, 1) + random.uniform(-1, 1);
        const double range_m = ray_m(room, {pose.x_m, pose.y_m}, angle_rad) + noise_m * gauss;
        scan.ranges_m.push_back(static_cast<float>(range_m));
    }
    return scan;
}

/// A live map of a room from scans at several poses.
inline void map_room(TestMap &map, const Room &room, const std::vector<gpom_pose_t> &poses,
                     Random &random, double noise_m = 0.01)
{
    for (std::size_t i = 0; i < poses.size(); ++i) {
        TestScan scan = room_scan(room, poses[i], 360, random, noise_m);
        scan.stamp_us = static_cast<std::int64_t>(i) * 100000;
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    }
    REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
}

inline gpom_config_t room_config()
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 4096);
    config.keep_m = 0.05f;
    config.clear_scans = 3;
    return config;
}

/// The poses from which the L-shaped room is mapped.
inline std::vector<gpom_pose_t> l_poses()
{
    return {
        {2, 2, 0.3, nullptr}, {4, 2.5, 1, nullptr}, {7, 2, -2, nullptr}, {3.5, 5.5, 2, nullptr}};
}

/// Covariance of independent errors.
struct PriorCov {
    float by_rows[9];

    PriorCov(double place_sd_m, double yaw_sd_rad)
        : by_rows{static_cast<float>(place_sd_m * place_sd_m), 0, 0, 0,
                  static_cast<float>(place_sd_m * place_sd_m), 0, 0, 0,
                  static_cast<float>(yaw_sd_rad * yaw_sd_rad)}
    {
    }
};

inline gpom_align_config_t align_config()
{
    gpom_align_config_t config;
    gpom_align_config_init(&config);
    return config;
}

/// Align a scan, with scratch of exactly the documented size.
struct Alignment {
    gpom_status_t status;
    gpom_alignment_t found = {};

    Alignment(const gpom_map_t *map, const TestScan &scan, const gpom_pose_t &predicted,
              const gpom_align_config_t &config = align_config())
    {
        const gpom_align_task_t task = {&scan.sensor, predicted, &config};
        std::vector<unsigned char> memory(GPOM_ALIGN_BYTES(config.n_returns_max));
        const gpom_scratch_t scratch = {memory.data(), memory.size()};
        const gpom_scan_t raw = scan.scan();
        status = gpom_scan_align(map, &raw, &task, &found, &scratch);
    }

    Eigen::Vector3d error(const gpom_pose_t &right) const
    {
        return {found.x_m - right.x_m, found.y_m - right.y_m,
                std::remainder(found.yaw_rad - right.yaw_rad, 2.0 * M_PI)};
    }

    Eigen::Matrix3d cov() const
    {
        return Eigen::Map<const Eigen::Matrix3f>(found.cov).cast<double>();
    }
};

} // namespace reference
