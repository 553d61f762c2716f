// Measures how fast a live map notices parked vehicles that leave or arrive.
#ifndef GPOM_TOOLS_LIVE_CARS_HPP
#define GPOM_TOOLS_LIVE_CARS_HPP

#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <nlohmann/json.hpp>

namespace gpom_tools
{

struct CarsTrial {
    StreetConfig street; ///< Vehicles arrive or leave during the drive.
    LiveConfig live;
    gpom_params_t params;
    double cell_m = 0.5;
    double seen_gap_m = 0.1; ///< Largest spacing of beams that see through a cell.
    double spurious = 0.0;   ///< Share of the returns that are made shorter at random.
};

/// A drive along a street and back, past vehicles that leave halfway.
CarsTrial default_cars();

/// After a change, counts the scans that see a vehicle's cell until the cell is right. Reports this
/// for each cell, and the raster before and after.
///
/// A cell belongs to a vehicle if its centre lies in the vehicle. If vehicles leave: for each cell
/// that was occupied, the number of scans that saw through it until it was not occupied any more. A
/// scan sees through a cell if its beams that go on beyond the cell cover it, with a spacing of at
/// most seen_gap_m. If vehicles arrive: for each cell that was free, the number of scans that had
/// at least three returns from within half a cell of its centre until it was not free any more.
nlohmann::ordered_json cars_report(const CarsTrial &trial);

} // namespace gpom_tools

#endif
