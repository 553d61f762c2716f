#include "tools/slam/raw_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace gpom_tools
{

namespace
{

/// The ranges in centimetres, as a key: logs print them with two digits.
std::string key_of(const Scan &scan)
{
    std::string key;
    for (const float range_m : scan.ranges_m) {
        const bool is_number = std::isfinite(range_m);
        const std::int64_t cm = is_number ? std::llround(100.0 * double{range_m}) : -1;
        key += std::to_string(cm) + ' ';
    }
    return key;
}

/// Give corrected poses to the scans of the same ranges. Returns how many were found.
std::size_t match(std::vector<DrivenScan> &raw, const std::vector<Scan> &corrected)
{
    std::unordered_map<std::string, std::vector<std::size_t>> places;
    for (std::size_t i = 0; i < raw.size(); ++i) {
        places[key_of(raw[i].scan)].push_back(i);
    }
    std::size_t next = 0, n_matched = 0;
    for (const Scan &scan : corrected) {
        const auto found = places.find(key_of(scan));
        if (found == places.end()) {
            continue;
        }
        const auto place = std::lower_bound(found->second.begin(), found->second.end(), next);
        if (place != found->second.end()) {
            raw[*place].corrected = pose_of(scan);
            next = *place + 1;
            ++n_matched;
        }
    }
    return n_matched;
}

} // namespace

std::vector<DrivenScan> read_raw_log(const std::string &raw_path, const std::string &corrected_path,
                                     const ReadOptions &options)
{
    std::vector<DrivenScan> raw;
    for (Scan &scan : read_scans(raw_path, options)) {
        const Pose odometry = pose_of(scan);
        raw.push_back({std::move(scan), odometry, std::nullopt});
    }
    if (!corrected_path.empty() && match(raw, read_scans(corrected_path, options)) < 2) {
        throw FileError(corrected_path, 0,
                        "fewer than two scans have the ranges of scans of " + raw_path +
                            "; give the corrected log of the same drive");
    }
    return raw;
}

std::vector<DrivenScan> with_true_poses(const std::vector<Scan> &scans)
{
    std::vector<DrivenScan> raw;
    for (const Scan &scan : scans) {
        raw.push_back({scan, pose_of(scan), pose_of(scan)});
    }
    return raw;
}

} // namespace gpom_tools
