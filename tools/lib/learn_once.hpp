// The one hyperparameter that only live maps feel.
#ifndef GPOM_TOOLS_LIB_LEARN_ONCE_HPP
#define GPOM_TOOLS_LIB_LEARN_ONCE_HPP

#include "tools/lib/learn_fit.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Live maps with a noise of hits seen once, and how they did.
struct OnceAttempt {
    double factor; ///< sn2_once / sn2.
    double nll;    ///< Mean over logs and splits.
};

struct OnceFit {
    double factor;                     ///< The chosen one.
    std::vector<OnceAttempt> attempts; ///< 1 among them.
};

/// The noise of hits that scans of one time alone saw (params.h, sn2_once), by live maps of nine
/// returns in ten of whole logs, which the others judge. Where all returns are right it matters
/// little, where some are wrong a greater one saves much: so the greatest of a few multiples of sn2
/// whose NLL is within .5 % of the least. Cost: 28 live maps a log. Throws std::runtime_error or
/// FileError.
OnceFit fit_once(const LearntParams &params, const std::vector<LearnSource> &sources,
                 const DataOptions &options, const Advance &advance);

} // namespace gpom_tools

#endif
