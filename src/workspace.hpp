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

/// Byte offsets in the scratch; lanes first, as they are the most strictly aligned.
struct ScratchLayout {
    size_t nearest, points, features, vectors, factor, packet, stack, group, total;
};

constexpr ScratchLayout scratch_layout(size_t n, size_t n_pool)
{
    const size_t nearest = 0; // d2, id and slot
    const size_t points = nearest + 3 * n_pool * sizeof(F);
    const size_t features = points + 3 * n * sizeof(F);
    const size_t vectors = features + n * sizeof(Feature<F>); // u, v and 1 / diagonal
    const size_t factor = vectors + 3 * n * sizeof(F);
    const size_t packet = align8(factor + tri(n) * sizeof(F));
    const size_t stack = packet + align8(sizeof(Packet));
    const size_t group = align8(stack + kDepthMax * sizeof(Subtree));
    const size_t total = group + sizeof(PointGroup);
    return {nearest, points, features, vectors, factor, packet, stack, group, total};
}

/// The strictest alignment of what lies in the scratch.
constexpr size_t kScratchAlignment = sizeof(F) > 8 ? sizeof(F) : 8;

/// With what the start of the scratch may lose to alignment.
constexpr size_t scratch_bytes(size_t n, size_t n_pool)
{
    return scratch_layout(n, n_pool).total + kScratchAlignment - 1;
}

static_assert(scratch_bytes(2, 4) <= GPOM_SCRATCH_BYTES(2, kLanes), "public macro too small");
static_assert(scratch_bytes(16, 32) <= GPOM_SCRATCH_BYTES(16, kLanes), "public macro too small");
static_assert(scratch_bytes(GPOM_POINTS_MAX, 2 * GPOM_POINTS_MAX) <=
                  GPOM_SCRATCH_BYTES(GPOM_POINTS_MAX, kLanes),
              "public macro too small");

/// Scratch a query on this map needs.
inline size_t scratch_bytes_of(const gpom_params_t &params)
{
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    return scratch_bytes(n, pool_size(n, params.scan_points_max));
}

/// GPOM_ERR_MEM if the scratch does not suffice for queries on this map.
inline gpom_status_t check_scratch(const gpom_map &map, const gpom_scratch_t &scratch)
{
    const size_t needed = scratch_bytes_of(map.config.params);
    return scratch.mem == nullptr || scratch.mem_bytes < needed ? GPOM_ERR_MEM : GPOM_OK;
}

/// Part of the arrays of n_pool neighbours of both kinds, from `first` on.
inline NearestK<F> carve_nearest(void *mem, size_t n_pool, size_t first, size_t k)
{
    return {carve<F>(mem, 0) + first, carve<I>(mem, n_pool * sizeof(F)) + first,
            carve<I>(mem, 2 * n_pool * sizeof(F)) + first, static_cast<uint32_t>(k)};
}

/// Layout of the scratch for a map's neighbours.
inline ScratchLayout scratch_layout_of(const gpom_params_t &params)
{
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    return scratch_layout(n, pool_size(n, params.scan_points_max));
}

inline void *align_scratch(void *scratch)
{
    return reinterpret_cast<void *>(
        align_up(reinterpret_cast<uintptr_t>(scratch), kScratchAlignment));
}

/// A group of points in the part of the scratch that gpom_query_points() leaves alone.
inline PointGroup *carve_group(const gpom_params_t &params, void *scratch)
{
    return carve<PointGroup>(align_scratch(scratch), scratch_layout_of(params).group);
}

inline Workspace carve_workspace(const gpom_params_t &params, void *scratch)
{
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    const size_t n_pool = pool_size(n, params.scan_points_max);
    const size_t n_pool_hits = pool_size(params.n_hits, params.scan_points_max);
    const ScratchLayout layout = scratch_layout_of(params);
    void *const mem = align_scratch(scratch);
    F *const xyn = carve<F>(mem, layout.points);
    F *const uvd = carve<F>(mem, layout.vectors);
    Workspace work = {};
    work.packet = carve<Packet>(mem, layout.packet);
    work.stack = carve<Subtree>(mem, layout.stack);
    work.hits = carve_nearest(mem, n_pool, 0, n_pool_hits);
    work.free = carve_nearest(mem, n_pool, n_pool_hits, n_pool - n_pool_hits);
    work.points = {xyn, xyn + n, xyn + 2 * n, params.n_hits, params.n_free};
    work.gp.features = carve<Feature<F>>(mem, layout.features);
    work.gp.u = uvd;
    work.gp.v = uvd + n;
    work.gp.factor = {carve<F>(mem, layout.factor), uvd + 2 * n, F{}};
    return work;
}

} // namespace gpom
