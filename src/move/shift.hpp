/// \file shift.hpp
/// A rigid motion of a beam.
#pragma once

#include "gpom/scan.h"
#include "src/base/check.hpp"
#include "src/beams/beam.hpp"
#include "src/lane/elementary.hpp"

namespace gpom
{

/// Greatest angle of a pose [rad] (scan.h).
constexpr double kYawMax_rad = 1e6;

/// Points turn about `from`, which goes to `to`. Both are relative to origins of maps, which may
/// differ.
struct Shift {
    double from_x_m, from_y_m;
    double to_x_m, to_y_m;
    Direction turn; ///< (cos, sin) of the angle.
};

inline bool is_place_and_yaw(const gpom_pose_t &pose)
{
    return is_within(pose.x_m, GPOM_PLACE_MAX_M) && is_within(pose.y_m, GPOM_PLACE_MAX_M) &&
           is_within(pose.yaw_rad, kYawMax_rad);
}

/// The angle, less whole turns, between -pi and pi.
inline double short_way(double angle_rad)
{
    constexpr double kTurn_rad = 6.2831853071795865;
    const double turns = angle_rad / kTurn_rad;
    return angle_rad - kTurn_rad * static_cast<double>(
                                       static_cast<int64_t>(turns + (turns < 0.0 ? -0.5 : 0.5)));
}

inline Direction turned(const Direction &turn, float x, float y)
{
    return {turn.x * x - turn.y * y, turn.y * x + turn.x * y};
}

inline Point moved(const Point &at, const Shift &shift)
{
    const Direction lever =
        turned(shift.turn, static_cast<float>(static_cast<double>(at.x_m) - shift.from_x_m),
               static_cast<float>(static_cast<double>(at.y_m) - shift.from_y_m));
    return {static_cast<float>(shift.to_x_m + static_cast<double>(lever.x)),
            static_cast<float>(shift.to_y_m + static_cast<double>(lever.y))};
}

inline void move(Beam &beam, const Shift &shift)
{
    const Point start = moved({beam.x_m, beam.y_m}, shift);
    beam.x_m = start.x_m;
    beam.y_m = start.y_m;
    if (shift.turn.y == 0.0f && shift.turn.x > 0.0f) { // the direction keeps its bits
        return;
    }
    const Direction dir = turned(shift.turn, beam.dir_x, beam.dir_y);
    // One step of Newton's method keeps the length at 1, however often a beam moves.
    const float scale = 1.5f - 0.5f * (dir.x * dir.x + dir.y * dir.y);
    beam.dir_x = scale * dir.x;
    beam.dir_y = scale * dir.y;
}

inline bool is_in_reach(double x_m, double y_m)
{
    return x_m * x_m + y_m * y_m <= GPOM_REACH_M * GPOM_REACH_M;
}

} // namespace gpom
