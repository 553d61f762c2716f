// The rivals of gpom-eval: grids, OctoMap, an exact Gaussian process.
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

/// Both log-odds grids of one trial.
struct LogOddsGrids {
    ChosenGrid thin;
    ChosenGrid wide;
};

/// Of several settings each rival has the one with the least NLL on the very test points (near
/// beams on streets): the choice favours the rival. Log-odds grids: cell and sensor model; strong
/// grid and OctoMap: cell.
LogOddsGrids chosen_grids(const EvalOptions &options, const Trial &trial);
MethodResult judged_strong_grid(const Trial &trial);
MethodResult judged_octomap(const Trial &trial);

/// Widened beams in other cells, with the sensor model that was chosen.
OccupancyGrid wide_grid_like(const ChosenGrid &chosen, const Trial &trial, double cell_m);

std::vector<double> ask(const OccupancyGrid &grid, const std::vector<gpom_point_t> &points);

/// What was chosen, as `grid` and `wide_grid`.
nlohmann::ordered_json grid_constants(const LogOddsGrids &grids);

/// None if scikit-learn is not installed.
std::optional<MethodResult> judged_exact_gp(const Trial &trial);

} // namespace gpom_tools

#endif
