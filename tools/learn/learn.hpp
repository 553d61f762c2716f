// What gpom-learn does: from options to learnt parameters, for its command line and for Python.
#ifndef GPOM_TOOLS_LEARN_LEARN_HPP
#define GPOM_TOOLS_LEARN_LEARN_HPP

#include "tools/learn/lml.hpp"
#include "tools/learn/report.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// The options of gpom-learn; its --help explains each.
struct LearnOptions {
    std::vector<std::string> scans_paths, truth_paths;
    std::vector<std::vector<Scan>> scans; ///< Logs in memory, in place of scans_paths.
    std::string command; ///< How the parameters were learnt, for the comment of their file.
    std::string kernel = "all";
    std::string method = "lobo";
    std::string fixed;
    std::optional<std::string> model; ///< Absent: full. With --method lml: paper.
    std::uint64_t seed = 0;
    std::optional<double> fraction; ///< Absent: a live map of a log, or all beams of a street.
    double free_weight = 1.0;
    std::optional<std::uint64_t> training_of;
    LiveConfig live;
    std::optional<std::size_t> n_points;
    ReadOptions reading;
    double first_m = 0.0;
    double ell_max_m = 12.0;
    int n_hits = 8;
    int n_free = 8;
    bool composite = false;
};

bool is_street(const LearnOptions &options);

/// True if the parameters are for a live map of a log. That is the case unless a fraction is given.
bool is_live(const LearnOptions &options);

/// The options after checking, so that errors are reported before long files are read.
struct LearnPlan {
    std::vector<LearnSource> sources;
    DataOptions data;
    std::vector<gpom_kernel_t> kernels;
    FitOptions fitting;
    LmlOptions lml;
    bool by_lml, is_live;
};

/// Throws std::runtime_error, which names the option.
LearnPlan plan_of(const LearnOptions &options);

/// One sentence that says which maps the parameters fit. Other maps need parameters of their own.
std::string map_learnt_for(const LearnOptions &options);

struct LearnOutcome {
    std::vector<JudgedFit> fits;
    std::size_t i_best; ///< The kernel with the least NLL on held-out places.
    std::string how_held_out;
    std::vector<std::string> warnings; ///< Parameters that ended at the edge of their search.
    std::string comment;               ///< For the head of a parameters file.

    const LearntParams &params() const { return fits[i_best].fit.params; }
};

/// Learn, with a progress bar on a terminal. Throws std::runtime_error or FileError.
LearnOutcome learn(const LearnOptions &options);

} // namespace gpom_tools

#endif
