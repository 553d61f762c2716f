// What gpom-learn tells: fits, parameters, held-out figures.
#ifndef GPOM_TOOLS_LEARN_REPORT_HPP
#define GPOM_TOOLS_LEARN_REPORT_HPP

#include "tools/learn/fit.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// A kernel's fit and how it does on held-out places.
struct JudgedFit {
    Fit fit;
    Metrics held_out;
};

/// The attempts of every fit, a line each.
std::string attempts_table(const std::vector<JudgedFit> &fits);

/// Fit and held-out figures, a kernel a line, the chosen one marked.
std::string figures_table(const std::vector<JudgedFit> &fits, std::size_t i_best);

/// The head of a parameters file: how it was learnt, figures, prior probability.
std::string params_comment(const JudgedFit &best, const std::string &command,
                           const std::string &how_learnt, const std::string &how_held_out);

} // namespace gpom_tools

#endif
