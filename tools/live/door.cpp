#include "tools/live/door.hpp"

#include "tools/eval/octomap_rival.hpp"
#include "tools/live/report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

constexpr float kFree = 0.3f;             ///< Largest probability of free space.
constexpr double kContinuousCell = 0.002; ///< [m]
constexpr double kCells[2] = {0.05, 0.1}; ///< Cell sizes of grids [m].
constexpr double kRowBeyond = 0.3;        ///< A row extends this far beyond both door frames [m].
constexpr double kRadii[2] = {0.25, 0.3}; ///< Radii of robots [m].
constexpr double kRadiusMax = 0.5;        ///< Largest radius in the search [m].
constexpr double kRadiusStep = 0.004;     ///< Accuracy of the search for the largest radius [m].
constexpr double kPathHalf = 0.8;         ///< Half of the length of a path [m].
constexpr double kPathSpacing = 0.01;     ///< [m]
constexpr double kOpeningMargin = 0.1;    ///< Parts of the wall this near to an opening are not
                                          ///< plain wall [m].
constexpr double kWallStep[2] = {0.05, 0.01};   ///< Spacing of lines across the wall, and of points
                                                ///< on them [m].
constexpr double kPictureCell = 0.01;           ///< Smallest cells of a picture [m].
constexpr double kPictureHalf[2] = {0.75, 0.5}; ///< [m]

/// Enough operations for all cells.
constexpr std::uint64_t kWholeStepOps = std::uint64_t{1} << 40;

using Points = std::vector<gpom_point_t>;

/// One method that knows which space is free. `ask` gives NaN for unknown places.
struct Method {
    std::string name;
    double cell_m;
    std::function<std::vector<double>(const Points &)> ask;
};

double centre_of_cell(double at_m, double cell_m)
{
    return (std::floor(at_m / cell_m) + 0.5) * cell_m;
}

// ---- maps ---------------------------------------------------------------------------------------

/// A live map with its low-resolution map, and OctoMap with cells of the same size.
struct Maps {
    Maps(const gpom_config_t &map_config, float late_m, double cell)
        : config(map_config), cell_m(cell), live(map_config, late_m),
          octomap(cell, {map_config.origin_x_m, map_config.origin_y_m})
    {
    }

    void insert(const Scan &scan, std::uint64_t step_ops)
    {
        live.insert(scan);
        live.step(step_ops);
        octomap.insert(scan);
    }

    gpom_config_t config;
    double cell_m;
    HostMap live;
    OctomapRival octomap;
};

gpom_config_t door_config(const DoorTrial &trial, const StreetWorld &world, double cell_m)
{
    gpom_config_t config =
        live_config(trial.params, trial.live,
                    {std::round(0.5 * world.width_m), std::round(0.5 * world.height_m)});
    config.lowres_cell_m = cell_m;
    config.lowres_nx = static_cast<std::uint16_t>(std::ceil(world.width_m / cell_m));
    config.lowres_ny = static_cast<std::uint16_t>(std::ceil(world.height_m / cell_m));
    return config;
}

/// The low-resolution map as it is now. Its cells are copied.
Method lowres_method(const Maps &maps)
{
    return {"lowres", maps.cell_m,
            [cells = maps.live.cells(), nx = maps.config.lowres_nx,
             cell_m = maps.cell_m](const Points &points) {
                std::vector<double> probabilities;
                for (const gpom_point_t &point : points) {
                    const auto ix = static_cast<std::size_t>(point.x_m / cell_m);
                    const auto iy = static_cast<std::size_t>(point.y_m / cell_m);
                    const gpom_cell_t &cell = cells.at(iy * nx + ix);
                    probabilities.push_back(cell.cls == GPOM_UNKNOWN
                                                ? std::numeric_limits<double>::quiet_NaN()
                                                : cell.probability / 65535.0);
                }
                return probabilities;
            }};
}

