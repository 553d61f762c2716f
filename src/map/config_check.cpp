#include "src/map/config_check.hpp"

#include "src/base/check.hpp"
#include "src/raster/lowres.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// Least keep_m other than 0 [m]. Places are not known better than this, and the square of a far
/// smaller keep_m would be rounded to zero.
constexpr float kKeepMin_m = 1e-3f;

/// Limits of a low-resolution cell's side, and of the coordinates of the raster's corner [m].
constexpr double kCellMin_m = 1e-3;
constexpr double kCellMax_m = 1e6;
constexpr double kCornerMax_m = 1e12;

constexpr auto kReach_m = static_cast<float>(GPOM_REACH_M);

/// Fields that must be from 0 to a limit.
constexpr struct {
    float gpom_config_t::*field;
    float most;
    ConfigProblem problem;
} kLimits[] = {{&gpom_config_t::keep_m, kReach_m, ConfigProblem::keep_m},
               {&gpom_config_t::far_m, kReach_m, ConfigProblem::far_m},
               {&gpom_config_t::old_s, FLT_MAX, ConfigProblem::old_s},
               {&gpom_config_t::rebase_m, 0.5f * kReach_m, ConfigProblem::rebase_m},
               {&gpom_config_t::lowres_reach_m, kReach_m, ConfigProblem::lowres_reach_m},
               {&gpom_config_t::lowres_unknown, 1.0f, ConfigProblem::lowres_unknown}};

double magnitude(double x) { return x < 0.0 ? -x : x; }

/// True if the origin is so near to zero that all cells within reach of it have numbers. The same
/// for each axis.
bool has_cell_numbers(double origin_m, double cell_m)
{
    return (magnitude(origin_m) + 2.0 * GPOM_REACH_M) / cell_m <= kCellNumberMax;
}

ConfigProblem limit_problem(const gpom_config_t &config)
{
    for (const auto &limit : kLimits) {
        if (!is_between(config.*limit.field, 0.0f, limit.most)) {
            return limit.problem;
        }
    }
    return ConfigProblem::none;
}

/// The first problem of the fields that decide which beams are kept.
ConfigProblem keeping_problem(const gpom_config_t &config)
{
    if (config.keep_m < kKeepMin_m && config.keep_m != 0.0f) {
        return ConfigProblem::keep_m;
    }
    if (config.rebase_m > 0.0f && config.params.frame == GPOM_FRAME_MAP) {
        return ConfigProblem::rebase_frame; // answers would depend on the place of the origin
    }
    if (config.clear_scans > 4 || config.clear_scans == 1) {
        return ConfigProblem::clear_scans;
    }
    return config.clear_scans > 0 && config.keep_m == 0.0f ? ConfigProblem::clear_keep
                                                           : ConfigProblem::none;
}

/// The first problem of the fields of the low-resolution map.
ConfigProblem lowres_problem(const gpom_config_t &config)
{
    if (config.lowres_nx == 0 && config.lowres_ny == 0) {
        return config.focus_cell_max == 0 ? ConfigProblem::none : ConfigProblem::focus_alone;
    }
    if (config.focus_cell_max > 0 && config.focus_cell_max < kFocusCellsMin) {
        return ConfigProblem::focus_small;
    }
    if (config.lowres_nx == 0 || config.lowres_ny == 0) {
        return ConfigProblem::lowres_sides;
    }
    if (!is_between(config.lowres_cell_m, kCellMin_m, kCellMax_m)) {
        return ConfigProblem::lowres_cell_m;
    }
    if (config.lowres_rolling != 0) {
        return has_cell_numbers(config.origin_x_m, config.lowres_cell_m) &&
                       has_cell_numbers(config.origin_y_m, config.lowres_cell_m)
                   ? ConfigProblem::none
                   : ConfigProblem::lowres_rolling;
    }
    return is_within(config.lowres_x0_m, kCornerMax_m) &&
                   is_within(config.lowres_y0_m, kCornerMax_m)
               ? ConfigProblem::none
               : ConfigProblem::lowres_corner;
}

