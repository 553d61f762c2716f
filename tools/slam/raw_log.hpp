// A log with poses of odometry, and corrected poses of some of its scans.
#ifndef GPOM_TOOLS_SLAM_RAW_LOG_HPP
#define GPOM_TOOLS_SLAM_RAW_LOG_HPP

#include "ports/host/scan_log.hpp"
#include "tools/slam/pose.hpp"

#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

struct DrivenScan {
    Scan scan;     ///< With the pose of odometry.
    Pose odometry; ///< The same pose.
    std::optional<Pose> corrected;
};

/// The pose that a scan has.
inline Pose pose_of(const Scan &scan) { return {scan.x_m, scan.y_m, scan.theta_rad}; }

/// All scans of a raw log. Corrected poses come from another log of the same scans, which are
/// recognised by their ranges, in order. An empty path: there are none. Throws FileError if no
/// scan of the corrected log is found.
std::vector<DrivenScan> read_raw_log(const std::string &raw_path, const std::string &corrected_path,
                                     const ReadOptions &options);

/// Scans whose poses are right, as a raw log with corrected poses.
std::vector<DrivenScan> with_true_poses(const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
