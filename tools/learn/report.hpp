// Output of gpom-learn: fits, parameters, figures on held-out places.
#ifndef GPOM_TOOLS_LEARN_REPORT_HPP
#define GPOM_TOOLS_LEARN_REPORT_HPP

#include "tools/learn/fit.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// A kernel's fit and its result on held-out places.
struct JudgedFit {
    Fit fit;
    Metrics held_out;
};

/// The attempts of all fits, one line each.
std::string attempts_table(const std::vector<JudgedFit> &fits);

/// Figures of the fit and of held-out places, one line for each kernel. The chosen kernel is
/// marked.
std::string figures_table(const std::vector<JudgedFit> &fits, std::size_t i_best);

/// The head of a parameters file: how the parameters were learnt, figures, prior probability.
std::string params_comment(const JudgedFit &best, const std::string &command,
                           const std::string &how_learnt, const std::string &how_held_out);

} // namespace gpom_tools

#endif
