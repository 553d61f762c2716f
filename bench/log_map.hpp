// Maps of real logs to measure on.
#ifndef GPOM_BENCH_LOG_MAP_HPP
#define GPOM_BENCH_LOG_MAP_HPP

#include "bench/place.hpp"
#include "ports/host/scan_log.hpp"
#include "tools/map/host_map.hpp"

#include <map>
#include <memory>

namespace gpom_bench
{

using namespace gpom_tools;

/// A real log with patches around its poses. The map has all of its returns, or those that a live
/// map keeps, without or with late starts.
enum class Keep { all, live, live_late };

struct LogMap {
    std::vector<Scan> scans;
    std::unique_ptr<HostMap> map;
    std::vector<std::uint8_t> scratch;

    /// The i-th of 64 patches of 32 x 32 cells of 0.25 m around poses of the log.
    gpom_raster_t patch(std::size_t i) const
    {
        const Scan &scan = scans[i % 64 * scans.size() / 64];
        return {scan.x_m - 4.0, scan.y_m - 4.0, 0.25, 32, 32};
    }
};

inline LogMap &log_map(const std::string &path, Keep keep)
{
    static std::map<std::pair<std::string, Keep>, LogMap> maps;
    LogMap &made = maps[{path, keep}];
    if (!made.map) {
        ReadOptions options;
        options.range_max_m = 25.0;
        made.scans = read_scans(path, options);
        const gpom_params_t params = params_of("matern12", 16);
        const gpom_point_t origin = middle_of(made.scans);
        LiveConfig live;
        live.late_m = keep == Keep::live_late ? 0.5f * live.keep_m : 0.0f;
        made.map = std::make_unique<HostMap>(
            keep == Keep::all ? whole_config(params, beam_count(made.scans), origin)
                              : live_config(params, live, origin),
            live.late_m);
        for (const Scan &scan : made.scans) {
            made.map->insert(scan);
            (void)made.map->step(live.step_ops);
        }
        made.map->build();
        made.scratch.resize(gpom_scratch_bytes(made.map->get()));
    }
    return made;
}

} // namespace gpom_bench

#endif
