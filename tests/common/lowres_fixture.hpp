/// \file lowres_fixture.hpp
/// A map with rasters, its work in slices, and what its cells must hold: the query, rounded.
#pragma once

#include "src/map/map.hpp"
#include "src/refresh/lowres_step.hpp"
#include "tests/common/reference.hpp"

namespace reference
{

/// A fixed raster of nx x ny cells about the yard, and a focus.
inline gpom_config_t lowres_config(std::uint16_t nx = 44, std::uint16_t ny = 30,
                                   double cell_m = 1.0)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12));
    config.lowres_cell_m = cell_m;
    config.lowres_nx = nx;
    config.lowres_ny = ny;
    config.lowres_x0_m = 6.3 - 0.5 * nx * cell_m;
    config.lowres_y0_m = 0.2 - 0.5 * ny * cell_m;
    config.focus_cell_max = 900;
    return config;
}

/// The same raster, following the robot.
inline gpom_config_t rolling_config(std::uint16_t nx = 44, std::uint16_t ny = 30,
                                    double cell_m = 1.0)
{
    gpom_config_t config = lowres_config(nx, ny, cell_m);
    config.lowres_rolling = 1;
    return config;
}

/// One slice of work, in scratch of the exact size between canaries.
inline std::uint64_t step(gpom_map_t *map, std::uint64_t budget)
{
    GuardedMemory memory(gpom_scratch_bytes(map), 1);
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    const std::uint64_t used = gpom::lowres_step(*map, scratch, budget);
    CHECK(used <= budget);
    CHECK(memory.is_intact());
    return used;
}

inline std::uint64_t group_ops(const gpom_map_t *map)
{
    const gpom_params_t &params = map->config.params;
    return GPOM_LOWRES_BATCH_OPS(static_cast<std::uint64_t>(params.n_hits) + params.n_free);
}

/// Until nothing is left to do.
inline void settle(gpom_map_t *map)
{
    std::size_t n_steps = 0;
    while (step(map, 64 * group_ops(map)) > 0) {
        REQUIRE(++n_steps < 10000);
    }
}

struct Raster {
    std::vector<gpom_cell_t> cells;
    gpom_lowres_info_t info;

    const gpom_cell_t &at(std::uint32_t ix, std::uint32_t iy) const
    {
        return cells.at(static_cast<std::size_t>(iy) * info.raster.nx + ix);
    }
};

inline Raster raster_of(const gpom_map_t *map, std::uint32_t layer = GPOM_LAYER_COARSE)
{
    Raster raster;
    REQUIRE(gpom_lowres_info(map, layer, &raster.info) == GPOM_OK);
    const std::uint32_t n_cells = raster.info.raster.nx * raster.info.raster.ny;
    raster.cells.resize(n_cells + 1u); // never without an address
    REQUIRE(gpom_lowres_copy(map, layer, raster.cells.data(), n_cells, &raster.info) == GPOM_OK);
    raster.cells.resize(n_cells);
    return raster;
}

/// Written from the words of lowres.h.
inline gpom_cell_t quantised(const gpom_config_t &config, const gpom_answer_t &a,
                             std::uint32_t stamp_ms)
{
    const double prior = static_cast<double>(gpom_params_prior_variance(&config.params));
    const bool is_known =
        a.flags == 0 && a.variance <= config.lowres_unknown * static_cast<float>(prior);
    gpom_cell_t cell = {};
    cell.probability =
        static_cast<std::uint16_t>(std::lround(65535.0 * static_cast<double>(a.probability)));
    cell.variance = static_cast<std::uint8_t>(
        std::min(255.0, std::ceil(255.0 * static_cast<double>(a.variance) / prior)));
    cell.cls = is_known || a.cls == GPOM_OCCUPIED ? a.cls : std::uint8_t{GPOM_UNKNOWN};
    cell.stamp_ms = stamp_ms;
    return cell;
}

inline bool same_cell(const gpom_cell_t &a, const gpom_cell_t &b)
{
    return a.probability == b.probability && a.variance == b.variance && a.cls == b.cls &&
           a.stamp_ms == b.stamp_ms;
}

inline bool same_cells(const std::vector<gpom_cell_t> &a, const std::vector<gpom_cell_t> &b)
{
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), same_cell);
}

/// Centres of a raster of which cell (0, 0) has the whole numbers (ix0, iy0).
inline std::vector<gpom_point_t> numbered_centres(const gpom_raster_t &raster)
{
    const double ix0 = std::round(raster.x0_m / raster.cell_m);
    const double iy0 = std::round(raster.y0_m / raster.cell_m);
    std::vector<gpom_point_t> centres;
    for (std::uint32_t iy = 0; iy < raster.ny; ++iy) {
        for (std::uint32_t ix = 0; ix < raster.nx; ++ix) {
            centres.push_back({(ix0 + ix + 0.5) * raster.cell_m, (iy0 + iy + 0.5) * raster.cell_m});
        }
    }
    return centres;
}

/// All of a settled fixed raster, by the public raster query.
inline void check_equals_query(TestMap &map, const gpom_config_t &config)
{
    const Raster raster = raster_of(map.get());
    CHECK(raster.info.n_dirty == 0);
    const Answers answers = query_raster(map.get(), raster.info.raster);
    std::size_t n_wrong = 0;
    for (std::size_t i = 0; i < answers.all.size(); ++i) {
        const gpom_cell_t expected = quantised(config, answers.all[i], raster.info.newest_ms);
        n_wrong += same_cell(raster.cells[i], expected) ? 0u : 1u;
    }
    CHECK(n_wrong == 0);
}

inline bool is_unknown(const gpom_cell_t &cell, const gpom_params_t &params)
{
    const double p = static_cast<double>(gpom_params_prior_probability(&params));
    return cell.cls == GPOM_UNKNOWN && cell.variance == 255 && cell.stamp_ms == 0 &&
           cell.probability == std::lround(65535.0 * p);
}

inline double distance_to_segment(Xy p, Xy a, Xy b)
{
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    const double square = dx * dx + dy * dy;
    const double t = square > 0.0 ? ((p.x - a.x) * dx + (p.y - a.y) * dy) / square : 0.0;
    const double s = std::clamp(t, 0.0, 1.0);
    return std::hypot(p.x - a.x - s * dx, p.y - a.y - s * dy);
}

inline gpom::Point point_of(Xy p) { return {static_cast<float>(p.x), static_cast<float>(p.y)}; }

/// Dirty cells by number in the window, row by row.
inline std::vector<bool> dirty_cells(const gpom_map_t *map, std::uint32_t which = GPOM_LAYER_COARSE)
{
    const gpom::Layer &layer = map->lowres.layers[which];
    const gpom::Window &w = layer.window;
    std::vector<bool> dirty;
    for (std::int32_t iy = 0; iy < static_cast<std::int32_t>(w.ny); ++iy) {
        for (std::int32_t ix = 0; ix < static_cast<std::int32_t>(w.nx); ++ix) {
            const std::uint32_t slot = gpom::slot_of(w, w.ix0 + ix, w.iy0 + iy);
            dirty.push_back((layer.cells[slot].value & gpom::kDirty) != 0);
        }
    }
    return dirty;
}

} // namespace reference
