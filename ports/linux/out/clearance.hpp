// Computes how far from the robot the map is free, for each sector, from a copy of the
// low-resolution map.
#ifndef GPOM_LINUX_CLEARANCE_HPP
#define GPOM_LINUX_CLEARANCE_HPP

#include "gpom/gpom.h"
#include "ports/can/messages.h"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A copy of cells, and the robot's place in it.
struct ClearanceView {
    const gpom_cell_t *cells; ///< Row by row, as gpom_lowres_copy() gives them.
    gpom_raster_t raster;
    double x_m, y_m, yaw_rad; ///< The robot's reference point, map frame.
    float range_m;            ///< Cells farther away are ignored.
    float radius_m;           ///< Cells with a centre this near are the robot's own place.
};

/// A sector of the plane about the robot. Sector i of n spans 360 / n degrees about the bearing
/// i 360 / n degrees, counter-clockwise from forward.
struct Sector {
    double distance_m;        ///< Distance to the nearest place that is not free. range_m: there is
                              ///< no such place.
    bool is_clear;            ///< There is no such place.
    bool is_unknown;          ///< The nearest place is unknown and at the robot's edge: nothing is
                              ///< known.
    std::uint8_t probability; ///< Code of that cell. In a clear sector: the largest code.
    std::uint8_t deviation;   ///< Code of that cell. In a clear sector: the largest code.
};

/// Fill n sectors. Only cells of class free are free. Everything outside the raster is unknown. A
/// cell counts with its nearest point, in every sector that any part of the cell lies in.
/// Cost: 10 operations a cell within range, and four arctangents for each cell that is not free.
void find_clearance(const ClearanceView &view, Sector *sectors, std::size_t n);

/// Code of a sector's distance for GPOM_Clearance.
std::uint8_t distance_code(const Sector &sector);

} // namespace gpomd

#endif
