// scikit-learn's exact Gaussian process regression, asked in a process of its own.
#ifndef GPOM_TOOLS_EVAL_EXACT_GP_RIVAL_HPP
#define GPOM_TOOLS_EVAL_EXACT_GP_RIVAL_HPP

#include "tools/eval/occupancy_grid.hpp"

#include <optional>
#include <vector>

namespace gpom_tools
{

/// Exit code of exact-gp where scikit-learn is not installed.
constexpr int kExactGpMissing = 3;

/// Runs `exact-gp BEAMS.csv POINTS.csv OUT.csv`, which is expected beside the running program.
/// None if scikit-learn, or the script itself, is not installed. Throws std::runtime_error if it
/// fails otherwise.
std::optional<std::vector<double>> exact_gp_probabilities(const std::vector<GridBeam> &beams,
                                                          const std::vector<gpom_point_t> &points);

} // namespace gpom_tools

#endif
