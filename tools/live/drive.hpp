// Long simulated drives: measures the cost of a live map over time.
#ifndef GPOM_TOOLS_LIVE_DRIVE_HPP
#define GPOM_TOOLS_LIVE_DRIVE_HPP

#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <nlohmann/json.hpp>

#include <functional>

namespace gpom_tools
{

/// A robot that drives round and round a town, with ten scans a second.
struct DriveConfig {
    StreetConfig town; ///< n_scans is the length of the drive.
    LiveConfig live;
    gpom_params_t params;
    double cell_m = 0.5;            ///< Cell size of a low-resolution map that follows the robot.
    std::uint16_t n_cells_side = 0; ///< Cells along each side of this square map. 0: there is no
                                    ///< such map.
};

/// 180 beams, 0.4 m between scans, a town of 300 m x 200 m, and a map of 20,000 beams.
DriveConfig default_drive();

/// Throws std::runtime_error if the drive has no scans or more than 10 million.
void check_length(const DriveConfig &drive);

/// Visit the scans of a drive one by one. visit() returns whether to go on.
void for_each_scan(const DriveConfig &drive, const std::function<bool(const Scan &)> &visit);

/// Memory, work and query cost over the drive, for each tenth.
nlohmann::ordered_json drive_report(const DriveConfig &drive);

/// Times of scans after n_kept beams are kept, over several runs of the same drive.
struct InsertBench {
    DriveConfig drive;
    std::size_t n_kept = 20000;
    std::size_t n_scans = 2000;
    std::size_t n_runs = 5;
    /// Called after each measured scan. Returns the time of a rival's work for the same scan [s].
    /// The map is that of the run. Absent: there is no rival.
    std::function<double(const gpom_map_t &map, const Scan &scan)> rival_s = {};
};
nlohmann::ordered_json insert_report(const InsertBench &bench);

} // namespace gpom_tools

#endif
