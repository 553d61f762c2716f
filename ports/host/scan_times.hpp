// Repairs times of recorded scans, so that they never go back.
#ifndef GPOM_PORTS_HOST_SCAN_TIMES_HPP
#define GPOM_PORTS_HOST_SCAN_TIMES_HPP

#include "ports/host/scan_log.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Repair times that go back. All other times stay as they are:
///   If a few times are ahead of the next scan's time, or one is behind, while the clock runs on,
///   they are set between the times before and after.
///   If the clock was set back, all times from there on are moved, so that they go on one usual
///   interval (the median) after the scan before.
///   If there are fewer different times than half of the scans, the time of each scan is its index.
///   This happens when a logger wrote too few digits of the seconds since 1970. Two lasers that
///   scan together still have half as many times as scans.
/// Returns one sentence for each kind of repair.
std::vector<std::string> mend_times(std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
