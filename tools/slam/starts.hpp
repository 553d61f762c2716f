// Alignments from starts that are wrong by a known amount, against the map of all earlier scans at
// their corrected poses.
#ifndef GPOM_TOOLS_SLAM_STARTS_HPP
#define GPOM_TOOLS_SLAM_STARTS_HPP

#include "tools/slam/matcher.hpp"
#include "tools/slam/raw_log.hpp"

#include <cstdint>
#include <vector>

namespace gpom_tools
{

struct StartOptions {
    std::size_t every = 12; ///< Each so many-th corrected scan is aligned.
    std::size_t skip = 20;  ///< The first scans only make the map.
    std::uint32_t seed = 1;
};

/// How far a start is off, in a direction drawn at random.
struct StartOffset {
    double place_m, yaw_deg;
};
constexpr StartOffset kOffsets[] = {{0.0, 0.0},  {0.1, 3.0},  {0.2, 5.0}, {0.3, 10.0},
                                    {0.5, 10.0}, {0.0, 20.0}, {1.0, 20.0}};

/// An alignment is right within these distances of the corrected pose.
constexpr double kRight_m = 0.2, kRight_deg = 3.0;

struct Start {
    std::size_t i_scan;
    StartOffset off;
    Matched found;
    double place_m, yaw_deg; ///< Errors of what was found.
    double nees = 0.0;       ///< Squared Mahalanobis distance of the error; 3 is expected.
    bool is_right() const { return place_m < kRight_m && yaw_deg < kRight_deg; }
};

std::vector<Start> try_starts(const std::vector<DrivenScan> &log, Matcher &matcher,
                              const StartOptions &options);

} // namespace gpom_tools

#endif
