/// \file origin.hpp
/// The map's origin follows the robot, the span of its stamps the clock.
#pragma once

#include "src/map/se2.hpp"

struct gpom_map;

namespace gpom
{

/// How far the map's origin has to move to follow the robot: to it, by whole metres, if it is
/// farther away than rebase_m; else zero.
Eigen::Vector2d origin_step(const gpom_map &map, double x_m, double y_m);

/// Of scans in a row out of reach of an origin that follows the robot, each within reach of the one
/// before, the first that is believed: what is kept came of a wrong pose.
constexpr uint32_t kBelieved = 10;

/// Note a scan that is a step out of reach. True if it is the kBelieved-th.
bool note_out_of_reach(gpom_map &map, const Eigen::Vector2d &step_m);

/// Move the origin to a scan that is taken. Beams out of reach from there are forgotten. O(1) if
/// the step is zero, else O(beam_max + cells).
void move_origin(gpom_map &map, const Eigen::Vector2d &step_m);

/// Move the first stamp if the newest scan and the next, of stamp_us, both lie on the same side of
/// what is counted from there: the clock was set, or the map is old. One alone may be wrong. Then
/// O(beam_max + cells), else O(1).
void follow_clock(gpom_map &map, int64_t stamp_us);

} // namespace gpom
