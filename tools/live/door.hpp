// Measures how wide the doors of a corridor are in a live map, and whether a robot fits through.
#ifndef GPOM_TOOLS_LIVE_DOOR_HPP
#define GPOM_TOOLS_LIVE_DOOR_HPP

#include "tools/map/host_map.hpp"
#include "tools/sim/corridor.hpp"

#include <nlohmann/json.hpp>

namespace gpom_tools
{

struct DoorTrial {
    LiveConfig live;
    gpom_params_t params;
    CorridorLaser laser; ///< Of the first run. Each further run uses the next seed.
    int n_runs = 5;
};

/// A robot drives past the doors of a corridor, then through them. After each part the report says
/// what the map shows of each door, for each run, with the worst and the median of the runs.
///
/// Free means p <= 0.3, whatever the thresholds of the parameters are. Figures named class_free use
/// the thresholds of the parameters.
///
/// A width is that of the connected free cells around the door's middle, in the row of cells that
/// contains the middle. It is measured in the continuous map at the centres of cells of 2 mm, in
/// low-resolution maps with cells of 0.05 and 0.1 m, and in OctoMap with the same cells from the
/// same scans. The low-resolution maps are evaluated completely after the drive, and their unknown
/// cells are not free.
///
/// A path leads straight through the door's middle, from 0.8 m before the middle of the wall to 0.8
/// m beyond it (gpom_path_query, samples 0.01 m apart). Its p_max is the lowest threshold of class
/// free with which the robot fits through.
nlohmann::ordered_json door_report(const DoorTrial &trial);

} // namespace gpom_tools

#endif
