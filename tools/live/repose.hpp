// Measures a live map whose poses are corrected afterwards.
#ifndef GPOM_TOOLS_LIVE_REPOSE_HPP
#define GPOM_TOOLS_LIVE_REPOSE_HPP

#include "tools/live/judge.hpp"

namespace gpom_tools
{

struct ReposeOptions {
    JudgeOptions judge;       ///< Its scans have the right poses.
    std::string drifted_path; ///< The same scans with drifted poses, matched by their ranges.
    double share = 1.0;       ///< Share of the drift: 0 is the right pose, 1 the drifted one.
};

/// Three maps of the whole log: of the right poses, of the drifted poses, and the latter after
/// gpom_map_repose(). Three more whose poses drift for half of the log and are right after it: at
/// that time the map is reposed, kept as it is, or cleared. Reports accuracy, kept beams, the
/// greatest drift and the times of the calls.
nlohmann::ordered_json repose_report(const ReposeOptions &options);

} // namespace gpom_tools

#endif
