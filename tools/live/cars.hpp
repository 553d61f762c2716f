// Parked vehicles that leave or arrive while a live map looks on.
#ifndef GPOM_TOOLS_LIVE_CARS_HPP
#define GPOM_TOOLS_LIVE_CARS_HPP

#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <nlohmann/json.hpp>

namespace gpom_tools
{

struct CarsTrial {
    StreetConfig street; ///< Vehicles arrive or leave on the way.
    LiveConfig live;
    gpom_params_t params;
    double cell_m = 0.5;
    double seen_gap_m = 0.1; ///< Most between beams that see through a cell.
    double spurious = 0.0;   ///< Share of the returns that become shorter, by chance.
};

/// There and back along a street, past vehicles that leave half way.
CarsTrial default_cars();

/// After how many scans that look at it a vehicle's cell says what changed, for each, and the
/// raster before and after.
///
/// A cell is a vehicle's if its centre lies in one. Vehicles leave: of those that were occupied,
/// how many scans saw through each until it was no longer. A scan sees through a cell if its beams
/// that go on beyond it cross all of it, none farther than seen_gap_m from the next.
/// Vehicles arrive: of those that were free, how many scans had three returns or more from within
/// half a cell of its centre until it was not.
nlohmann::ordered_json cars_report(const CarsTrial &trial);

} // namespace gpom_tools

#endif
