/// \file sweep_fixture.hpp
/// A sweep with everything that belongs to it.
#pragma once

#include "tests/common/reference.hpp"

namespace reference
{

/// A sweep that holds its own arrays.
struct TestSweep {
    gpom_sensor_t sensor;
    gpom_pose_t pose = {0.0, 0.0, 0.0, nullptr};
    std::vector<float> ranges_m, bearings_rad;
    std::vector<gpom_pose_t> poses;
    std::int64_t stamp_us = 0;

    TestSweep() { gpom_sensor_init(&sensor); }

    /// A scan, as a sweep whose beams all have its pose.
    explicit TestSweep(const TestScan &scan)
        : sensor(scan.sensor), pose(scan.pose), ranges_m(scan.ranges_m),
          poses(scan.ranges_m.size(), scan.pose), stamp_us(scan.stamp_us)
    {
        for (std::size_t i = 0; i < ranges_m.size(); ++i) {
            bearings_rad.push_back(static_cast<float>(
                scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad));
        }
    }

    void add(float range_m, float bearing_rad, const gpom_pose_t &own)
    {
        ranges_m.push_back(range_m);
        bearings_rad.push_back(bearing_rad);
        poses.push_back(own);
    }

    gpom_status_t insert_into(gpom_map_t *map) const
    {
        const gpom_sweep_t raw = {stamp_us, ranges_m.data(), bearings_rad.data(), poses.data(),
                                  static_cast<std::uint32_t>(ranges_m.size())};
        return gpom_sweep_insert(map, &raw, &sensor, &pose);
    }
};

} // namespace reference
