/// \file neighbours.hpp
/// From a packet of queries to their neighbourhoods. Neighbours are searched, chosen, and made
/// points relative to their query.
#pragma once

#include "src/beams/search_start.hpp"
#include "src/gp/context.hpp"
#include "src/query/workspace.hpp"

namespace gpom
{

/// The points of one scan among the points that one lane has chosen so far: how many there are, the
/// ranks of the last two, and the scan's number.
struct OfScan {
    uint32_t n, last, before;
    uint16_t scan;
};

/// What a chosen point keeps in place of its id, which is needed no more: the number of its scan
/// (16 bits), and OfScan::before (9 bits) and OfScan::n (7 bits) of its scan, itself included.
constexpr uint32_t kScanBits = 16;
constexpr uint32_t kBeforeBits = 9;
static_assert(GPOM_SPARSE_POINTS_MAX <= 1u << kBeforeBits, "ranks have to fit");
static_assert(GPOM_POINTS_MAX < 1u << (32 - kScanBits - kBeforeBits), "counts have to fit");

inline int32_t scan_mark(const OfScan &of)
{
    const uint32_t counts = of.before | of.n << kBeforeBits;
    return static_cast<int32_t>(of.scan | counts << kScanBits);
}

/// The points of a scan among the first n_chosen. Only the last one is looked for, because its mark
/// holds how many there are.
inline OfScan of_scan(const Found<F> *best, int i_lane, uint32_t n_chosen, uint16_t scan)
{
    for (const Found<F> *at = best + n_chosen; at != best;) {
        --at;
        const auto mark = static_cast<uint32_t>(lane::get(at->id, i_lane));
        if (static_cast<uint16_t>(mark) == scan) {
            const uint32_t counts = mark >> kScanBits;
            return {counts >> kBeforeBits, static_cast<uint32_t>(at - best),
                    counts & ((1u << kBeforeBits) - 1), scan};
        }
    }
    return {0, 0, 0, scan};
}

/// How the n chosen neighbours of one kind fade: their weights, and the distances at which fading
/// starts and ends. D is F, or Dual<F> for gradients.
template <class D> struct Fading {
    D *weight;
    uint32_t n;
    D from_m, end_m;
    D *pool_m; ///< Dual<F>: distances of all neighbours that were found. F: not used.
};

inline F distance_m(const NearestK<F> &nearest, const Fading<F> &, uint32_t rank)
{
    return lane::sqrt(nearest.best[rank].d2);
}

inline float distance_m(const NearestK<F> &nearest, const Fading<F> &, uint32_t rank, int i_lane)
{
    return lane::sqrt(lane::get(nearest.best[rank].d2, i_lane));
}

/// Move the distance of a neighbour to the rank that the neighbour moves to.
inline void move_distance(const Fading<F> &, uint32_t, uint32_t, int) {}

/// There is no neighbour at this rank.
inline void clear_distance(const Fading<F> &, uint32_t, int) {}

/// Fade the last point of a scan that the cap allows. Fading starts at the distance of the scan's
/// point before it, or at 0 if there is none. Fading ends at end_m: the distance of the first point
/// of the scan that was left out, or of the last point of the pool.
template <class D, class End>
inline void fade_last_of_scan(const NearestK<F> &nearest, const Fading<D> &fading, int i_lane,
                              const OfScan &of, const End &end_m)
{
    const End from_m =
        of.n > 1 ? distance_m(nearest, fading, of.before, i_lane) : lane::splat<End>(0.0f);
    const End weight = fading_weight(distance_m(nearest, fading, of.last, i_lane), from_m, end_m);
    lane::set(fading.weight[of.last], i_lane,
              lane::min(weight, lane::get(fading.weight[of.last], i_lane)));
}

/// The first point of a scan beyond the cap is left out. Its distance tells how the scan's last
/// point fades.
template <class D>
inline void leave_out(NearestK<F> &nearest, const Fading<D> &fading, int i_lane, uint32_t rank,
                      const OfScan &same)
{
    fade_last_of_scan(nearest, fading, i_lane, same, distance_m(nearest, fading, rank, i_lane));
    const OfScan and_one_left_out = {same.n + 1, same.last, same.before, same.scan};
    lane::set(nearest.best[same.last].id, i_lane, scan_mark(and_one_left_out));
}

/// Move a point from its rank in the pool to the next rank of the chosen ones, which is with.last.
template <class D>
inline void move_point(NearestK<F> &nearest, const Fading<D> &fading, int i_lane, uint32_t rank,
                       const OfScan &with)
{
    const Found<F> &from = nearest.best[rank];
    const int32_t slot = lane::get(from.slot, i_lane);
    const float d2 = lane::get(from.d2, i_lane);
    Found<F> &place = nearest.best[with.last];
    lane::set(place.d2, i_lane, d2);
    lane::set(place.id, i_lane, scan_mark(with));
    lane::set(place.slot, i_lane, slot);
    move_distance(fading, rank, with.last, i_lane);
}

/// cap_scans() of one lane.
template <class D>
inline void cap_scans_of(const gpom_map &map, NearestK<F> &nearest, Fading<D> &fading, int i_lane)
{
    const uint32_t n_max = map.config.params.scan_points_max;
    const bool fades = map.config.params.n_fading > 0;
    const auto pool_end_m = lane::get(fading.end_m, i_lane);
    Found<F> *const best = nearest.best;
    uint32_t n_chosen = 0;
    for (uint32_t rank = 0; rank < nearest.k && (fades || n_chosen < fading.n); ++rank) {
        const int32_t slot = lane::get(best[rank].slot, i_lane);
        if (slot < 0) {
            break;
        }
        const uint16_t scan = map.index.beams[slot].scan;
        const OfScan same = of_scan(best, i_lane, n_chosen, scan);
        const OfScan with = {same.n + 1, n_chosen, same.last, scan};
        if (same.n >= n_max) {
            if (fades && same.n == n_max) {
                leave_out(nearest, fading, i_lane, rank, same);
            }
        } else if (n_chosen == fading.n) {
            const auto d_m = distance_m(nearest, fading, rank, i_lane);
            lane::set(fading.end_m, i_lane, lane::min(d_m, lane::get(fading.end_m, i_lane)));
        } else {
            move_point(nearest, fading, i_lane, rank, with);
            if (with.n == n_max && fades) {
                fade_last_of_scan(nearest, fading, i_lane, with, pool_end_m);
            }
            ++n_chosen;
        }
    }
    for (; n_chosen < fading.n; ++n_chosen) {
        lane::set(best[n_chosen].slot, i_lane, int32_t{-1});
        lane::set(best[n_chosen].d2, i_lane, kNoDistance2);
        clear_distance(fading, n_chosen, i_lane);
    }
}

/// Choose n points from the pool in its order, at most scan_points_max of each scan. The chosen
/// points become the first n entries. If there are fewer than n, the slot of the other entries is
/// -1. Beams of one scan share its errors and its view, so that many of them must not count as
/// independent observations.
template <class D>
inline void cap_scans(const gpom_map &map, NearestK<F> &nearest, Fading<D> &fading)
{
    for (int i = 0; i < kLanes; ++i) {
        cap_scans_of(map, nearest, fading, i);
    }
}

/// Choose n neighbours of one kind from the neighbours that were found, and compute their weights.
template <class D>
inline void choose(const gpom_map &map, NearestK<F> &nearest, D *weight, uint32_t n, D *pool_m)
{
    const gpom_params_t &params = map.config.params;
    const uint32_t n_whole = n - params.n_fading;
    for (uint32_t j = 0; j < n; ++j) {
        weight[j] = lane::splat<D>(1.0f);
    }
    Fading<D> fading = {weight, n, lane::splat<D>(0.0f), lane::splat<D>(0.0f), pool_m};
    if (params.n_fading > 0) {
        fading.from_m = distance_m(nearest, fading, n_whole - 1);
        fading.end_m = distance_m(nearest, fading, nearest.k - 1);
    }
    const F whole_d2 = nearest.best[n_whole - 1].d2; // up to here, a weight is 1
    if (params.scan_points_max > 0) {
        cap_scans(map, nearest, fading);
    }
    if (params.n_fading == 0) {
        return;
    }
    for (uint32_t j = params.scan_points_max > 0 ? 0 : n_whole; j < n; ++j) {
        if (lane::any(nearest.best[j].d2 > whole_d2)) {
            const D d_m = distance_m(nearest, fading, j);
            weight[j] = weight[j] * fading_weight(d_m, fading.from_m, fading.end_m);
        }
    }
}

/// One chosen neighbour of each lane: its point relative to the query, the direction of its beam
/// and its noise variance. A lane without a neighbour has zeros and kAbsentNoise.
struct Gathered {
    Offset<F> point;
    F dir_x, dir_y, noise;
};

/// The segment of one neighbour of each lane, lane by lane. In a lane without a neighbour it is the
/// query's place. `noise` becomes its noise variance, or kAbsentNoise.
template <class Part>
SegmentLanes<F> collect_segments(const gpom_map &map, const Offset<F> &at, const Part &part,
                                 I slots, F &noise)
{
    SegmentLanes<F> segments = {};
    noise = lane::splat<F>(kAbsentNoise);
    for (int i = 0; i < kLanes; ++i) {
        const int32_t slot = lane::get(slots, i);
        Segment segment = {lane::get(at.x_m, i), lane::get(at.y_m, i), 0.0f, 0.0f, 0.0f};
        if (slot >= 0) {
            const Beam &beam = map.index.beams[slot];
            segment = part(beam);
            lane::set(noise, i, noise_of(map, beam, part));
        }
        set_segment(segments, i, segment);
    }
    return segments;
}

/// Gather neighbours that several lanes share. Each different beam is computed once for all lanes;
/// the lanes that chose the beam take the result. n_beams becomes the number of different beams.
template <class Part>
Gathered gather_shared(const gpom_map &map, const Offset<F> &at, const Part &part, I slots,
                       uint32_t &n_beams)
{
    const F zero = lane::splat<F>(0.0f);
    Gathered all = {{zero, zero}, zero, zero, lane::splat<F>(kAbsentNoise)};
    n_beams = 0;
    for (uint32_t left = lane::bits_of_mask(slots >= 0); left != 0; ++n_beams) {
        const int32_t slot = lane::get(slots, __builtin_ctz(left));
        const auto is_here = slots == lane::splat_int<I>(slot);
        const Beam &beam = map.index.beams[slot];
        const SegmentLanes<F> own = splat<F>(part(beam));
        const Offset<F> point = to_segment(at, own);
        all.point.x_m = lane::select(is_here, point.x_m, all.point.x_m);
        all.point.y_m = lane::select(is_here, point.y_m, all.point.y_m);
        all.dir_x = lane::select(is_here, own.dir_x, all.dir_x);
        all.dir_y = lane::select(is_here, own.dir_y, all.dir_y);
        all.noise = lane::select(is_here, lane::splat<F>(noise_of(map, beam, part)), all.noise);
        left &= ~lane::bits_of_mask(is_here);
    }
    return all;
}

/// The same as gather_shared(), lane by lane. This is faster if most lanes have different beams.
template <class Part>
Gathered gather_each(const gpom_map &map, const Offset<F> &at, const Part &part, I slots)
{
    F noise;
    const SegmentLanes<F> own = collect_segments(map, at, part, slots, noise);
    return {to_segment(at, own), own.dir_x, own.dir_y, noise};
}

/// If there are more different beams than this, they are gathered lane by lane.
constexpr uint32_t kSharedMax = kLanes == 1 ? 1 : static_cast<uint32_t>(kLanes) * 3 / 8;

/// The places of the neighbours of one kind in the neighbourhood: [first, first + n).
struct GatherTo {
    size_t first, n;
};

/// Sums over the beams of the chosen hits: of facing() and of the directions, each times the weight
/// of the hit, and of the weights.
template <class F> struct BeamSums {
    F facing, dir_x, dir_y, weight;
};

/// Put the chosen neighbours of each lane into the neighbourhood, as points relative to the query,
/// with their noise. A neighbour that was not found becomes an absent point. Returns the sums over
/// the beams; if the parameters `vote` and `line` are 0, the sums are 0.
template <class Part>
BeamSums<F> gather(const gpom_map &map, Workspace &work, const NearestK<F> &nearest,
                   const Part &part, const GatherTo &to)
{
    const gpom_params_t &params = map.config.params;
    const Offset<F> at = work.packet->at;
    const Neighbourhood<F> points = work.points;
    const F zero = lane::splat<F>(0.0f);
    const float softness_m2 = params.n_fading > 0 ? kFacingSoftness_m2 : 0.0f;
    const bool has_sums = params.vote != 0.0f || params.line != 0.0f;
    BeamSums<F> sums = {zero, zero, zero, zero};
    uint32_t n_beams = 0; // different beams at the rank before this one
    for (size_t j = to.first; j < to.first + to.n; ++j) {
        const I slots = nearest.best[j - to.first].slot;
        const F weight = points.weight[j];
        const Gathered own = n_beams <= kSharedMax ? gather_shared(map, at, part, slots, n_beams)
                                                   : gather_each(map, at, part, slots);
        points.x_m[j] = own.point.x_m;
        points.y_m[j] = own.point.y_m;
        points.noise[j] =
            params.n_fading > 0 ? fading_noise(own.noise, map.prior_variance, weight) : own.noise;
        if (has_sums) {
            sums.facing = sums.facing + weight * facing(own.point.x_m, own.point.y_m, own.dir_x,
                                                        own.dir_y, softness_m2);
            sums.dir_x = sums.dir_x + weight * own.dir_x;
            sums.dir_y = sums.dir_y + weight * own.dir_y;
            sums.weight = sums.weight + lane::select(slots >= 0, weight, zero);
        }
    }
    return sums;
}

/// For each lane, how many of the first n entries hold a beam.
inline F count_found(const NearestK<F> &nearest, size_t n)
{
    F count = lane::splat<F>(0.0f);
    for (size_t j = 0; j < n; ++j) {
        count = count +
                lane::select(nearest.best[j].slot >= 0, lane::splat<F>(1.0f), lane::splat<F>(0.0f));
    }
    return count;
}

/// True if a lane has two of its n neighbours at the same distance. Only such neighbours can be
/// equal points.
inline bool has_ties(const NearestK<F> &nearest, size_t n)
{
    for (size_t j = 1; j < n; ++j) {
        const F d2 = nearest.best[j].d2;
        if (lane::any((d2 == nearest.best[j - 1].d2) & (d2 < kNoDistance2))) {
            return true;
        }
    }
    return false;
}

/// The offset that is added to alpha mu in eq. 7: beta and the terms of context.hpp (params.h).
template <class F>
inline F context_offset(const gpom_params_t &params, const Neighbourhood<F> &points,
                        const BeamSums<F> &sums, const HitAxis<F> &axis)
{
    F offset = lane::splat<F>(params.beta);
    if (has_log_terms(params)) {
        offset = offset + log_terms(params, points);
    }
    if (params.vote != 0.0f || params.line != 0.0f) {
        const F n = lane::max(sums.weight, lane::splat<F>(1.0f));
        const F mean = sums.facing / n;
        const F near = nearness(points);
        offset = offset + params.vote * mean * near;
        if (params.line != 0.0f) {
            offset = offset +
                     params.line * near * behind_line(axis, F(sums.dir_x / n), F(sums.dir_y / n));
        }
    }
    return offset;
}

/// A search for one kind of neighbours, hits or free segments.
template <class Part> struct KindSearch {
    const Part &part;
    NearestK<F> &nearest;
    SearchStart &start;
};

/// The walks of a search of the vicinity of queries that moved by `move`. With one lane the search
/// starts at the root, because a search start saves no time on the small map of a microcontroller.
template <class Part>
Walks walks_in(const gpom_map &map, const Workspace &work, const KindSearch<Part> &kind,
               const Vicinity<F> &around, const Offset<F> &move)
{
    const KdTree &tree = tree_of(map.index, kind.part);
    const uint32_t walk_max = map.config.walk_max;
    if constexpr (kLanes > 1) {
        bool has_start = suits(kind.start, around);
        if (!has_start && is_worth_finding(around, lane::sqrt(move.distance2()))) {
            find_start(kind.start, tree, kind.part, around, work.stack);
            has_start = true;
        }
        if (has_start) {
            return from_start(kind.start, work.stack, walk_max);
        }
    }
    return from_root(tree, work.stack, walk_max);
}

/// Search for one kind, with a bound: the greatest distance that the k nearest of the packet before
/// can have now. Returns false if the k nearest may not have been found.
template <class Part>
bool search_near(const gpom_map &map, const Workspace &work, const KindSearch<Part> &kind,
                 const Offset<F> &move)
{
    const F reach2_m2 = reach2_after(kind.nearest.worst(), move);
    const Vicinity<F> around = {work.packet->at, lane::sqrt(reach2_m2)};
    const Walks walks = walks_in(map, work, kind, around, move);
    kind.nearest.clear(reach2_m2);
    const bool is_whole = search(kind.nearest, around.at, map.index, kind.part, walks);
    return is_whole && kind.nearest.has_all();
}

/// Search for one kind without a bound. Returns false if the search was cut.
template <class Part>
bool search_all(const gpom_map &map, const Workspace &work, const KindSearch<Part> &kind)
{
    kind.nearest.clear();
    const Walks walks = from_root(tree_of(map.index, kind.part), work.stack, map.config.walk_max);
    return search(kind.nearest, work.packet->at, map.index, kind.part, walks);
}

/// Search for hits and free segments. The result of the packet before bounds the search, because
/// without a bound a search first collects many far neighbours and replaces them later. If the
/// bounded search may have missed neighbours, a second search runs without a bound. Returns false
/// if the second search was cut.
inline bool search_both(const gpom_map &map, Workspace &work)
{
    const KindSearch<HitPart> hits = {map.index.hit_part, work.hits, work.hit_start};
    const KindSearch<FreePart> free = {map.index.free_part, work.free, work.free_start};
    const Offset<F> at = work.packet->at;
    const Offset<F> before = work.searched_at;
    const Offset<F> move = {at.x_m - before.x_m, at.y_m - before.y_m};
    bool is_whole = false;
    if (work.has_searched) {
        const bool has_hits = search_near(map, work, hits, move);
        const bool has_free = search_near(map, work, free, move);
        is_whole = has_hits && has_free;
    }
    if (!is_whole) {
        const bool has_hits = search_all(map, work, hits);
        const bool has_free = search_all(map, work, free);
        is_whole = has_hits && has_free;
    }
    work.searched_at = at;
    work.has_searched = is_whole;
    return is_whole;
}

/// Merge equal points of a kind, then shrink all points along the hits' main axis.
template <class F>
inline void merge_and_shrink(const gpom_params_t &params, const Workspace &work,
                             const Neighbourhood<F> &p, const HitAxis<F> &axis)
{
    // Equal points are merged before points are shrunk. Shrinking can make points equal in a lane
    // without ties. They would then be merged only if another lane of the packet had ties, so that
    // an answer would depend on the other queries of the packet.
    if (has_ties(work.hits, p.n_hits)) {
        merge_equal(p.x_m, p.y_m, p.noise, p.n_hits);
    }
    if (has_ties(work.free, p.n_free)) {
        merge_equal(p.x_m + p.n_hits, p.y_m + p.n_hits, p.noise + p.n_hits, p.n_free);
    }
    if (params.anisotropy > 0.0f) {
        shrink_along_hits(p, axis, params.anisotropy);
    }
}

/// Choose and prepare the neighbourhoods of a packet, from what search_both() found. Returns
/// context_offset().
inline F prepare_neighbours(const gpom_map &map, Workspace &work)
{
    const gpom_params_t &params = map.config.params;
    const Neighbourhood<F> &p = work.points;
    choose<F>(map, work.hits, p.weight, params.n_hits, nullptr);
    choose<F>(map, work.free, p.weight + p.n_hits, params.n_free, nullptr);
    const BeamSums<F> sums = gather(map, work, work.hits, map.index.hit_part, {0, p.n_hits});
    gather(map, work, work.free, map.index.free_part, {p.n_hits, p.n_free});
    HitAxis<F> axis = {};
    if (params.anisotropy > 0.0f || params.line != 0.0f) {
        axis = axis_of_hits(p);
    }
    const F offset = context_offset(params, p, sums, axis);
    merge_and_shrink(params, work, p, axis);
    return offset;
}

} // namespace gpom
