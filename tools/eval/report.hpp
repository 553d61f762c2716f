// Output of gpom-eval: a table for people, JSON and CSV for programs.
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

/// A mapping method and its results.
struct MethodResult {
    std::string key;                   ///< Name in files: gp_query, strong_grid, octomap, …
    std::string label;                 ///< Name for people.
    std::string setting;               ///< Settings chosen for it, for example "0.2 m cells".
                                       ///< Empty: none.
    std::vector<double> probabilities; ///< At places_of() of the test set.
    Metrics all{};
    std::optional<Metrics> near{};     ///< For the points near a beam. Empty for logs.
    std::optional<Calibration> band{}; ///< For the points in the band (and near a beam). Empty:
                                       ///< there are none.
    Profile profile{};
};

/// Measure a method by its probabilities.
MethodResult judged(MethodResult method, const TestSet &test);

/// Methods and metrics, together with the figures of the paper's Table I.
std::string report_table(const std::vector<MethodResult> &methods);

/// Mean probability and shares of classes for each offset, three lines a method.
std::string profile_table(const std::vector<MethodResult> &methods, bool across_truth);

/// The contents of the table, with ROC curves, reliability and the paper's figures.
nlohmann::ordered_json report_json(const std::vector<MethodResult> &methods);

nlohmann::ordered_json json_of(const Calibration &band);
nlohmann::ordered_json json_of(const Profile &profile);

/// Lines `x,y,truth,near,band` with the probability of each method.
std::string points_csv(const TestSet &test, const std::vector<MethodResult> &methods);

/// Lines `x,y,offset` with the probability of each method.
std::string profile_csv(const TestSet &test, const std::vector<MethodResult> &methods);

} // namespace gpom_tools

#endif
