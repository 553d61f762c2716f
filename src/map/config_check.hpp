// What a map's configuration must satisfy, apart from its hyperparameters.
#pragma once

#include "gpom/map.h"

namespace gpom
{

/// The first field that is wrong. Only gpom_config_check() has words for it, so that firmware which
/// does not call that carries none.
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

/// Also of a configuration that gpom_config_init() did not fill.
ConfigProblem config_problem(const gpom_config_t &config);

/// Are the numbers of beams and cells ones for which gpom_map_bytes() has an answer?
ConfigProblem capacity_problem(const gpom_config_t &config);

} // namespace gpom
