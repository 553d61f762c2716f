// Counters of scans and beams, as JSON.
#ifndef GPOM_TOOLS_LIVE_REPORT_HPP
#define GPOM_TOOLS_LIVE_REPORT_HPP

#include "gpom/map.h"

#include <nlohmann/json.hpp>

namespace gpom_tools
{

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
