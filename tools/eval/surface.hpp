// The true surface of a simulated world: the border between occupied and free cells.
#ifndef GPOM_TOOLS_EVAL_SURFACE_HPP
#define GPOM_TOOLS_EVAL_SURFACE_HPP

#include "gpom/query.h"
#include "ports/host/scan_log.hpp"
#include "tools/sim/truth.hpp"

#include <vector>

namespace gpom_tools
{

/// Distance from a place inside the raster to the nearest surface [m], negative in free space. The
/// place and the surface are exact, not rounded to cells. Distances over reach_m are +-infinity.
/// Cost: (reach_m / cell_m)^2.
double signed_distance(const Truth &truth, gpom_point_t at, double reach_m);

/// A place on the surface, and the unit normal from free to occupied space.
struct SurfacePlace {
    gpom_point_t at;
    double normal_x;
    double normal_y;
};

/// The middle of every side between a free and an occupied cell.
std::vector<SurfacePlace> surface_places(const Truth &truth);

/// True if a sensor at the pose of a scan sees the free side of the place: the place is in its
/// range and field of view, and no occupied cell is in between.
bool is_in_view(const SurfacePlace &place, const Truth &truth, const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
