// How wide the doors of a corridor are in a live map, and whether a robot fits through them.
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
    CorridorLaser laser; ///< Of the first run; each further run takes the next seed.
    int n_runs = 5;
};

/// A robot drives past the doors of a corridor, then through them: what the map says of each door
/// after either, run by run, and the worst and the median of the runs.
///
/// Free means p <= 0.3, whatever the thresholds of the parameters are; figures named class_free
/// are by those.
/// A width is that of the connected free cells about the door's middle, in the row of cells that
/// the middle lies in: of the continuous map, asked at the centres of cells of 2 mm; of
/// low-resolution maps with cells of 0.05 and 0.1 m, evaluated to the end after the drive (unknown
/// cells are not free); and of OctoMap with the same cells from the same scans.
/// A path leads straight through the door's middle, from 0.8 m before the middle of the wall to
/// 0.8 m beyond it (gpom_path_query, samples 0.01 m apart). Its p_max is the lowest threshold of
/// class free that lets the robot through.
nlohmann::ordered_json door_report(const DoorTrial &trial);

} // namespace gpom_tools

#endif
