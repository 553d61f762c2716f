// Options of all tools that keep a map as a vehicle does.
#ifndef GPOM_TOOLS_MAP_MAP_OPTIONS_HPP
#define GPOM_TOOLS_MAP_MAP_OPTIONS_HPP

#include "ports/host/command_line.hpp"
#include "tools/map/host_map.hpp"

#include <vector>

namespace gpom_tools
{

/// Add all options except the capacity, which gpom-query names itself.
inline std::vector<CLI::Option *> add_live_options(CLI::App &app, LiveConfig &live)
{
    return {
        app.add_option("--keep", live.keep_m,
                       "A return this near to a kept hit confirms it and is not kept [m]")
            ->check(CLI::Range(1e-3, 100.0))
            ->capture_default_str(),
        app.add_option("--clear-scans", live.clear_scans,
                       "A hit is removed when this many scans in a row see through it; 0: never")
            ->check(CLI::IsMember({0, 2, 3, 4}))
            ->capture_default_str(),
        app.add_option("--late", live.late_m,
                       "Beams begin late where free segments crowd cells this wide [m]; 0: never")
            ->check(CLI::Range(0.0, 1e3))
            ->capture_default_str(),
        app.add_option("--step-ops", live.step_ops,
                       "Budget of the work after each scan [operations]")
            ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53))
            ->capture_default_str()};
}

inline CLI::Option *add_capacity_option(CLI::App &app, LiveConfig &live)
{
    return app.add_option("--beam-max", live.beam_max, "Capacity of the map [beams]")
        ->check(CLI::Range(1u, GPOM_BEAM_MAX))
        ->capture_default_str();
}

} // namespace gpom_tools

#endif
