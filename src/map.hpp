/// \file map.hpp
/// The map's inside: a header and the arrays behind it, all in the caller's memory.
#pragma once

#include "gpom/map.h"
#include "gpom/query.h"
#include "src/arena.hpp"
#include "src/beam.hpp"
#include "src/kdtree.hpp"
#include "src/kernel.hpp"

/// Opaque to users (gpom_map_t). Beams [0, n_indexed) are in the trees, [n_indexed, n_beams) are
/// recent: each query looks at them one by one.
struct gpom_map {
    uint32_t magic; ///< kMapMagic once initialised.
    uint32_t n_beams;
    uint32_t n_indexed;
    uint32_t next_id;
    gpom_config_t config;
    gpom_stats_t stats;
    gpom::KernelConstants kernel;
    float prior_variance;    ///< k(x*, x*), at the origin in the map frame.
    float prior_probability; ///< p far from all beams.
    gpom::Beam *beams;       ///< beam_max.
    uint32_t *order;         ///< beam_max: the trees' build sorts beam indices here.
    gpom::HitTree hits;
    gpom::SegmentTree segments;
    gpom::Subtree build_stack[gpom::kDepthMax];
};

namespace gpom
{

constexpr uint32_t kMapMagic = 0x6d6f7067; // "gpom"

/// Byte offsets of everything a map owns. The one place that knows the layout: gpom_map_init()
/// carves with it, gpom_map_bytes() reports it, GPOM_MAP_BYTES is checked against it.
struct MapLayout {
    size_t beams, order, hit_boxes, hit_leaves, segment_boxes, segment_leaves, total;
};

constexpr MapLayout map_layout(uint32_t beam_max)
{
    const size_t n_boxes = node_count(beam_max);
    const size_t n_leaves = leaf_count(beam_max);
    const size_t beams = align8(sizeof(gpom_map));
    const size_t order = beams + align8(beam_max * sizeof(Beam));
    const size_t hit_boxes = order + align8(beam_max * sizeof(uint32_t));
    const size_t hit_leaves = hit_boxes + align8(n_boxes * sizeof(Box));
    const size_t segment_boxes = hit_leaves + align8(n_leaves * sizeof(HitLeaf));
    const size_t segment_leaves = segment_boxes + align8(n_boxes * sizeof(Box));
    const size_t total = segment_leaves + align8(n_leaves * sizeof(SegmentLeaf));
    return {beams, order, hit_boxes, hit_leaves, segment_boxes, segment_leaves, total};
}

static_assert(map_layout(1).total <= GPOM_MAP_BYTES(1), "public macro too small");
static_assert(map_layout(9).total <= GPOM_MAP_BYTES(9), "public macro too small");
static_assert(map_layout(476).total <= GPOM_MAP_BYTES(476), "public macro too small");
static_assert(map_layout(GPOM_BEAM_MAX).total <= GPOM_MAP_BYTES(GPOM_BEAM_MAX),
              "public macro too small");
static_assert(leaf_count(GPOM_BEAM_MAX) <= (1u << (kDepthMax - 2)), "the walk's stack is too short");

inline bool is_map(const gpom_map *map) { return map != nullptr && map->magic == kMapMagic; }

/// Noise variance of a beam's point from its label's `sn2` and the beam's excess (scan.h).
template <class F> inline F noise_of(float sn2, float prior_variance, F excess)
{
    return sn2 + excess * (sn2 + prior_variance);
}

} // namespace gpom
