// A simulated corridor with doors to rooms, and a robot that drives past and through them. The map
// frame's origin is the area's lower left corner, the corridor runs along x, the rooms are above.
#ifndef GPOM_TOOLS_SIM_CORRIDOR_HPP
#define GPOM_TOOLS_SIM_CORRIDOR_HPP

#include "gpom/query.h"
#include "tools/sim/street.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gpom_tools
{

/// An opening in the wall between corridor and rooms.
struct Door {
    double width_m;      ///< Clear, between the door frames.
    gpom_point_t centre; ///< Of the opening, in the middle of the wall.
};

struct Corridor {
    StreetWorld world; ///< Walls and door frames as obstacles; no streets, no vehicles.
    Rect wall;         ///< The wall with the doors, its openings included.
    std::vector<Door> doors;
    /// Along the corridor past the doors, then back, through each door into its room and out again;
    /// 0.1 m from scan to scan, and 10 degrees where the robot turns on the spot.
    std::vector<StreetPose> poses;
    std::size_t n_past = 0; ///< So many of them until the corridor's end.
};

/// Doors of 0.7, 0.8 and 0.9 m. The seed moves all of it by less than 0.1 m along both axes, so
/// that the walls lie differently in the cells of a grid; all lengths are whole millimetres.
Corridor make_corridor(std::uint64_t seed);

struct CorridorLaser {
    std::uint64_t seed = 1; ///< Of the noise.
    int n_beams = 180;      ///< Over 180 degrees about the heading; at least 2.
    double noise_m = 0.01;  ///< Standard deviation of the Gaussian range error.
};

/// A scan at each pose, one each 0.2 s. Ranges are rounded to the millimetre. So are the poses,
/// before the beams are cast: the scans' poses are exact.
std::vector<Scan> scan_corridor(const Corridor &corridor, const CorridorLaser &laser);

} // namespace gpom_tools

#endif
