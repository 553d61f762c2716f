#include "tools/eval/rivals.hpp"

#include "tools/eval/exact_gp_rival.hpp"
#include "tools/eval/octomap_rival.hpp"
#include "tools/eval/strong_grid.hpp"
#include "tools/map/host_map.hpp"
#include "tools/map/raster_csv.hpp"

#include <algorithm>
#include <utility>

namespace gpom_tools
{
namespace
{

constexpr double kGridMargin = 2.0; ///< Margin for test points behind the outermost returns [m].

/// Sensor models that are tried for the log-odds grids. OctoMap's constants come first. The others
/// were chosen from 90 models (p_hit 0.6 to 0.95, p_miss 0.05 to 0.45, clamps from OctoMap's to
/// 0.001, 0.999). With these few models, the NLL of five logs at shares of 0.04, 0.25 and 0.9 is
/// within 0.003 of the best of all models in the mean, and within 0.014 at worst. The NLL of
/// streets 0 to 2 near beams is within 0.004. OctoMap's constants alone are worse by 0.036 (thin)
/// and 0.026 (wide) on logs, and by 0.11 and 0.13 on streets.
constexpr GridModel kModels[] = {{},
                                 {0.7, 0.45, 0.12, 0.97},
                                 {0.8, 0.3, 0.12, 0.97},
                                 {0.8, 0.4, 0.02, 0.98},
                                 {0.9, 0.45, 0.02, 0.98},
                                 {0.95, 0.3, 0.02, 0.98},
                                 {0.7, 0.1, 0.001, 0.999}};

/// Cell sizes of all grids and of OctoMap, and blurs of the strong grid [m].
struct RivalSettings {
    std::vector<double> cells_m, sigmas_m;
};

/// Finer cells are not better. NLL of the strong grid with cells of 0.05 / 0.025 m: intel .137 /
/// .136 at a share of 0.9, campus-west .391 / .432 at 0.04 (.379 with 0.1 m). Streets 0 to 2 with
/// cells of 0.05 m: .52, .50, .53. With the best cells: .40, .37, .40.
RivalSettings rival_settings(const Trial &trial)
{
    if (trial.truth) {
        return {{0.1, 0.2, 0.5, 1.0, 1.5, 2.0}, {0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0}};
    }
    return {{0.05, 0.1, 0.2, 0.3, 0.5}, {0.025, 0.035, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5}};
}

nlohmann::ordered_json json_of(const GridSetup &setup)
{
    return {{"cell_m", setup.cell_m},
            {"p_hit", setup.model.p_hit},
            {"p_miss", setup.model.p_miss},
            {"p_min", setup.model.p_min},
            {"p_max", setup.model.p_max}};
}

std::string text_of(const GridSetup &setup)
{
    std::string text;
    append_text(text, "%g m cells, p_hit %g, p_miss %g, clamps %g and %g", setup.cell_m,
                setup.model.p_hit, setup.model.p_miss, setup.model.p_min, setup.model.p_max);
    return text;
}

OccupancyGrid grid_of(const Trial &trial, const GridSetup &setup, bool wide)
{
    OccupancyGrid grid(raster_over(trial.low, trial.high, setup.cell_m, kGridMargin), setup.model);
    for (const GridBeam &beam : trial.beams) {
        wide ? grid.insert_wide(beam) : grid.insert_thin(beam);
    }
    return grid;
}

template <class Map>
MethodResult judged_map(MethodResult method, const Map &map, const Trial &trial)
{
    for (const gpom_point_t &place : places_of(trial.test)) {
        method.probabilities.push_back(map.probability(place));
    }
    return judged(std::move(method), trial.test);
}

double nll_of(const MethodResult &method)
{
    return method.near ? method.near->nll : method.all.nll;
}

/// Keep the better result. Of equal results, keep the first.
void keep_best(std::optional<MethodResult> &best, MethodResult tried)
{
    if (!best || nll_of(tried) < nll_of(*best)) {
        best = std::move(tried);
    }
}

ChosenGrid chosen_grid(const EvalOptions &options, const Trial &trial, bool wide)
{
    const std::vector<double> cells_m = options.grid_cell_m
                                            ? std::vector<double>{*options.grid_cell_m}
                                            : rival_settings(trial).cells_m;
    std::optional<ChosenGrid> best;
    for (const double cell_m : cells_m) {
        for (const GridModel &model : kModels) {
            const GridSetup setup{cell_m, model};
            OccupancyGrid grid = grid_of(trial, setup, wide);
            MethodResult result =
                judged_map({wide ? "wide_grid" : "grid",
                            wide ? "occupancy grid, widened beams" : "occupancy grid",
                            text_of(setup),
                            {}},
                           grid, trial);
            if (!best || nll_of(result) < nll_of(best->result)) {
                best = ChosenGrid{setup, std::move(grid), std::move(result)};
            }
        }
    }
    return std::move(*best);
}

} // namespace

LogOddsGrids chosen_grids(const EvalOptions &options, const Trial &trial)
{
    return {chosen_grid(options, trial, false), chosen_grid(options, trial, true)};
}

OccupancyGrid wide_grid_like(const ChosenGrid &chosen, const Trial &trial, double cell_m)
{
    return grid_of(trial, {cell_m, chosen.setup.model}, true);
}

std::vector<double> ask(const OccupancyGrid &grid, const std::vector<gpom_point_t> &points)
{
    std::vector<double> probabilities;
    for (const gpom_point_t &point : points) {
        probabilities.push_back(grid.probability(point));
    }
    return probabilities;
}

nlohmann::ordered_json grid_constants(const LogOddsGrids &grids)
{
    return {{"grid", json_of(grids.thin.setup)}, {"wide_grid", json_of(grids.wide.setup)}};
}

MethodResult judged_strong_grid(const Trial &trial)
{
    const RivalSettings settings = rival_settings(trial);
    std::optional<MethodResult> best;
    for (const double cell_m : settings.cells_m) {
        const gpom_raster_t raster = raster_over(trial.low, trial.high, cell_m, kGridMargin);
        const StrongGrid grid(trial.beams, raster, settings.sigmas_m);
        std::string setting;
        append_text(setting, "%g m cells, blur %g m", cell_m, grid.sigma_m());
        keep_best(best, judged_map({"strong_grid", "strong grid", setting, {}}, grid, trial));
    }
    return std::move(*best);
}

MethodResult judged_octomap(const Trial &trial)
{
    std::optional<MethodResult> best;
    for (const double cell_m : rival_settings(trial).cells_m) {
        OctomapRival map(cell_m, middle_of(trial.scans));
        map.insert(trial.scans);
        std::string setting;
        append_text(setting, "%g m cells", cell_m);
        keep_best(best, judged_map({"octomap", "OctoMap", setting, {}}, map, trial));
    }
    return std::move(*best);
}

std::optional<MethodResult> judged_exact_gp(const Trial &trial)
{
    auto probabilities = exact_gp_probabilities(trial.beams, places_of(trial.test));
    if (!probabilities) {
        return std::nullopt;
    }
    return judged({"exact_gp", "exact GP, scikit-learn", "", std::move(*probabilities)},
                  trial.test);
}

} // namespace gpom_tools
