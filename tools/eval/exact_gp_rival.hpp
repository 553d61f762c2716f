// Runs scikit-learn's exact Gaussian process regression in a separate process.
#ifndef GPOM_TOOLS_EVAL_EXACT_GP_RIVAL_HPP
#define GPOM_TOOLS_EVAL_EXACT_GP_RIVAL_HPP

#include "tools/eval/occupancy_grid.hpp"

#include <optional>
#include <vector>

namespace gpom_tools
{

/// Exit code of exact-gp if scikit-learn is not installed.
constexpr int kExactGpMissing = 3;

/// Run `exact-gp BEAMS.csv POINTS.csv OUT.csv`. The script must be in the folder of the running
/// program. Empty: scikit-learn or the script is not installed. Throws std::runtime_error on other
/// failures.
std::optional<std::vector<double>> exact_gp_probabilities(const std::vector<GridBeam> &beams,
                                                          const std::vector<gpom_point_t> &points);

} // namespace gpom_tools

#endif
