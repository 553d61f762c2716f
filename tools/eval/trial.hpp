// Options of gpom-eval, and the data by which it judges all methods.
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
    std::string truth_path; ///< For streets. Empty for logs.
    std::string params_path;
    std::string map_frame_path;
    std::vector<std::string> also_paths; ///< More parameter files. Each gets a row of its own.
    std::string out_path;
    std::string json_path;
    std::string command;
    std::string split = "beams"; ///< "beams" or "runs".
    bool rivals = true;
    bool exact_gp = false;
    std::vector<unsigned> neighbours; ///< Numbers of hits, used for free segments, too.
    std::size_t n_dense_points = 2000;
    std::size_t n_points = 20000;
    std::uint64_t seed = 0;
    std::optional<double> grid_cell_m; ///< For both log-odds grids. Empty: the best one for each.
    ReadOptions reading;
    double fraction = 0.04;
    double beam_width_deg = 2.0;
    double after_m = 0.0; ///< Leave out this first part of the way, which was used for learning.
};

/// The data that all methods get, and the data that judge them.
struct Trial {
    std::string mode;
    std::vector<Scan> scans;           ///< The scans that make the maps.
    std::vector<GridBeam> beams;       ///< The beams of these scans.
    std::vector<GridBeam> other_beams; ///< Held-out beams. Empty on streets.
    TestSet test;
    std::optional<Truth> truth;  ///< For streets.
    gpom_point_t low{0.0, 0.0};  ///< Corner of the area of grids and pictures.
    gpom_point_t high{0.0, 0.0}; ///< The opposite corner.
};

Trial street_trial(const EvalOptions &options);
Trial log_trial(const EvalOptions &options);

/// The same with scans in memory instead of those of options.scans_path.
Trial street_trial(const EvalOptions &options, std::vector<Scan> scans);
Trial log_trial(const EvalOptions &options, std::vector<Scan> scans);

} // namespace gpom_tools

#endif
