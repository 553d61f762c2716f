// Test points of a log whose places were not changed when the log ended.
#ifndef GPOM_TOOLS_EVAL_UNCHANGED_POINTS_HPP
#define GPOM_TOOLS_EVAL_UNCHANGED_POINTS_HPP

#include "tools/eval/protocol.hpp"

#include <vector>

namespace gpom_tools
{

constexpr int kChangedScans = 5;          ///< Scans in a row, up to the last, that look through.
constexpr double kReturnsWithin_m = 0.15; ///< A return this near says that a place is occupied,
constexpr double kPassesWithin_m = 0.05;  ///< a beam that passes it this near, and goes on
constexpr double kGoesOn_m = 0.5;         ///< this far, that it is free.

/// The points but those that changed: a return's place is free at the end if the last kChangedScans
/// scans that saw it looked through it. Someone who asks a map at the end of a drive asks for what
/// is there then; a test point may be of a time before. Scans in order of time; a scan that says
/// both of a place says occupied. Free points stay: those just before a surface have returns as
/// near as a vehicle that came since would give. On a street driven twice where vehicles arrive
/// halfway they cost the live map .002 of NLL at most.
std::vector<TestPoint> unchanged_points(const std::vector<TestPoint> &points,
                                        const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
