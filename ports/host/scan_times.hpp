// Times of recorded scans that never go back, made of times that may.
#ifndef GPOM_PORTS_HOST_SCAN_TIMES_HPP
#define GPOM_PORTS_HOST_SCAN_TIMES_HPP

#include "ports/host/scan_log.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Mends times that go back, and leaves all others as they are:
///   A few times that are ahead of the next scan's, or one behind, while the clock runs on: they
///   are set between the times before and after.
///   A clock that is set back: from there on all times are moved so that they go on, one usual
///   interval (the median) after the scan before.
///   Fewer times than half of the scans (a logger that wrote too few digits of the seconds since
///   1970; two lasers that scan together have half as many): the time of each scan is its index.
/// Returns a sentence for each kind of what was done.
std::vector<std::string> mend_times(std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
