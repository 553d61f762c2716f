// The rivals of gpom-eval: grids, OctoMap and an exact Gaussian process.
#ifndef GPOM_TOOLS_EVAL_RIVALS_HPP
#define GPOM_TOOLS_EVAL_RIVALS_HPP

#include "tools/eval/report.hpp"
#include "tools/eval/trial.hpp"

#include <nlohmann/json.hpp>

#include <optional>
#include <vector>

namespace gpom_tools
{

struct GridSetup {
    double cell_m;
    GridModel model;
};

struct ChosenGrid {
    GridSetup setup;
    OccupancyGrid grid;
    MethodResult result;
};

/// The two log-odds grids of one trial.
struct LogOddsGrids {
    ChosenGrid thin;
    ChosenGrid wide;
};

/// Each rival gets the setting with the least NLL on the test points themselves (on streets: those
/// near beams). This choice favours the rival. The settings are cell size and sensor model for
/// log-odds grids, and cell size for the strong grid and OctoMap.
LogOddsGrids chosen_grids(const EvalOptions &options, const Trial &trial);
MethodResult judged_strong_grid(const Trial &trial);
MethodResult judged_octomap(const Trial &trial);

/// A grid with widened beams, the chosen sensor model and another cell size.
OccupancyGrid wide_grid_like(const ChosenGrid &chosen, const Trial &trial, double cell_m);

std::vector<double> ask(const OccupancyGrid &grid, const std::vector<gpom_point_t> &points);

/// The chosen settings, as `grid` and `wide_grid`.
nlohmann::ordered_json grid_constants(const LogOddsGrids &grids);

/// Empty if scikit-learn is not installed.
std::optional<MethodResult> judged_exact_gp(const Trial &trial);

} // namespace gpom_tools

#endif
