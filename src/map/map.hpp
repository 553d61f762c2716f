/// \file map.hpp
/// The inside of a map: a header and the arrays behind it, all in the caller's memory.
#pragma once

#include "gpom/map.h"
#include "gpom/query.h"
#include "src/base/arena.hpp"
#include "src/beams/beam.hpp"
#include "src/beams/index.hpp"
#include "src/beams/noise.hpp"
#include "src/gp/kernel.hpp"
#include "src/map/keeper.hpp"
#include "src/raster/lowres.hpp"

/// Opaque to users (gpom_map_t).
struct gpom_map {
    uint32_t magic; ///< kMapMagic if the map is initialised.
    gpom_config_t config;
    gpom_stats_t stats;
    gpom::KernelConstants kernel;
    gpom::Noise noise;
    float prior_variance;    ///< k(x*, x*), at the origin in the map frame.
    float prior_probability; ///< Probability of occupancy far from all beams.
    uint32_t dense_max;      ///< Neighbourhoods of more points use the sparse solver.
    gpom::Index index;
    gpom::Keeper keeper;
    gpom::Lowres lowres;
    gpom::Point refused; ///< If the origin follows the robot: place of the last scan out of reach.
    uint32_t n_refused;  ///< Scans out of reach in a row, near each other (note_out_of_reach()).
};

namespace gpom
{

constexpr uint32_t kMapMagic = 0x6d6f7067; // "gpom"

/// Byte offsets of all arrays of a map. Only map_layout() knows the layout: gpom_map_init() carves
/// with it, gpom_map_bytes() reports its total, and GPOM_MAP_BYTES is checked against it.
struct MapLayout {
    size_t beams, boxes[3], slots[3], recent, provisional, cells, total;
};

constexpr MapLayout map_layout(uint32_t beam_max, uint64_t cell_max)
{
    const size_t boxes_bytes = align8(node_count(beam_max) * sizeof(Box));
    const size_t slots_bytes = align8(beam_max * sizeof(uint32_t));
    MapLayout layout = {};
    layout.beams = align8(sizeof(gpom_map));
    size_t end = layout.beams + align8(beam_max * sizeof(Beam));
    for (int i_tree = 0; i_tree < 3; ++i_tree) {
        layout.boxes[i_tree] = end;
        layout.slots[i_tree] = end + boxes_bytes;
        end += boxes_bytes + slots_bytes;
    }
    layout.recent = end;
    layout.provisional = end + align8(recent_capacity(beam_max) * sizeof(RecentBlock));
    layout.cells = layout.provisional + align8(provisional_capacity(beam_max) * sizeof(Waiting));
    layout.total = layout.cells + static_cast<size_t>(cell_max) * sizeof(Cell);
    return layout;
}

static_assert(map_layout(1, 0).total <= GPOM_MAP_BYTES(1, 0), "public macro too small");
static_assert(map_layout(9, 1).total <= GPOM_MAP_BYTES(9, 1), "public macro too small");
static_assert(map_layout(476, 1024).total <= GPOM_MAP_BYTES(476, 1024), "public macro too small");
static_assert(map_layout(GPOM_BEAM_MAX, GPOM_CELL_MAX).total <=
                  GPOM_MAP_BYTES(GPOM_BEAM_MAX, GPOM_CELL_MAX),
              "public macro too small");
static_assert(leaf_count(GPOM_BEAM_MAX) <= (1u << (kDepthMax - 2)),
              "the traversal's stack is too short");

inline bool is_map(const gpom_map *map) { return map != nullptr && map->magic == kMapMagic; }

/// Noise variance of the points of a beam's part (noise.hpp).
template <class Part> float noise_of(const gpom_map &map, const Beam &beam, const Part &part)
{
    return raised(sn2_of(map.noise, beam, part), map.prior_variance, beam.excess);
}

} // namespace gpom
