// Measures the accuracy of a live map at points that it has not seen.
#ifndef GPOM_TOOLS_LIVE_JUDGE_HPP
#define GPOM_TOOLS_LIVE_JUDGE_HPP

#include "tools/eval/metrics.hpp"
#include "tools/eval/profile.hpp"
#include "tools/map/host_map.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gpom_tools
{

struct JudgeOptions {
    std::string scans_path;
    std::string truth_path; ///< For a street. Empty for a log.
    std::string params_path;
    LiveConfig live;
    ReadOptions reading;
    double fraction = 0.9;       ///< Share of a log's returns that make the map. The others judge
                                 ///< it.
    double spurious = 0.0;       ///< Share of the map's returns that are made shorter at random.
    std::size_t n_points = 4000; ///< For a street. Points away from its beams are left out.
    std::uint64_t seed = 0;
};

/// The data that make a live map, and the data that judge it.
struct JudgeData {
    std::vector<Scan> scans;
    std::vector<TestPoint> points;
    std::vector<ProfilePlace> profile{};
    std::vector<GridBeam> others{}; ///< For a log: beams that the map does not get.
};

/// Read options.scans_path and options.truth_path. Throws FileError.
JudgeData judge_data(const JudgeOptions &options);

/// The live map of all scans in order, with a step after each scan.
HostMap live_map(const gpom_params_t &params, const LiveConfig &live,
                 const std::vector<Scan> &scans);

/// Accuracy of this live map.
Metrics live_accuracy(const gpom_params_t &params, const LiveConfig &live, const JudgeData &data);

/// Compare the live map of all scans with a map of the same number of beams, drawn at random from
/// the same scans. Reports accuracy and profile, counts by cause, memory and work. For a log it
/// also reports the accuracy at places that had not changed when the log ended
/// (unchanged_points.hpp).
nlohmann::ordered_json judge_report(const JudgeOptions &options);

} // namespace gpom_tools

#endif
