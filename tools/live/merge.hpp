// Measures the map of two robots that share a log.
#ifndef GPOM_TOOLS_LIVE_MERGE_HPP
#define GPOM_TOOLS_LIVE_MERGE_HPP

#include "tools/live/judge.hpp"

namespace gpom_tools
{

/// One robot maps the whole log. Two others map one half each, the second in a frame of its own;
/// then the beams of the second enter the map of the first (gpom/exchange.h). Reports the accuracy
/// of all maps, kept beams, and what became of the beams that came.
nlohmann::ordered_json merge_report(const JudgeOptions &options);

} // namespace gpom_tools

#endif
