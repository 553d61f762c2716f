// How far all is free about the robot, sector by sector, from a copy of the low-resolution map.
#ifndef GPOM_LINUX_CLEARANCE_HPP
#define GPOM_LINUX_CLEARANCE_HPP

#include "gpom/gpom.h"
#include "ports/can/messages.h"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A copy of cells and where the robot stands in them.
struct ClearanceView {
    const gpom_cell_t *cells; ///< Row by row, as gpom_lowres_copy() gives them.
    gpom_raster_t raster;
    double x_m, y_m, yaw_rad; ///< Of the robot's reference point, map frame.
    float range_m;            ///< Cells farther away do not matter.
    float radius_m;           ///< Cells whose centre is this near are the robot's own place.
};

/// A sector of the plane about the robot. Sector i of n spans 360 / n degrees about the bearing
/// i 360 / n degrees, counter-clockwise from forward.
struct Sector {
    double distance_m;        ///< To the nearest place that is not free; range_m: there is none.
    bool is_clear;            ///< There is none.
    bool is_unknown;          ///< That place is unknown, and at the robot's edge: nothing is known.
    std::uint8_t probability; ///< Code of that cell, or the largest in the sector if it is clear.
    std::uint8_t deviation;   ///< Likewise.
};

/// Fill n sectors. Only cells of class free are free; outside of the raster all is unknown. A cell
/// counts from its nearest point, in every sector that any part of it lies in.
/// Cost: 10 operations a cell within range, and four arcus tangents for each that is not free.
void find_clearance(const ClearanceView &view, Sector *sectors, std::size_t n);

/// Code of a sector's distance for GPOM_Clearance.
std::uint8_t distance_code(const Sector &sector);

} // namespace gpomd

#endif
