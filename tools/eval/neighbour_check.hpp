// Checks the paper's claim of section III.D: the nearest few beams are enough.
#ifndef GPOM_TOOLS_EVAL_NEIGHBOUR_CHECK_HPP
#define GPOM_TOOLS_EVAL_NEIGHBOUR_CHECK_HPP

#include "tools/eval/report.hpp"
#include "tools/eval/trial.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gpom_tools
{

/// Latent mean and variance, eqs. 2 and 3.
struct DenseMoments {
    double mean;
    double variance;
};

/// Only the model of the paper: kernel, noises, sigmoid and gap are kept, all later parameters get
/// their neutral value.
gpom_params_t plain_params(const gpom_params_t &params);

/// Moments with every beam in every query: all hits and, by eq. 10, the nearest point of each free
/// segment. Uses double precision, one dense Cholesky factorisation for each point, and all cores.
std::vector<DenseMoments> dense_moments(const gpom_params_t &params,
                                        const std::vector<gpom_beam_t> &beams,
                                        const std::vector<gpom_point_t> &points,
                                        gpom_point_t origin);

struct NeighbourRow {
    unsigned n_each; ///< Number of hits and of free segments. 0: all.
    MethodResult method;
    double mean_error_max; ///< Largest difference of latent means from the dense solution.
};

/// Throws with a text of one line if the library refuses one of the numbers of neighbours.
void require_neighbours(const EvalOptions &options, const gpom_params_t &params);

/// Compare the library with each number of neighbours to the dense solution, at the first
/// n_dense_points test points near a beam.
std::vector<NeighbourRow> check_neighbours(const EvalOptions &options, const Trial &trial,
                                           const gpom_params_t &params);

std::string neighbour_table(const std::vector<NeighbourRow> &rows);
nlohmann::ordered_json neighbour_json(const std::vector<NeighbourRow> &rows);

} // namespace gpom_tools

#endif
