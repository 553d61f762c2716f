// What gpom-eval does: judges the library's map and its rivals by one trial. For its command line
// and for Python.
#ifndef GPOM_TOOLS_EVAL_EVALUATE_HPP
#define GPOM_TOOLS_EVAL_EVALUATE_HPP

#include "tools/eval/neighbour_check.hpp"
#include "tools/eval/rivals.hpp"
#include "tools/map/host_map.hpp"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// All results, and notes on what was left out and why.
struct Outcome {
    std::vector<MethodResult> methods;
    nlohmann::ordered_json grids; ///< The cell sizes chosen for the log-odds grids.
    std::optional<LogOddsGrids> log_odds;
    double prior_variance = 0.0; ///< Prior variance of the first method's map.
    std::vector<NeighbourRow> neighbours;
    std::vector<std::string> notes;
};

/// A map with its origin in the middle of the drive. In the map frame the resolution falls with the
/// distance from the origin, so this choice favours the paper's map. In the query frame the origin
/// does not matter.
HostMap map_of(const Trial &trial, const gpom_params_t &params);

/// Judge all methods. Throws std::runtime_error or FileError.
Outcome evaluate(const EvalOptions &options, const Trial &trial);

/// Everything that is known about the outcome: the contents of eval.json.
nlohmann::ordered_json eval_json(const EvalOptions &options, const Trial &trial,
                                 const Outcome &outcome);

} // namespace gpom_tools

#endif
