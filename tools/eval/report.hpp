// What gpom-eval says: a table for people, JSON and CSV for programs.
#ifndef GPOM_TOOLS_EVAL_REPORT_HPP
#define GPOM_TOOLS_EVAL_REPORT_HPP

#include "tools/eval/metrics.hpp"
#include "tools/eval/profile.hpp"

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
    std::vector<double> probabilities; ///< At places_of() the test set.
    Metrics all{};
    std::optional<Metrics> near{};     ///< Over the points near a beam; not for logs.
    std::optional<Calibration> band{}; ///< Over those in the band (and near); none has none.
    Profile profile{};
};

/// Measure a method by its probabilities.
MethodResult judged(MethodResult method, const TestSet &test);

/// Methods and metrics, with the figures of the paper's Table I beside them.
std::string report_table(const std::vector<MethodResult> &methods);

/// Mean probability and shares of classes by the offset, three lines a method.
std::string profile_table(const std::vector<MethodResult> &methods, bool across_truth);

/// The same with ROC curves and reliability, and the paper's figures.
nlohmann::ordered_json report_json(const std::vector<MethodResult> &methods);

nlohmann::ordered_json json_of(const Calibration &band);
nlohmann::ordered_json json_of(const Profile &profile);

/// `x,y,truth,near,band` and a probability of each method.
std::string points_csv(const TestSet &test, const std::vector<MethodResult> &methods);

/// `x,y,offset` and a probability of each method.
std::string profile_csv(const TestSet &test, const std::vector<MethodResult> &methods);

} // namespace gpom_tools

#endif
