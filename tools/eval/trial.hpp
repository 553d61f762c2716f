// What gpom-eval is asked, and the data it then judges all methods by.
#ifndef GPOM_TOOLS_EVAL_TRIAL_HPP
#define GPOM_TOOLS_EVAL_TRIAL_HPP

#include "tools/eval/profile.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

struct EvalOptions {
    std::string scans_path;
    std::string truth_path; ///< Of streets; none for logs.
    std::string params_path;
    std::string map_frame_path;
    std::vector<std::string> also_paths; ///< More parameters, each a row of its own.
    std::string out_path;
    std::string json_path;
    std::string command;
    std::string split = "beams"; ///< Or "runs".
    bool rivals = true;
    bool exact_gp = false;
    std::vector<unsigned> neighbours; ///< Counts of hits, and as many free segments.
    std::size_t n_dense_points = 2000;
    std::size_t n_points = 20000;
    std::uint64_t seed = 0;
    std::optional<double> grid_cell_m; ///< For both log-odds grids; none: the best for each.
    ReadOptions reading;
    double fraction = 0.04;
    double beam_width_deg = 2.0;
    double after_m = 0.0; ///< Leave out this much of the way, for learning.
};

/// What all methods get, and what they are judged by.
struct Trial {
    std::string mode;
    std::vector<Scan> scans;           ///< Make the maps.
    std::vector<GridBeam> beams;       ///< The same as single beams.
    std::vector<GridBeam> other_beams; ///< Held out; none on streets.
    TestSet test;
    std::optional<Truth> truth;  ///< Of streets.
    gpom_point_t low{0.0, 0.0};  ///< Corner of the area of grids and pictures.
    gpom_point_t high{0.0, 0.0}; ///< The opposite corner.
};

Trial street_trial(const EvalOptions &options);
Trial log_trial(const EvalOptions &options);

} // namespace gpom_tools

#endif
