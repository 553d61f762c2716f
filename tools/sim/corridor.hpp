// A simulated corridor with doors to rooms, and a robot that drives past and through the doors. The
// map frame's origin is the area's lower left corner. The corridor runs along x, with the rooms
// above it.
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
    double width_m;      ///< Clear width between the door frames.
    gpom_point_t centre; ///< Centre of the opening, in the middle of the wall.
};

struct Corridor {
    StreetWorld world; ///< Walls and door frames are the obstacles. There are no streets and no
                       ///< vehicles.
    Rect wall;         ///< The wall with the doors, including its openings.
    std::vector<Door> doors;
    /// The way along the corridor past the doors, then back, into each room through its door and
    /// out again. Scans are 0.1 m apart, and 10 degrees apart where the robot turns on the spot.
    std::vector<StreetPose> poses;
    std::size_t n_past = 0; ///< Number of poses until the corridor's end.
};

/// A corridor with doors of 0.7, 0.8 and 0.9 m. The seed moves everything by less than 0.1 m along
/// both axes, so that the walls lie differently in the cells of a grid. All lengths are whole
/// millimetres.
Corridor make_corridor(std::uint64_t seed);

struct CorridorLaser {
    std::uint64_t seed = 1; ///< Seed of the noise.
    int n_beams = 180;      ///< Over 180 degrees around the heading. At least 2.
    double noise_m = 0.01;  ///< Standard deviation of the Gaussian range error.
};

/// One scan at each pose, every 0.2 s. Ranges are rounded to the millimetre. Poses are rounded
/// before the beams are cast, so the poses of the scans are exact.
std::vector<Scan> scan_corridor(const Corridor &corridor, const CorridorLaser &laser);

} // namespace gpom_tools

#endif
