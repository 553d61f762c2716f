// How much a live map knows, by points it has not seen.
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
    std::string truth_path; ///< Of a street; none for a log.
    std::string params_path;
    LiveConfig live;
    ReadOptions reading;
    double fraction = 0.9;       ///< Of a log's returns make the map, the others judge it.
    double spurious = 0.0;       ///< Share of the map's returns that become shorter, by chance.
    std::size_t n_points = 4000; ///< Of a street, those away from its beams left out.
    std::uint64_t seed = 0;
};

/// What makes a live map, and what judges it.
struct JudgeData {
    std::vector<Scan> scans;
    std::vector<TestPoint> points;
    std::vector<ProfilePlace> profile{};
    std::vector<GridBeam> others{}; ///< Of a log: beams that the map does not get.
};

/// What options.scans_path and options.truth_path give; throws FileError.
JudgeData judge_data(const JudgeOptions &options);

/// The live map of all scans in their order, stepped after each.
HostMap live_map(const gpom_params_t &params, const LiveConfig &live,
                 const std::vector<Scan> &scans);

/// Accuracy of that map.
Metrics live_accuracy(const gpom_params_t &params, const LiveConfig &live, const JudgeData &data);

/// The live map of all scans in their order, stepped after each, against a map of as many beams
/// drawn at random from the same scans: accuracy and profile, of a log also accuracy at places that
/// had not changed when it ended (unchanged_points.hpp), counts by cause, memory and work.
nlohmann::ordered_json judge_report(const JudgeOptions &options);

} // namespace gpom_tools

#endif
