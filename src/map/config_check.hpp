// Checks of a map's configuration. gpom_params_check() checks the hyperparameters in it.
#pragma once

#include "gpom/map.h"

namespace gpom
{

/// The first field that is wrong. Only gpom_config_check() holds the texts, so firmware that does
/// not call gpom_config_check() does not contain them.
enum class ConfigProblem : uint8_t {
    none,
    struct_bytes,
    beam_max,
    cells,
    walk_max,
    keep_m,
    far_m,
    old_s,
    rebase_m,
    rebase_frame,
    clear_scans,
    clear_keep,
    origin,
    lowres_reach_m,
    lowres_unknown,
    focus_alone,
    focus_small,
    lowres_sides,
    lowres_cell_m,
    lowres_rolling,
    lowres_corner
};

/// The first problem of a configuration, which may be one that gpom_config_init() did not fill.
ConfigProblem config_problem(const gpom_config_t &config);

/// The first problem of the numbers of beams and cells. none: gpom_map_bytes() has an answer.
ConfigProblem capacity_problem(const gpom_config_t &config);

} // namespace gpom