/// The texts of gpom_config_check().
constexpr struct {
    ConfigProblem problem;
    const char *text;
} kTexts[] = {
    {ConfigProblem::struct_bytes,
     "struct_bytes: the configuration is not from gpom_config_init() of this library"},
    {ConfigProblem::beam_max,
     "beam_max: must be from 1 to 20000000, and the map must fit the address space"},
    {ConfigProblem::cells, "lowres_nx, lowres_ny, focus_cell_max: together at most 268435456 "
                           "cells, and the map must fit the address space"},
    {ConfigProblem::walk_max, "walk_max: at least 1"},
    {ConfigProblem::keep_m, "keep_m: must be 0, or from 0.001 to 8000"},
    {ConfigProblem::far_m, "far_m: must be from 0 to 8000"},
    {ConfigProblem::old_s, "old_s: must be 0 or more, and finite"},
    {ConfigProblem::rebase_m, "rebase_m: must be from 0 to 4000"},
    {ConfigProblem::rebase_frame, "rebase_m: must be 0 in the map frame"},
    {ConfigProblem::clear_scans, "clear_scans: must be 0, or from 2 to 4"},
    {ConfigProblem::clear_keep, "clear_scans: must be 0 while keep_m is 0"},
    {ConfigProblem::origin, "origin_x_m, origin_y_m: must be from -1e8 to 1e8"},
    {ConfigProblem::lowres_reach_m, "lowres_reach_m: must be from 0 to 8000"},
    {ConfigProblem::lowres_unknown, "lowres_unknown: must be from 0 to 1"},
    {ConfigProblem::focus_alone, "focus_cell_max: must be 0 without coarse cells"},
    {ConfigProblem::focus_small, "focus_cell_max: must be 0, or at least 4"},
    {ConfigProblem::lowres_sides, "lowres_nx, lowres_ny: both must be 0, or neither"},
    {ConfigProblem::lowres_cell_m, "lowres_cell_m: must be from 0.001 to 1e6"},
    {ConfigProblem::lowres_rolling,
     "lowres_rolling: the origin is over 1e9 cells from 0; make lowres_cell_m larger"},
    {ConfigProblem::lowres_corner, "lowres_x0_m, lowres_y0_m: must be from -1e12 to 1e12"}};

const char *text_of(ConfigProblem problem)
{
    for (const auto &row : kTexts) {
        if (row.problem == problem) {
            return row.text;
        }
    }
    return nullptr;
}

} // namespace

ConfigProblem capacity_problem(const gpom_config_t &config)
{
    const uint64_t n_cells = lowres_cell_count(config);
    if (n_cells > GPOM_CELL_MAX) {
        return ConfigProblem::cells;
    }
    return config.beam_max >= 1 && config.beam_max <= GPOM_BEAM_MAX &&
                   4096 + 62 * uint64_t{config.beam_max} + 8 * n_cells <= SIZE_MAX // for 32 bits
               ? ConfigProblem::none
               : ConfigProblem::beam_max;
}

ConfigProblem config_problem(const gpom_config_t &config)
{
    if (config.struct_bytes != sizeof(gpom_config_t)) {
        return ConfigProblem::struct_bytes;
    }
    ConfigProblem problem = capacity_problem(config);
    if (problem == ConfigProblem::none && config.walk_max < 1) {
        problem = ConfigProblem::walk_max;
    }
    if (problem == ConfigProblem::none) {
        problem = limit_problem(config);
    }
    if (problem == ConfigProblem::none) {
        problem = keeping_problem(config);
    }
    if (problem == ConfigProblem::none && !(is_within(config.origin_x_m, GPOM_PLACE_MAX_M) &&
                                            is_within(config.origin_y_m, GPOM_PLACE_MAX_M))) {
        problem = ConfigProblem::origin;
    }
    return problem == ConfigProblem::none ? lowres_problem(config) : problem;
}

} // namespace gpom

gpom_status_t gpom_config_check(const gpom_config_t *config, const char **problem)
{
    if (problem != nullptr) {
        *problem = nullptr;
    }
    if (config == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::ConfigProblem found = gpom::config_problem(*config);
    if (found == gpom::ConfigProblem::none) {
        return gpom_params_check(&config->params, problem);
    }
    if (problem != nullptr) {
        *problem = gpom::text_of(found);
    }
    return GPOM_ERR_ARG;
}