Method octomap_method(const Maps &maps)
{
    return {"octomap", maps.cell_m, [&octomap = maps.octomap](const Points &points) {
                std::vector<double> probabilities;
                for (const gpom_point_t &point : points) {
                    probabilities.push_back(octomap.probability(point));
                }
                return probabilities;
            }};
}

/// All methods. The low-resolution maps must be complete.
std::vector<Method> methods_of(std::vector<std::unique_ptr<Maps>> &all)
{
    std::vector<Method> methods{
        {"continuous", kContinuousCell,
         [&map = all.front()->live](const Points &points) { return map.probabilities(points); }}};
    for (const auto &maps : all) {
        while (maps->live.step(kWholeStepOps) > 0) {
        }
        methods.push_back(lowres_method(*maps));
    }
    for (const auto &maps : all) {
        methods.push_back(octomap_method(*maps));
    }
    return methods;
}

// ---- widths -------------------------------------------------------------------------------------

/// Width of the connected free cells around cell i_middle. NaN is not free.
double free_stretch_m(const std::vector<double> &probabilities, std::size_t i_middle,
                      const Method &method, float p_free)
{
    const auto is_free = [&](double p) { return p <= double{p_free}; };
    if (!is_free(probabilities[i_middle])) {
        return 0.0;
    }
    const auto middle = probabilities.begin() + static_cast<std::ptrdiff_t>(i_middle);
    const auto high = std::find_if_not(middle, probabilities.end(), is_free);
    const auto low =
        std::find_if_not(std::make_reverse_iterator(middle), probabilities.rend(), is_free);
    return method.cell_m * static_cast<double>(std::distance(low.base(), high));
}

Json width_json(const Method &method, const Door &door, float p_free)
{
    const double reach_m = 0.5 * door.width_m + kRowBeyond;
    const auto i_middle = static_cast<std::size_t>(reach_m / method.cell_m);
    const double middle_x_m = centre_of_cell(door.centre.x_m, method.cell_m);
    const double x0_m = middle_x_m - static_cast<double>(i_middle) * method.cell_m;
    const double y_m = centre_of_cell(door.centre.y_m, method.cell_m);
    Points row;
    for (std::size_t i = 0; i <= 2 * i_middle; ++i) {
        row.push_back({x0_m + static_cast<double>(i) * method.cell_m, y_m});
    }
    const std::vector<double> probabilities = method.ask(row);
    return {{"map", method.name},
            {"cell_m", method.cell_m},
            {"free_m", free_stretch_m(probabilities, i_middle, method, kFree)},
            {"class_free_m", free_stretch_m(probabilities, i_middle, method, p_free)},
            {"row", {{"x0_m", x0_m}, {"y_m", y_m}, {"i_middle", i_middle}, {"p", probabilities}}}};
}

// ---- paths --------------------------------------------------------------------------------------

gpom_path_result_t query_path(const HostMap &map, const Door &door, double radius_m,
                              float stop_probability)
{
    const gpom_point_t way[2] = {{door.centre.x_m, door.centre.y_m - kPathHalf},
                                 {door.centre.x_m, door.centre.y_m + kPathHalf}};
    return map.query({way, 2, radius_m, kPathSpacing, stop_probability});
}

Json path_json(const HostMap &map, const Door &door, double radius_m, const gpom_params_t &params)
{
    const gpom_path_result_t result = query_path(map, door, radius_m, 2.0f);
    return {{"radius_m", radius_m},
            {"p_max", result.probability},
            {"x_m", result.x_m},
            {"y_m", result.y_m},
            {"free", result.probability <= kFree},
            {"class_free", result.cls == GPOM_FREE},
            {"not_occupied", result.probability < params.p_occupied}};
}

/// Largest radius of a robot that fits through the free space, by bisection.
double radius_max_m(const HostMap &map, const Door &door)
{
    const float above = std::nextafter(kFree, 1.0f);
    double free_m = 0.0, not_free_m = kRadiusMax;
    while (not_free_m - free_m > kRadiusStep) {
        const double radius_m = 0.5 * (free_m + not_free_m);
        const bool stopped =
            (query_path(map, door, radius_m, above).flags & GPOM_PATH_STOPPED) != 0;
        (stopped ? not_free_m : free_m) = radius_m;
    }
    return free_m;
}

