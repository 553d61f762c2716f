// Options of all tools that read recorded scans.
#ifndef GPOM_PORTS_HOST_SCAN_OPTIONS_HPP
#define GPOM_PORTS_HOST_SCAN_OPTIONS_HPP

#include "ports/host/command_line.hpp"
#include "ports/host/scan_log.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Add an option for the meaning of a reading that is not a distance.
inline CLI::Option *add_meaning_option(CLI::App &app, const std::string &name, bool &is_no_return,
                                       const std::string &what)
{
    return app
        .add_option_function<std::string>(
            name, [&is_no_return](const std::string &word) { is_no_return = word == "no-return"; },
            what + ": ignored, or no return (free up to the maximum)")
        ->check(CLI::IsMember({"ignore", "no-return"}))
        ->default_str("ignore");
}

/// Add all options except --range-max, which tools ask for in different ways.
inline std::vector<CLI::Option *> add_scan_options(CLI::App &app, ReadOptions &options)
{
    return {app.add_option("--fov", options.fov_deg,
                           "Field of view of the lasers of a CARMEN log, symmetrical about their\n"
                           "front [degree]; default: as the log says, or as the usual lasers do")
                ->check(between(1.0, 360.0)),
            app.add_option("--range-min", options.range_min_m,
                           "Readings over 0 and below it are too near [m]; by default no usual\n"
                           "lidar loses one")
                ->check(between(0.0, 1000.0))
                ->capture_default_str(),
            add_meaning_option(app, "--zero", options.is_zero_no_return, "What a reading of 0 is"),
            add_meaning_option(app, "--too-near", options.is_too_near_no_return,
                               "What a reading that is too near is")};
}

} // namespace gpom_tools

#endif
