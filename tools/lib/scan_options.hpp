// Options of every tool that reads recorded scans.
#ifndef GPOM_TOOLS_LIB_SCAN_OPTIONS_HPP
#define GPOM_TOOLS_LIB_SCAN_OPTIONS_HPP

#include "tools/lib/command_line.hpp"
#include "tools/lib/scan_log.hpp"

#include <vector>

namespace gpom_tools
{

/// All but --range-max, which not every tool asks for the same files.
inline std::vector<CLI::Option *> add_scan_options(CLI::App &app, ReadOptions &options)
{
    return {app.add_option("--fov", options.fov_deg,
                           "Angle that the lasers of a CARMEN log see, evenly about their front\n"
                           "[degree]; default: as the log says, or as the usual lasers do")
                ->check(CLI::Range(1.0, 360.0))};
}

} // namespace gpom_tools

#endif
