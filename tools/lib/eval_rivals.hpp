// The rivals of gpom-eval: grids, OctoMap, an exact Gaussian process.
#ifndef GPOM_TOOLS_LIB_EVAL_RIVALS_HPP
#define GPOM_TOOLS_LIB_EVAL_RIVALS_HPP

#include "tools/lib/eval_report.hpp"
#include "tools/lib/eval_trial.hpp"

#include <nlohmann/json.hpp>

#include <optional>
#include <vector>

namespace gpom_tools
{

/// Both log-odds grids of one trial.
struct LogOddsGrids {
    OccupancyGrid thin;
    OccupancyGrid wide;
};

LogOddsGrids log_odds_grids(const EvalOptions &options, const Trial &trial);
std::vector<MethodResult> judged_grids(const LogOddsGrids &grids, const Trial &trial);
std::vector<double> ask(const OccupancyGrid &grid, const std::vector<gpom_point_t> &points);

/// Constants of both grids, as `grid` and `wide_grid`.
nlohmann::ordered_json grid_constants(const EvalOptions &options, const Trial &trial);

/// Of several cell sizes the one with the least NLL on the very test points (near beams on
/// streets): the choice favours the rival.
MethodResult judged_strong_grid(const Trial &trial);
MethodResult judged_octomap(const Trial &trial);

/// None if scikit-learn is not installed.
std::optional<MethodResult> judged_exact_gp(const Trial &trial);

} // namespace gpom_tools

#endif
