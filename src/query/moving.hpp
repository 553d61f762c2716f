/// \file moving.hpp
/// The neighbourhoods of a packet as in neighbours.hpp, with derivatives by the places of the
/// queries.
///
/// What is held fixed: which neighbours are chosen, and their order. Both are constant around
/// almost every place. Where they change an answer may jump or have a kink, and there the result is
/// the derivative of one side. What moves: the closest point of a segment (eq. 10), unless it is an
/// end of the segment; and with the points all that depends on them: weights, noise, the axis of
/// the hits, terms inside eq. 7.
#pragma once

#include "src/gp/gradient.hpp"
#include "src/query/neighbours.hpp"

namespace gpom
{

/// The arrays of a gradient, behind those of a query.
struct MovingWork {
    Neighbourhood<Dual<F>> points;
    Dual<F> *pool_m; ///< Distances of all neighbours of a kind that were found.
    SlopeWork<F> slopes;
};

/// Byte offsets of the arrays of MovingWork. Those of pairs are empty for a sparse solve.
struct MovingLayout {
    size_t pool, features, weighted, pairs, total;
};

constexpr MovingLayout moving_layout(const ScratchNeed &need)
{
    const size_t n_padded = kTile * tile_count(need.n);
    const size_t n_dense = need.is_sparse ? 0 : n_padded;
    MovingLayout layout = {};
    layout.pool = 4 * n_padded * sizeof(Dual<F>);
    layout.features = layout.pool + need.n_pool * sizeof(Dual<F>);
    layout.weighted = layout.features + n_dense * sizeof(FeatureSlopes<F>);
    layout.pairs = layout.weighted + n_dense * sizeof(Weighted<F>);
    layout.total = layout.pairs + 2 * row_at(n_dense + 1) * sizeof(F);
    return layout;
}

/// Where the arrays of MovingWork begin: behind those of the query, aligned.
constexpr size_t moving_at(const ScratchNeed &need)
{
    return align_up(scratch_layout(need).total, kScratchAlignment);
}

inline MovingWork carve_moving(const gpom_map &map, void *scratch)
{
    const gpom_params_t &params = map.config.params;
    const ScratchNeed need = scratch_need(map);
    const MovingLayout layout = moving_layout(need);
    void *const all = align_pointer(carve_batch(scratch) + 1, kScratchAlignment);
    void *const mem = carve<char>(all, moving_at(need));
    const size_t n_padded = kTile * tile_count(need.n);
    Dual<F> *const xynw = carve<Dual<F>>(mem, 0);
    return {{xynw, xynw + n_padded, xynw + 2 * n_padded, xynw + 3 * n_padded, params.n_hits,
             params.n_free},
            carve<Dual<F>>(mem, layout.pool),
            {carve<FeatureSlopes<F>>(mem, layout.features),
             carve<Weighted<F>>(mem, layout.weighted), params.n_fading > 0,
             carve<F>(mem, layout.pairs)}};
}

// ---- neighbours that fade --------------------------------------------------------------------

inline Dual<F> distance_m(const NearestK<F> &, const Fading<Dual<F>> &fading, uint32_t rank)
{
    return fading.pool_m[rank];
}

inline Dual<float> distance_m(const NearestK<F> &, const Fading<Dual<F>> &fading, uint32_t rank,
                              int i_lane)
{
    return lane::get(fading.pool_m[rank], i_lane);
}

inline void move_distance(const Fading<Dual<F>> &fading, uint32_t from, uint32_t to, int i_lane)
{
    lane::set(fading.pool_m[to], i_lane, lane::get(fading.pool_m[from], i_lane));
}

inline void clear_distance(const Fading<Dual<F>> &fading, uint32_t rank, int i_lane)
{
    lane::set(fading.pool_m[rank], i_lane, fixed(lane::sqrt(kNoDistance2)));
}

/// Distances of the neighbours that were found. The distance d to the closest point p of a segment
/// has the derivative -p / d, p relative to the query: how p moves along the segment does not
/// matter.
template <class Part>
void find_distances(const gpom_map &map, const Workspace &work, const NearestK<F> &nearest,
                    const Part &part, Dual<F> *pool_m)
{
    const F zero = lane::splat<F>(0.0f);
    const F one = lane::splat<F>(1.0f);
    for (uint32_t j = 0; j < nearest.k; ++j) {
        F noise;
        const Offset<F> at = work.packet->at;
        const Offset<F> p =
            to_segment(at, collect_segments(map, at, part, nearest.best[j].slot, noise));
        const F d_m = lane::sqrt(nearest.best[j].d2);
        const auto is_apart = d_m > 0.0f;
        const F inverse = lane::select(is_apart, F(1.0f / lane::select(is_apart, d_m, one)), zero);
        pool_m[j] = {d_m, -inverse * p.x_m, -inverse * p.y_m};
    }
}

// ---- points ----------------------------------------------------------------------------------

/// The closest points of the segments, relative to the queries, with their derivatives: those of
/// the foot of a perpendicular, or of an end of the segment, which stays where it is.
inline Offset<Dual<F>> closest_points(const Offset<F> &at, const SegmentLanes<F> &s)
{
    const F zero = lane::splat<F>(0.0f);
    const Offset<F> p = to_segment(at, s);
    const F along_m = lane::fma(F(at.x_m - s.x_m), s.dir_x, F(F(at.y_m - s.y_m) * s.dir_y));
    const auto is_foot = (along_m > 0.0f) & (along_m < s.length_m);
    const F dir_x = lane::select(is_foot, s.dir_x, zero);
    const F dir_y = lane::select(is_foot, s.dir_y, zero);
    const F cross = dir_x * dir_y;
    return {{p.x_m, dir_x * dir_x - 1.0f, cross}, {p.y_m, cross, dir_y * dir_y - 1.0f}};
}

/// The neighbours of one kind that were found, and where the chosen ones go.
template <class Part> struct FoundKind {
    NearestK<F> &nearest;
    const Part &part;
    GatherTo to;
};

/// gather() with derivatives.
template <class Part>
BeamSums<Dual<F>> gather_moving(const gpom_map &map, const Workspace &work,
                                const Neighbourhood<Dual<F>> &points, const FoundKind<Part> &kind)
{
    const GatherTo &to = kind.to;
    const gpom_params_t &params = map.config.params;
    const Dual<F> zero = fixed(lane::splat<F>(0.0f));
    const float softness_m2 = params.n_fading > 0 ? kFacingSoftness_m2 : 0.0f;
    const bool has_sums = params.vote != 0.0f || params.line != 0.0f;
    BeamSums<Dual<F>> sums = {zero, zero, zero, zero};
    for (size_t j = to.first; j < to.first + to.n; ++j) {
        const I slots = kind.nearest.best[j - to.first].slot;
        const Dual<F> weight = points.weight[j];
        F noise;
        const SegmentLanes<F> own = collect_segments(map, work.packet->at, kind.part, slots, noise);
        const Offset<Dual<F>> p = closest_points(work.packet->at, own);
        points.x_m[j] = p.x_m;
        points.y_m[j] = p.y_m;
        points.noise[j] = fixed(noise);
        if (params.n_fading > 0) {
            const Dual<F> fading = fading_noise(fixed(noise), map.prior_variance, weight);
            points.noise[j] = lane::select(slots >= 0, fading, fixed(fading.value));
        }
        if (has_sums) {
            const Dual<F> dir_x = fixed(own.dir_x), dir_y = fixed(own.dir_y);
            sums.facing = sums.facing + weight * facing(p.x_m, p.y_m, dir_x, dir_y, softness_m2);
            sums.dir_x = sums.dir_x + weight * dir_x;
            sums.dir_y = sums.dir_y + weight * dir_y;
            sums.weight = sums.weight + lane::select(slots >= 0, weight, zero);
        }
    }
    return sums;
}

/// Choose and gather the neighbours of one kind.
template <class Part>
BeamSums<Dual<F>> choose_moving(const gpom_map &map, const Workspace &work,
                                const MovingWork &moving, const FoundKind<Part> &kind)
{
    if (map.config.params.n_fading > 0) {
        find_distances(map, work, kind.nearest, kind.part, moving.pool_m);
    }
    choose(map, kind.nearest, moving.points.weight + kind.to.first,
           static_cast<uint32_t>(kind.to.n), moving.pool_m);
    return gather_moving(map, work, moving.points, kind);
}

/// What a packet needs besides its points: what is added inside eq. 7, and the squared distance of
/// the nearest neighbour.
struct MovingContext {
    Dual<F> offset, nearest2_m2;
};

/// Squared distance of the nearest neighbour of a kind, whose point is (x_m, y_m).
inline Dual<F> nearest2(const NearestK<F> &nearest, const Dual<F> &x_m, const Dual<F> &y_m)
{
    return {nearest.best[0].d2, -2.0f * x_m.value, -2.0f * y_m.value};
}

/// prepare_neighbours() with derivatives.
inline MovingContext prepare_moving(const gpom_map &map, Workspace &work, const MovingWork &moving)
{
    const gpom_params_t &params = map.config.params;
    const Neighbourhood<Dual<F>> &p = moving.points;
    const BeamSums<Dual<F>> sums =
        choose_moving<HitPart>(map, work, moving, {work.hits, map.index.hit_part, {0, p.n_hits}});
    choose_moving<FreePart>(map, work, moving,
                            {work.free, map.index.free_part, {p.n_hits, p.n_free}});
    HitAxis<Dual<F>> axis = {};
    if (params.anisotropy > 0.0f || params.line != 0.0f) {
        axis = axis_of_hits(p);
    }
    const Dual<F> of_hit = nearest2(work.hits, p.x_m[0], p.y_m[0]);
    const Dual<F> of_free = nearest2(work.free, p.x_m[p.n_hits], p.y_m[p.n_hits]);
    const MovingContext context = {context_offset(params, p, sums, axis),
                                   lane::min(of_hit, of_free)};
    merge_and_shrink(params, work, p, axis);
    return context;
}

} // namespace gpom