// ---- walls --------------------------------------------------------------------------------------

bool is_plain_wall(const Corridor &corridor, double x_m)
{
    return std::none_of(corridor.doors.begin(), corridor.doors.end(), [&](const Door &door) {
        return std::fabs(x_m - door.centre.x_m) < 0.5 * door.width_m + kOpeningMargin;
    });
}

/// The line across the wall, beside the doors, that is most free.
Json wall_json(const HostMap &map, const Corridor &corridor)
{
    Json most_free = {{"p_max", 1.0}};
    for (double x_m = corridor.wall.x0_m; x_m <= corridor.wall.x1_m; x_m += kWallStep[0]) {
        Points line;
        for (double y_m = corridor.wall.y0_m - kOpeningMargin;
             y_m <= corridor.wall.y1_m + kOpeningMargin; y_m += kWallStep[1]) {
            line.push_back({x_m, y_m});
        }
        const std::vector<double> probabilities = map.probabilities(line);
        const double p_max = *std::max_element(probabilities.begin(), probabilities.end());
        if (is_plain_wall(corridor, x_m) && p_max < most_free["p_max"].get<double>()) {
            most_free = {{"p_max", p_max}, {"x_m", x_m}};
        }
    }
    return most_free;
}

// ---- reports ------------------------------------------------------------------------------------

/// Cells around a door, row by row from the lowest y. -1: unknown.
Json picture_json(const Method &method, const Door &door)
{
    const double cell_m = std::max(method.cell_m, kPictureCell);
    const auto cells_to = [&](double half_m) {
        return static_cast<int>(std::ceil(half_m / cell_m));
    };
    const int half_x = cells_to(kPictureHalf[0]), half_y = cells_to(kPictureHalf[1]);
    const gpom_point_t middle = {centre_of_cell(door.centre.x_m, cell_m),
                                 centre_of_cell(door.centre.y_m, cell_m)};
    Points points;
    for (int iy = -half_y; iy <= half_y; ++iy) {
        for (int ix = -half_x; ix <= half_x; ++ix) {
            points.push_back({middle.x_m + ix * cell_m, middle.y_m + iy * cell_m});
        }
    }
    Json cells = Json::array();
    for (const double p : method.ask(points)) {
        cells.push_back(std::isnan(p) ? -1.0 : std::round(p * 1e4) / 1e4);
    }
    return {{"x0_m", middle.x_m - (half_x + 0.5) * cell_m},
            {"y0_m", middle.y_m - (half_y + 0.5) * cell_m},
            {"cell_m", cell_m},
            {"nx", 2 * half_x + 1},
            {"ny", 2 * half_y + 1},
            {"p", cells}};
}

Json door_json(const DoorTrial &trial, const std::vector<Method> &methods, const HostMap &map,
               const Door &door, bool picture)
{
    Json widths = Json::array(), paths = Json::array();
    for (const Method &method : methods) {
        widths.push_back(width_json(method, door, trial.params.p_free));
        if (picture) {
            widths.back()["picture"] = picture_json(method, door);
        }
    }
    for (const double radius_m : kRadii) {
        paths.push_back(path_json(map, door, radius_m, trial.params));
    }
    return {{"width_m", door.width_m}, {"x_m", door.centre.x_m},
            {"y_m", door.centre.y_m},  {"widths", widths},
            {"paths", paths},          {"radius_max_m", radius_max_m(map, door)}};
}

/// Results of the maps after one part of the drive.
Json stage_json(const DoorTrial &trial, const Corridor &corridor,
                std::vector<std::unique_ptr<Maps>> &all, bool picture)
{
    const std::vector<Method> methods = methods_of(all);
    const HostMap &map = all.front()->live;
    Json doors = Json::array();
    for (const Door &door : corridor.doors) {
        doors.push_back(door_json(trial, methods, map, door, picture));
    }
    return {{"doors", doors},
            {"wall", wall_json(map, corridor)},
            {"kept", gpom_map_beam_count(map.get())},
            {"counts", counts_json(map.stats())}};
}

