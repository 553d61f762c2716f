// Accuracy and counters of a live map, as JSON.
#ifndef GPOM_TOOLS_LIVE_REPORT_HPP
#define GPOM_TOOLS_LIVE_REPORT_HPP

#include "tools/eval/report.hpp"
#include "tools/map/host_map.hpp"

#include <nlohmann/json.hpp>

namespace gpom_tools
{

/// Kept beams and main metrics.
inline nlohmann::ordered_json accuracy_of(const HostMap &map, const TestSet &test)
{
    MethodResult method;
    method.probabilities = map.probabilities(places_of(test));
    const Metrics metrics = judged(std::move(method), test).all;
    return {{"kept", gpom_map_beam_count(map.get())},
            {"auc", metrics.auc},
            {"fp_at_tp95", metrics.false_positive_rate},
            {"nll", metrics.nll},
            {"ece", metrics.calibration_error}};
}

/// Every counter, under its name in gpom_stats_t.
inline nlohmann::ordered_json counts_json(const gpom_stats_t &stats)
{
    return {{"scans_inserted", stats.scans_inserted},
            {"scans_bad_pose", stats.scans_bad_pose},
            {"scans_out_of_reach", stats.scans_out_of_reach},
            {"beams_hit", stats.beams_hit},
            {"beams_no_return", stats.beams_no_return},
            {"beams_nan", stats.beams_nan},
            {"beams_not_positive", stats.beams_not_positive},
            {"beams_too_near", stats.beams_too_near},
            {"beams_masked", stats.beams_masked},
            {"beams_known", stats.beams_known},
            {"beams_contradicting", stats.beams_contradicting},
            {"beams_redundant", stats.beams_redundant},
            {"beams_ids_spent", stats.beams_ids_spent},
            {"beams_evicted_redundant", stats.beams_evicted_redundant},
            {"beams_evicted_far", stats.beams_evicted_far},
            {"beams_evicted_old", stats.beams_evicted_old},
            {"beams_evicted_contradicted", stats.beams_evicted_contradicted},
            {"beams_not_confirmed", stats.beams_not_confirmed},
            {"hits_cleared", stats.hits_cleared},
            {"beams_forgotten", stats.beams_forgotten},
            {"free_cleared", stats.free_cleared},
            {"cells_cut", stats.cells_cut}};
}

} // namespace gpom_tools

#endif
