// Building a map scan by scan, with no loop closure: predict by odometry, match, insert.
#ifndef GPOM_TOOLS_SLAM_DRIVE_HPP
#define GPOM_TOOLS_SLAM_DRIVE_HPP

#include "tools/slam/matcher.hpp"
#include "tools/slam/raw_log.hpp"

#include <vector>

namespace gpom_tools
{

/// Which scans are matched and inserted: those that odometry, or the found pose, puts this far from
/// the one before. Scans with a corrected pose are always matched.
struct DriveOptions {
    double match_m = 0.1, match_rad = 5.0 * M_PI / 180.0;
    double insert_m = 0.2, insert_rad = 10.0 * M_PI / 180.0;
};

/// A scan that was matched.
struct Visited {
    std::size_t i_scan;
    Pose pose;
    unsigned flags = 0;
};

struct Driven {
    std::vector<Visited> way;
    std::size_t n_matched = 0, n_inserted = 0, n_doubtful = 0;
    std::size_t n_searches = 0, n_searches_max = 0;
    double match_ms = 0.0, match_ms_max = 0.0, insert_ms = 0.0; ///< Sums, and the longest.
};

/// Drive a log. Without a matcher the poses are those of odometry. A scan whose pose is in doubt
/// is not inserted.
Driven drive(const std::vector<DrivenScan> &log, Matcher *matcher, const DriveOptions &options);

/// The corrected poses, as a drive.
Driven corrected_drive(const std::vector<DrivenScan> &log);

} // namespace gpom_tools

#endif