Json run_json(const DoorTrial &trial, std::uint64_t seed, bool picture)
{
    const Corridor corridor = make_corridor(seed);
    CorridorLaser laser = trial.laser;
    laser.seed = seed;
    std::vector<std::unique_ptr<Maps>> all;
    for (const double cell_m : kCells) {
        all.push_back(std::make_unique<Maps>(door_config(trial, corridor.world, cell_m),
                                             trial.live.late_m, cell_m));
    }
    Json obstacles = Json::array();
    for (const Rect &rect : corridor.world.obstacles) {
        obstacles.push_back({rect.x0_m, rect.y0_m, rect.x1_m, rect.y1_m});
    }
    Json run = {{"seed", seed}, {"obstacles_m", obstacles}};
    const std::vector<Scan> scans = scan_corridor(corridor, laser);
    for (std::size_t i = 0; i < scans.size(); ++i) {
        for (const auto &maps : all) {
            maps->insert(scans[i], trial.live.step_ops);
        }
        if (i + 1 == corridor.n_past) {
            run["past"] = stage_json(trial, corridor, all, picture);
        }
    }
    run["through"] = stage_json(trial, corridor, all, picture);
    return run;
}

/// Worst and median of one figure over the runs. `figure` reads it from a run's door.
Json spread_json(const Json &runs, const std::string &stage, std::size_t i_door,
                 const std::function<double(const Json &)> &figure, bool most_is_worst)
{
    std::vector<double> values;
    for (const Json &run : runs) {
        values.push_back(figure(run[stage]["doors"][i_door]));
    }
    std::sort(values.begin(), values.end());
    const double median = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
    return {{"worst", most_is_worst ? values.back() : values.front()}, {"median", median}};
}

Json summary_json(const Json &runs, const std::string &stage, std::size_t i_door)
{
    const Json &first = runs[0][stage]["doors"][i_door];
    Json summary = {{"stage", stage}, {"width_m", first["width_m"]}, {"free_m", Json::array()}};
    for (std::size_t i = 0; i < first["widths"].size(); ++i) {
        Json row = {{"map", first["widths"][i]["map"]}, {"cell_m", first["widths"][i]["cell_m"]}};
        row.update(spread_json(
            runs, stage, i_door, [&](const Json &door) { return door["widths"][i]["free_m"]; },
            false));
        summary["free_m"].push_back(row);
    }
    summary["p_max"] = Json::array();
    for (std::size_t i = 0; i < first["paths"].size(); ++i) {
        Json row = {{"radius_m", first["paths"][i]["radius_m"]}};
        row.update(spread_json(
            runs, stage, i_door, [&](const Json &door) { return door["paths"][i]["p_max"]; },
            true));
        summary["p_max"].push_back(row);
    }
    summary["radius_max_m"] = spread_json(
        runs, stage, i_door, [](const Json &door) { return door["radius_max_m"]; }, false);
    return summary;
}

} // namespace

Json door_report(const DoorTrial &trial)
{
    Json runs = Json::array(), summary = Json::array();
    for (int i = 0; i < trial.n_runs; ++i) {
        runs.push_back(run_json(trial, trial.laser.seed + static_cast<std::uint64_t>(i), i == 0));
    }
    for (const char *const stage : {"past", "through"}) {
        for (std::size_t i_door = 0; i_door < runs[0][stage]["doors"].size(); ++i_door) {
            summary.push_back(summary_json(runs, stage, i_door));
        }
    }
    return {{"free_probability", kFree},
            {"class_free_probability", trial.params.p_free},
            {"noise_m", trial.laser.noise_m},
            {"beams", trial.laser.n_beams},
            {"keep_m", trial.live.keep_m},
            {"summary", summary},
            {"runs", runs}};
}

} // namespace gpom_tools
