/// \file workspace.hpp
/// What one query call works with: a packet of queries and arrays for them, carved from the
/// caller's scratch.
#pragma once

#include "src/local_gp.hpp"
#include "src/map.hpp"
#include "src/nearest.hpp"

namespace gpom
{

constexpr int kLanes = GPOM_LANES;
using F = lane::Lane<kLanes>::F;
using I = lane::Lane<kLanes>::I;
static_assert(kLanes <= static_cast<int>(GPOM_LANES_MAX), "GPOM_SCRATCH_BYTES knows fewer lanes");

/// Up to kLanes queries computed together. Unused lanes repeat the first query.
struct Packet {
    Offset<F> at;            ///< Relative to the map's origin.
    I out_of_reach;          ///< 1: the point was refused; its lane computes the origin instead.
    size_t i_answer[kLanes]; ///< Where the answers go.
    int n;                   ///< Queries in the packet.
};

/// Points that a caller inside the library asks at a time, whatever the lane width.
constexpr uint32_t kGroupSize = GPOM_LANES_MAX;

struct PointGroup {
    gpom_point_t points[kGroupSize];
    gpom_answer_t answers[kGroupSize];
};

struct Workspace {
    Packet *packet;
    Subtree *stack;
    NearestK<F> hits, free;
    Neighbourhood<F> points;
    GpWork<F> gp;
};

/// Neighbours of one kind to search for, of which n are chosen: more if scans are capped.
constexpr size_t pool_size(size_t n, uint32_t scan_points_max)
{
    return scan_points_max > 0 ? n + n / 2 : n;
}

/// Byte offsets behind the group of points that the scratch begins with; lanes first, as they are
/// the most strictly aligned.
struct ScratchLayout {
    size_t nearest, points, features, vectors, factor, packet, stack, total;
};

constexpr ScratchLayout scratch_layout(size_t n, size_t n_pool)
{
    const size_t n_padded = kTile * tile_count(n);
    const size_t nearest = 0;
    const size_t points = nearest + n_pool * sizeof(Found<F>);
    const size_t features = points + 3 * n_padded * sizeof(F);
    const size_t vectors = features + n_padded * sizeof(Feature<F>); // u and v
    const size_t factor = vectors + 2 * n_padded * sizeof(F);
    const size_t packet = align8(factor + panel_at(tile_count(n)) * sizeof(F));
    const size_t stack = packet + align8(sizeof(Packet));
    const size_t total = stack + kDepthMax * sizeof(Subtree);
    return {nearest, points, features, vectors, factor, packet, stack, total};
}

/// The strictest alignment of what lies in the scratch.
constexpr size_t kScratchAlignment = sizeof(F) > 8 ? sizeof(F) : 8;

/// With the group and what the starts of both may lose to alignment.
constexpr size_t scratch_bytes(size_t n, size_t n_pool)
{
    return 7 + sizeof(PointGroup) + kScratchAlignment - 1 + scratch_layout(n, n_pool).total;
}

static_assert(scratch_bytes(2, 4) <= GPOM_SCRATCH_BYTES(2, kLanes), "public macro too small");
static_assert(scratch_bytes(5, 10) <= GPOM_SCRATCH_BYTES(5, kLanes), "public macro too small");
static_assert(scratch_bytes(16, 32) <= GPOM_SCRATCH_BYTES(16, kLanes), "public macro too small");
static_assert(scratch_bytes(GPOM_POINTS_MAX, 2 * GPOM_POINTS_MAX) <=
                  GPOM_SCRATCH_BYTES(GPOM_POINTS_MAX, kLanes),
              "public macro too small");

/// Layout of the scratch for a map's neighbours.
inline ScratchLayout scratch_layout_of(const gpom_params_t &params)
{
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    return scratch_layout(n, pool_size(n, params.scan_points_max));
}

inline void *align_pointer(void *mem, size_t alignment)
{
    return reinterpret_cast<void *>(align_up(reinterpret_cast<uintptr_t>(mem), alignment));
}

/// A group of points at the start of the scratch, which queries leave alone: the same place
/// whatever the width of their lanes.
inline PointGroup *carve_group(void *scratch)
{
    return static_cast<PointGroup *>(align_pointer(scratch, 8));
}

inline Workspace carve_workspace(const gpom_params_t &params, void *scratch)
{
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    const size_t n_pool = pool_size(n, params.scan_points_max);
    const size_t n_pool_hits = pool_size(params.n_hits, params.scan_points_max);
    const ScratchLayout layout = scratch_layout_of(params);
    void *const mem = align_pointer(carve_group(scratch) + 1, kScratchAlignment);
    const size_t n_padded = kTile * tile_count(n);
    F *const xyn = carve<F>(mem, layout.points);
    F *const uv = carve<F>(mem, layout.vectors);
    Workspace work = {};
    work.packet = carve<Packet>(mem, layout.packet);
    work.stack = carve<Subtree>(mem, layout.stack);
    Found<F> *const found = carve<Found<F>>(mem, layout.nearest);
    work.hits = {found, static_cast<uint32_t>(n_pool_hits), 0};
    work.free = {found + n_pool_hits, static_cast<uint32_t>(n_pool - n_pool_hits), 0};
    work.points = {xyn, xyn + n_padded, xyn + 2 * n_padded, params.n_hits, params.n_free};
    work.gp.features = carve<Feature<F>>(mem, layout.features);
    work.gp.u = uv;
    work.gp.v = uv + n_padded;
    work.gp.factor = {carve<F>(mem, layout.factor), F{}};
    return work;
}

} // namespace gpom
