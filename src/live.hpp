/// \file live.hpp
/// The map's origin follows the robot.
#pragma once

struct gpom_map;

namespace gpom
{

/// Move the origin to the robot, by whole metres, if it is farther away than rebase_m. Beams out of
/// reach from there are forgotten. O(1); O(beams kept) when it moves.
void follow_origin(gpom_map &map, double x_m, double y_m);

} // namespace gpom
