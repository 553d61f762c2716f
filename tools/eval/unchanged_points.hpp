// Test points of a log at places that had not changed by the end of the log.
#ifndef GPOM_TOOLS_EVAL_UNCHANGED_POINTS_HPP
#define GPOM_TOOLS_EVAL_UNCHANGED_POINTS_HPP

#include "tools/eval/protocol.hpp"

#include <vector>

namespace gpom_tools
{

constexpr int kChangedScans = 5;          ///< A place changed if this many scans in a row, up to
                                          ///< the last, look through it.
constexpr double kReturnsWithin_m = 0.15; ///< A return this near means that a place is occupied.
constexpr double kPassesWithin_m = 0.05;  ///< A beam that passes this near and goes on
                                          ///< kGoesOn_m means that a place is free.
constexpr double kGoesOn_m = 0.5;         ///< See kPassesWithin_m.

/// The test points without those that changed. The place of a return is free at the end if the last
/// kChangedScans scans that saw it looked through it. This filter is needed because a map that is
/// queried at the end of a drive must describe that time, while a test point may be of an earlier
/// time. The scans must be in order of time. If the beams of one scan disagree about a place, it
/// counts as occupied. Free points are not filtered: the returns near a free point just before a
/// surface are as near as those of a vehicle that came later. On a street that was driven twice,
/// where vehicles arrive halfway, they raise the NLL of the live map by at most .002.
std::vector<TestPoint> unchanged_points(const std::vector<TestPoint> &points,
                                        const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
