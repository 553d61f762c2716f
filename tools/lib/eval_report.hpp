// What gpom-eval says: a table for people, JSON and CSV for programs.
#ifndef GPOM_TOOLS_LIB_EVAL_REPORT_HPP
#define GPOM_TOOLS_LIB_EVAL_REPORT_HPP

#include "tools/lib/metrics.hpp"
#include "tools/lib/protocol.hpp"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// One way of mapping and how well it did.
struct MethodResult {
    std::string key;                   ///< Name in files: gp_query, strong_grid, octomap, …
    std::string label;                 ///< Name for people.
    std::string setting;               ///< What was chosen for it, as "0.2 m cells"; or none.
    std::vector<double> probabilities; ///< At the test points.
    Metrics all;
    std::optional<Metrics> near; ///< Over the points near a beam; not for logs.
};

/// Measure a method over all points and, unless near_beam is empty, over those near a beam.
MethodResult judged(MethodResult method, const std::vector<TestPoint> &points,
                    const std::vector<bool> &near_beam);

/// Methods and metrics, with the figures of the paper's Table I beside them.
std::string report_table(const std::vector<MethodResult> &methods);

/// The same with ROC curves and reliability, and the paper's figures.
nlohmann::ordered_json report_json(const std::vector<MethodResult> &methods);

/// `x,y,truth,near` and a probability of each method.
std::string points_csv(const std::vector<TestPoint> &points, const std::vector<bool> &near_beam,
                       const std::vector<MethodResult> &methods);

} // namespace gpom_tools

#endif
