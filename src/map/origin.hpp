/// \file origin.hpp
/// Moving the map's origin with the robot, and the span of its stamps with the clock.
#pragma once

#include "src/map/se2.hpp"

struct gpom_map;

namespace gpom
{

/// The step by which the map's origin has to move to follow the robot. If the robot is farther
/// from the origin than rebase_m, the step leads to the robot, rounded to whole metres towards
/// zero. Else the step is zero.
Eigen::Vector2d origin_step(const gpom_map &map, double x_m, double y_m);

/// If the origin follows the robot, a scan that is out of reach of the origin is refused, because
/// its pose may be wrong. But this many scans in a row may be out of reach of the origin, each
/// within reach of the scan before it. Then the last of them is believed, because the kept beams
/// came from a wrong pose.
constexpr uint32_t kBelieved = 10;

/// Note a scan that is out of reach. step_m is its origin_step(). True if it is to be believed.
bool note_out_of_reach(gpom_map &map, const Eigen::Vector2d &step_m);

/// Move the origin by a step before a scan is taken. Beams that are out of reach of the new origin
/// are forgotten.
/// Cost: O(1) if the step is zero, else O(beam_max + cells).
void move_origin(gpom_map &map, const Eigen::Vector2d &step_m);

/// Move stamp0_us if the newest scan and the next scan, of stamp_us, are both outside of the span
/// of stamps on the same side. Then the clock was set, or the map is old. One scan alone is not
/// enough, because its stamp may be wrong.
/// Cost: O(beam_max + cells) if stamp0_us moves, else O(1).
void follow_clock(gpom_map &map, int64_t stamp_us);

/// Let stamps of beams count from a time on, if it is before stamp0_us, by up to 2^31 ms.
/// INT64_MAX: no time.
void reach_back(gpom_map &map, int64_t stamp_us);

} // namespace gpom
