/// \file masked.hpp
/// Which bearings a sensor's masks cover. Internal linkage, as in scan_input.hpp.
#pragma once

#include "gpom/scan.h"

namespace gpom
{
namespace
{

constexpr double kTwoPi = 6.283185307179586;

/// The same angle in [0, 2 pi).
double wrap(double angle_rad)
{
    const double turns = static_cast<double>(static_cast<int32_t>(angle_rad / kTwoPi));
    const double rest = angle_rad - turns * kTwoPi;
    return rest < 0.0 ? rest + kTwoPi : rest;
}

/// True if the bearing is inside one of the sensor's masks.
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

} // namespace
} // namespace gpom
