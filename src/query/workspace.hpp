/// \file workspace.hpp
/// The working memory of one query call: a packet of queries and arrays for them, carved from the
/// caller's scratch.
#pragma once

#include "src/beams/nearest.hpp"
#include "src/beams/search_start.hpp"
#include "src/gp/local_gp.hpp"
#include "src/gp/sparse_gp.hpp"
#include "src/lane/width.hpp"
#include "src/map/map.hpp"

namespace gpom
{

static_assert(kLanes <= static_cast<int>(GPOM_LANES_MAX), "GPOM_SCRATCH_BYTES knows fewer lanes");

/// Up to kLanes queries computed together. Unused lanes repeat the first query.
struct Packet {
    Offset<F> at;            ///< Relative to the map's origin.
    I out_of_reach;          ///< 1: the point was refused. Its lane computes the origin instead.
    size_t i_answer[kLanes]; ///< Index of the answer to each query.
    int n;                   ///< Queries in the packet.
};

/// Room for the parts of a search start. With one lane there is no search start.
constexpr uint32_t kStartParts = kLanes > 1 ? kStartPartsMax : 0;

/// At most this many points of a list are sorted together.
constexpr size_t kListBlock = 256;

/// Points of a list in the order of a Z curve (list_order.hpp).
struct ListOrder {
    uint16_t codes[kListBlock];  ///< Place of each point on the curve.
    uint16_t places[kListBlock]; ///< Numbers of the points in the curve's order.
    uint16_t spare[kListBlock];
    uint16_t counts[kListBlock];
};

/// Number of points that a caller inside the library asks together. It is the same for every lane
/// width.
constexpr uint32_t kBatchSize = GPOM_LANES_MAX;

struct PointBatch {
    gpom_point_t points[kBatchSize];
    gpom_answer_t answers[kBatchSize];
};

struct Workspace {
    Packet *packet;
    Packet *cut; ///< A packet whose search was cut, while its queries are answered one by one.
    bool is_cut; ///< The last search was cut.
    bool has_searched;     ///< hits and free hold the result of a search that was not cut.
    Offset<F> searched_at; ///< The queries of the last search.
    SearchStart hit_start, free_start;
    ListOrder *order;
    Subtree *stack;
    NearestK<F> hits, free;
    Neighbourhood<F> points;
    GpWork<F> gp;              ///< For a dense solve.
    gpom_sparse_system sparse; ///< For a sparse solve. It has room for all points.
};

/// True if the map solves its neighbourhoods sparse, false if dense.
inline bool is_sparse(const gpom_map &map)
{
    const gpom_params_t &params = map.config.params;
    return GPOM_SPARSE != 0 && params.kernel == GPOM_KERNEL_ASKEY &&
           static_cast<uint32_t>(params.n_hits) + params.n_free > map.dense_max;
}

/// How many neighbours of one kind a query searches for, to choose n from them. The pool is larger
/// than n if the points of a scan are capped. Otherwise it has one neighbour more if neighbours
/// fade.
constexpr size_t pool_size(size_t n, const gpom_params_t &params)
{
    const size_t n_capped = params.scan_points_max > 0 ? n + n / 2 : n;
    return params.n_fading > 0 && n_capped == n ? n + 1 : n_capped;
}

/// What the queries of a map need: the number n of neighbours that they choose, the number n_pool
/// that they search for, and the kind of solve.
struct ScratchNeed {
    size_t n, n_pool;
    bool is_sparse;
};

inline ScratchNeed scratch_need(const gpom_map &map)
{
    const gpom_params_t &params = map.config.params;
    const size_t n = static_cast<size_t>(params.n_hits) + params.n_free;
    return {n, pool_size(params.n_hits, params) + pool_size(params.n_free, params), is_sparse(map)};
}

/// Byte offsets of the arrays, from the end of the batch of points, which is at the start of the
/// scratch. Arrays of lanes come first, because their alignment is the strictest. Arrays that only
/// a dense solve needs are empty for a sparse solve, and the other way round.
struct ScratchLayout {
    size_t points, features, vectors, factor, packets, order, stack, starts, sparse_points, sparse,
        total;
};

constexpr ScratchLayout scratch_layout(const ScratchNeed &need)
{
    const size_t n_padded = kTile * tile_count(need.n);
    const size_t n_dense = need.is_sparse ? 0 : n_padded;
    const size_t n_sparse = need.is_sparse ? need.n : 0;
    ScratchLayout layout = {};
    layout.points = need.n_pool * sizeof(Found<F>);
    layout.features = layout.points + 4 * n_padded * sizeof(F);
    layout.vectors = layout.features + n_dense * sizeof(Feature<F>); // u and v
    layout.factor = layout.vectors + 2 * n_dense * sizeof(F);
    layout.packets = align8(layout.factor + panel_at(tile_count(n_dense)) * sizeof(F));
    layout.order = layout.packets + (kLanes > 1 ? 2 : 1) * align8(sizeof(Packet));
    layout.stack = layout.order + (kLanes > 1 ? align8(sizeof(ListOrder)) : 0);
    layout.starts = layout.stack + (kStartParts + kDepthMax) * sizeof(Subtree);
    layout.sparse_points = align8(layout.starts + 2 * kStartParts * sizeof(Subtree));
    layout.sparse = layout.sparse_points + n_sparse * sizeof(gpom_sparse_point);
    layout.total = layout.sparse + (need.is_sparse ? gpom_sparse_bytes(n_sparse) : 0);
    return layout;
}

/// The strictest alignment of any array in the scratch.
constexpr size_t kScratchAlignment = sizeof(F) > 8 ? sizeof(F) : 8;

/// Bytes of a scratch: the batch of points, the arrays, and the bytes that may be lost to align the
/// batch and the arrays.
constexpr size_t scratch_bytes(const ScratchNeed &need)
{
    return 7 + sizeof(PointBatch) + kScratchAlignment - 1 + scratch_layout(need).total;
}

/// True if GPOM_SCRATCH_BYTES() is enough to choose n neighbours from 2 n.
constexpr bool is_enough_scratch(size_t n)
{
    return scratch_bytes({n, 2 * n, n > GPOM_POINTS_MAX}) <= GPOM_SCRATCH_BYTES(n, kLanes);
}

static_assert(is_enough_scratch(2) && is_enough_scratch(5) && is_enough_scratch(16) &&
                  is_enough_scratch(GPOM_POINTS_MAX) && is_enough_scratch(GPOM_POINTS_MAX + 1) &&
                  is_enough_scratch(GPOM_SPARSE_POINTS_MAX),
              "public macro too small");

inline void *align_pointer(void *mem, size_t alignment)
{
    return reinterpret_cast<void *>(align_up(reinterpret_cast<uintptr_t>(mem), alignment));
}

/// The batch of points at the start of the scratch. Queries do not change it. Its place is the same
/// for every lane width.
inline PointBatch *carve_batch(void *scratch)
{
    return static_cast<PointBatch *>(align_pointer(scratch, 8));
}

inline Workspace carve_workspace(const gpom_map &map, void *scratch)
{
    const gpom_params_t &params = map.config.params;
    const ScratchNeed need = scratch_need(map);
    const size_t n_pool_hits = pool_size(params.n_hits, params);
    const ScratchLayout layout = scratch_layout(need);
    void *const mem = align_pointer(carve_batch(scratch) + 1, kScratchAlignment);
    const size_t n_padded = kTile * tile_count(need.n);
    F *const xynw = carve<F>(mem, layout.points);
    F *const uv = carve<F>(mem, layout.vectors);
    Workspace work = {};
    work.packet = carve<Packet>(mem, layout.packets);
    work.cut = work.packet + 1;
    work.order = carve<ListOrder>(mem, layout.order);
    work.stack = carve<Subtree>(mem, layout.stack);
    Subtree *const parts = carve<Subtree>(mem, layout.starts);
    work.hit_start = {parts, 0, 0.0f, empty_box()};
    work.free_start = {parts + kStartParts, 0, 0.0f, empty_box()};
    Found<F> *const found = carve<Found<F>>(mem, 0);
    work.hits = {found, static_cast<uint32_t>(n_pool_hits), 0};
    work.free = {found + n_pool_hits, static_cast<uint32_t>(need.n_pool - n_pool_hits), 0};
    work.points = {xynw,          xynw + n_padded, xynw + 2 * n_padded, xynw + 3 * n_padded,
                   params.n_hits, params.n_free};
    work.gp.features = carve<Feature<F>>(mem, layout.features);
    work.gp.u = uv;
    work.gp.v = uv + n_padded;
    work.gp.factor = {carve<F>(mem, layout.factor), F{}};
    work.sparse = {carve<gpom_sparse_point>(mem, layout.sparse_points), need.n,
                   carve<void *>(mem, layout.sparse)};
    return work;
}

} // namespace gpom
