// Parts of a log by the way that the robot drove.
#ifndef GPOM_TOOLS_EVAL_STRETCH_HPP
#define GPOM_TOOLS_EVAL_STRETCH_HPP

#include "ports/host/scan_log.hpp"

#include <vector>

namespace gpom_tools
{

/// The scans from the first up to `first_m` of the way driven.
std::vector<Scan> first_metres(std::vector<Scan> scans, double first_m);

/// The scans beyond that stretch. Throws std::runtime_error where none are left.
std::vector<Scan> after_metres(std::vector<Scan> scans, double first_m);

} // namespace gpom_tools

#endif
