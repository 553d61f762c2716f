/// \file live.hpp
/// The map's origin follows the robot.
#pragma once

#include "src/se2.hpp"

struct gpom_map;

namespace gpom
{

/// How far the map's origin has to move to follow the robot: to it, by whole metres, if it is
/// farther away than rebase_m; else zero.
Eigen::Vector2d origin_step(const gpom_map &map, double x_m, double y_m);

/// Move the origin. Beams out of reach from there are forgotten. O(1) if the step is zero, else
/// O(beam_max + cells).
void move_origin(gpom_map &map, const Eigen::Vector2d &step_m);

} // namespace gpom
