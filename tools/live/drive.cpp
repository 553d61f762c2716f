#include "tools/live/drive.hpp"

#include "ports/host/progress.hpp"
#include "src/map/map.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/live/report.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace gpom
{

/// A part that also counts the items that a search compares.
template <class Part> struct Counted : Part {
    std::uint64_t *n_items;
};

template <class F, class Part>
F distance2(const Offset<F> &at, const Counted<Part> &part, const Beam &beam)
{
    ++*part.n_items;
    return distance2(at, static_cast<const Part &>(part), beam);
}

} // namespace gpom

namespace gpom_tools
{
namespace
{

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::size_t kTenths = 10;
constexpr std::size_t kPlacesAsked = 200; ///< Places around the robot, at the end of each tenth.
constexpr double kAskedWithin = 20.0;     ///< Largest distance of these places along each axis [m].

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Resident memory of this process [bytes].
std::size_t resident_bytes()
{
    std::ifstream statm("/proc/self/statm");
    std::size_t n_pages_mapped = 0, n_pages_resident = 0;
    if (!(statm >> n_pages_mapped >> n_pages_resident)) {
        throw std::runtime_error("/proc/self/statm: cannot be read");
    }
    return n_pages_resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

template <class Part>
std::uint64_t items_of(const gpom_map_t &map, const Part &part, std::uint32_t k,
                       gpom::Offset<float> at)
{
    std::uint64_t n_items = 0;
    std::vector<gpom::Found<float>> best(k);
    std::vector<gpom::Subtree> stack(gpom::kDepthMax);
    gpom::NearestK<float> nearest = {best.data(), k, 0};
    nearest.clear();
    const gpom::Counted<Part> counted = {{part}, &n_items};
    gpom::search(nearest, at, map.index, counted,
                 gpom::from_root(gpom::tree_of(map.index, counted), stack.data()));
    return n_items;
}

/// Mean number of beams whose distance a query computes, over places around the robot.
double items_per_query(const gpom_map_t &map, const Scan &scan, ProtocolRandom &random)
{
    std::uint64_t n_items = 0;
    for (std::size_t i = 0; i < kPlacesAsked; ++i) {
        const double x_m = scan.x_m + kAskedWithin * (2.0 * random.uniform() - 1.0);
        const double y_m = scan.y_m + kAskedWithin * (2.0 * random.uniform() - 1.0);
        const gpom::Offset<float> at = {static_cast<float>(x_m - map.config.origin_x_m),
                                        static_cast<float>(y_m - map.config.origin_y_m)};
        n_items += items_of(map, map.index.hit_part, map.config.params.n_hits, at) +
                   items_of(map, map.index.free_part, map.config.params.n_free, at);
    }
    return static_cast<double>(n_items) / static_cast<double>(kPlacesAsked);
}

/// Sums over one tenth of the drive.
struct Tenth {
    std::size_t n_scans = 0;
    std::uint64_t ops = 0, ops_max = 0;
    double insert_s = 0.0, insert_max_s = 0.0, step_s = 0.0;
};

Json tenth_json(const Tenth &tenth, const HostMap &map, double n_items)
{
    const auto n = static_cast<double>(tenth.n_scans);
    return {{"scans", tenth.n_scans},
            {"kept", gpom_map_beam_count(map.get())},
            {"resident_bytes", resident_bytes()},
            {"step_ops_mean", static_cast<double>(tenth.ops) / n},
            {"step_ops_max", tenth.ops_max},
            {"insert_us_mean", 1e6 * tenth.insert_s / n},
            {"insert_us_max", 1e6 * tenth.insert_max_s},
            {"step_us_mean", 1e6 * tenth.step_s / n},
            {"items_per_query", n_items}};
}

HostMap map_of(const DriveConfig &drive)
{
    const gpom_point_t middle = {std::round(0.5 * drive.town.width_m),
                                 std::round(0.5 * drive.town.height_m)};
    gpom_config_t config = live_config(drive.params, drive.live, middle);
    if (drive.n_cells_side > 0) {
        config.lowres_cell_m = drive.cell_m;
        config.lowres_nx = config.lowres_ny = drive.n_cells_side;
        config.lowres_rolling = 1;
    }
    return HostMap(config, drive.live.late_m);
}

/// Cost of one scan.
struct Cost {
    double insert_s, step_s;
    std::uint64_t ops;
    double rival_s = 0.0;
};

Cost cost_of(HostMap &map, const Scan &scan, std::uint64_t step_ops)
{
    const Clock::time_point start = Clock::now();
    map.insert(scan);
    const double insert_s = seconds_since(start);
    const std::uint64_t ops = map.step(step_ops);
    return {insert_s, seconds_since(start) - insert_s, ops, 0.0};
}

void add(Tenth &tenth, const Cost &cost)
{
    ++tenth.n_scans;
    tenth.ops += cost.ops;
    tenth.ops_max = std::max(tenth.ops_max, cost.ops);
    tenth.insert_s += cost.insert_s;
    tenth.insert_max_s = std::max(tenth.insert_max_s, cost.insert_s);
    tenth.step_s += cost.step_s;
}

double median(std::vector<double> values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Costs of the scans of one run after the map was full.
std::vector<Cost> full_map_costs(const InsertBench &bench)
{
    HostMap map = map_of(bench.drive);
    std::vector<Cost> costs;
    for_each_scan(bench.drive, [&](const Scan &scan) {
        const bool is_full = gpom_map_beam_count(map.get()) >= bench.n_kept;
        const Cost cost = cost_of(map, scan, bench.drive.live.step_ops);
        if (is_full || !costs.empty()) {
            costs.push_back(cost);
            costs.back().rival_s = bench.rival_s ? bench.rival_s(*map.get(), scan) : 0.0;
        }
        return costs.size() < bench.n_scans;
    });
    if (costs.size() < bench.n_scans) {
        throw std::runtime_error("the drive ended before " + std::to_string(bench.n_kept) +
                                 " beams were kept and " + std::to_string(bench.n_scans) +
                                 " scans measured; give more --scans");
    }
    return costs;
}

/// Mean and largest of the medians of each scan over the runs. The median removes the load of other
/// programs on the machine.
Json time_json(const std::vector<std::vector<Cost>> &runs, double Cost::*time_s)
{
    double sum_s = 0.0, max_s = 0.0;
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
        std::vector<double> times_s;
        for (const std::vector<Cost> &run : runs) {
            times_s.push_back(run[i].*time_s);
        }
        const double scan_s = median(times_s);
        sum_s += scan_s;
        max_s = std::max(max_s, scan_s);
    }
    return {{"us_mean", 1e6 * sum_s / static_cast<double>(runs[0].size())},
            {"us_max", 1e6 * max_s}};
}

} // namespace

DriveConfig default_drive()
{
    DriveConfig drive;
    drive.town.width_m = 300.0;
    drive.town.height_m = 200.0;
    drive.town.n_scans = 20000;
    drive.town.n_beams = 180;
    drive.town.step_m = 0.4;
    drive.live.beam_max = 20000;
    gpom_params_init(&drive.params);
    return drive;
}

void check_length(const DriveConfig &drive)
{
    if (drive.town.n_scans < static_cast<int>(kTenths) || drive.town.n_scans > 10000000) {
        throw std::runtime_error("--scans: must be from 10 to 10 million, is " +
                                 std::to_string(drive.town.n_scans));
    }
}

void for_each_scan(const DriveConfig &drive, const std::function<bool(const Scan &)> &visit)
{
    const StreetWorld world = make_street_world(drive.town);
    const ObstacleGrid obstacles(world);
    StreetLaser laser(drive.town);
    for (const StreetPose &pose : drive_streets(world, drive.town)) {
        if (!visit(laser.scan(obstacles, pose))) {
            return;
        }
    }
}

Json drive_report(const DriveConfig &drive)
{
    HostMap map = map_of(drive);
    Progress progress("driving");
    ProtocolRandom random(drive.town.seed);
    const auto n_scans = static_cast<std::size_t>(drive.town.n_scans);
    Json tenths = Json::array();
    Tenth tenth;
    std::size_t n_done = 0;
    for_each_scan(drive, [&](const Scan &scan) {
        add(tenth, cost_of(map, scan, drive.live.step_ops));
        ++n_done;
        progress.update(n_done, n_scans);
        if (n_done == n_scans * (tenths.size() + 1) / kTenths) {
            const double n_items = items_per_query(*map.get(), scan, random);
            tenths.push_back(tenth_json(tenth, map, n_items));
            tenth = {};
        }
        return true;
    });
    return {{"scans", n_done},
            {"beams_per_scan", drive.town.n_beams},
            {"beam_max", drive.live.beam_max},
            {"map_bytes", map.bytes()},
            {"step_ops_budget", drive.live.step_ops},
            {"tenths", tenths},
            {"counts", counts_json(map.stats())}};
}

Json insert_report(const InsertBench &bench)
{
    std::vector<std::vector<Cost>> runs;
    for (std::size_t i = 0; i < bench.n_runs; ++i) {
        runs.push_back(full_map_costs(bench));
    }
    Json report = {{"kept", bench.n_kept},
                   {"beam_max", bench.drive.live.beam_max},
                   {"beams_per_scan", bench.drive.town.n_beams},
                   {"scans", bench.n_scans},
                   {"runs", bench.n_runs},
                   {"insert", time_json(runs, &Cost::insert_s)},
                   {"step", time_json(runs, &Cost::step_s)}};
    if (bench.rival_s) {
        report["rival"] = time_json(runs, &Cost::rival_s);
    }
    return report;
}

} // namespace gpom_tools
