// Do the nearest few beams suffice? The paper's claim, section III.D, measured.
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

/// The model of the paper alone: kernel, noises, sigmoid and gap are kept, every later addition
/// gets its neutral value.
gpom_params_t plain_params(const gpom_params_t &params);

/// Every beam takes part in every query: all hits and, eq. 10, each free segment's nearest point;
/// in double precision by a dense Cholesky factor of its own for each point, on all cores.
std::vector<DenseMoments> dense_moments(const gpom_params_t &params,
                                        const std::vector<gpom_beam_t> &beams,
                                        const std::vector<gpom_point_t> &points,
                                        gpom_point_t origin);

struct NeighbourRow {
    unsigned n_each; ///< Hits, and as many free segments; 0: all.
    MethodResult method;
    double mean_error_max; ///< Largest difference of latent means from the dense one.
};

/// Throws in one line if the library does not take one of the numbers of neighbours.
void require_neighbours(const EvalOptions &options, const gpom_params_t &params);

/// The library with each number of neighbours against the dense solution, at the first
/// n_dense_points test points near a beam.
std::vector<NeighbourRow> check_neighbours(const EvalOptions &options, const Trial &trial,
                                           const gpom_params_t &params);

std::string neighbour_table(const std::vector<NeighbourRow> &rows);
nlohmann::ordered_json neighbour_json(const std::vector<NeighbourRow> &rows);

} // namespace gpom_tools

#endif
