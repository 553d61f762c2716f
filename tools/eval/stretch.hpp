// Parts of a log by the distance that the robot drove.
#ifndef GPOM_TOOLS_EVAL_STRETCH_HPP
#define GPOM_TOOLS_EVAL_STRETCH_HPP

#include "ports/host/scan_log.hpp"

#include <vector>

namespace gpom_tools
{

/// The scans of the first `first_m` of the way.
std::vector<Scan> first_metres(std::vector<Scan> scans, double first_m);

/// The scans after the first `first_m` of the way. Throws std::runtime_error if none are left.
std::vector<Scan> after_metres(std::vector<Scan> scans, double first_m);

} // namespace gpom_tools

#endif
