/// \file neighbours.hpp
/// From a packet of queries to their neighbourhoods: search, choice, points relative to the query.
#pragma once

#include "src/beams/search_start.hpp"
#include "src/gp/context.hpp"
#include "src/query/workspace.hpp"

namespace gpom
{

/// Of the points of one lane that are chosen so far, those of one scan: how many, and the places of
/// the last one and of the one before.
struct OfScan {
    uint32_t n, last, before;
};

inline OfScan of_scan(const NearestK<F> &nearest, const Beam *beams, int i_lane, uint32_t n_chosen,
                      uint16_t scan)
{
    OfScan same = {0, 0, 0};
    for (uint32_t j = 0; j < n_chosen; ++j) {
        const int32_t slot = lane::get(nearest.best[j].slot, i_lane);
        if (beams[slot].scan == scan) {
            same = {same.n + 1, j, same.last};
        }
    }
    return same;
}

/// Where the neighbours of one kind are chosen, and how they fade: the weights of n of them, and
/// the distances at which the fading starts and ends.
struct Fading {
    F *weight;
    uint32_t n;
    F from_m, end_m;
};

inline float distance_m(const NearestK<F> &nearest, uint32_t rank, int i_lane)
{
    return lane::sqrt(lane::get(nearest.best[rank].d2, i_lane));
}

/// The last point that the cap leaves of a scan fades from the distance of the one before, if there
/// is one, to that of the first point left out, or of the pool's last.
inline void fade_last_of_scan(const NearestK<F> &nearest, const Fading &fading, int i_lane,
                              const OfScan &of, float end_m)
{
    const float from_m = of.n > 1 ? distance_m(nearest, of.before, i_lane) : 0.0f;
    const float weight = fading_weight(distance_m(nearest, of.last, i_lane), from_m, end_m);
    lane::set(fading.weight[of.last], i_lane,
              lane::min(weight, lane::get(fading.weight[of.last], i_lane)));
}

/// cap_scans() of one lane.
inline void cap_scans_of(const gpom_map &map, NearestK<F> &nearest, Fading &fading, int i_lane)
{
    const gpom_params_t &params = map.config.params;
    const bool fades = params.n_fading > 0;
    const float pool_end_m = lane::get(fading.end_m, i_lane);
    uint32_t n_chosen = 0;
    for (uint32_t j = 0; j < nearest.k && (fades || n_chosen < fading.n); ++j) {
        const int32_t slot = lane::get(nearest.best[j].slot, i_lane);
        if (slot < 0) {
            break;
        }
        const OfScan same =
            of_scan(nearest, map.index.beams, i_lane, n_chosen, map.index.beams[slot].scan);
        const float d2 = lane::get(nearest.best[j].d2, i_lane);
        if (same.n == params.scan_points_max) {
            if (fades) {
                fade_last_of_scan(nearest, fading, i_lane, same, lane::sqrt(d2));
            }
        } else if (n_chosen == fading.n) {
            lane::set(fading.end_m, i_lane,
                      lane::min(lane::sqrt(d2), lane::get(fading.end_m, i_lane)));
        } else {
            lane::set(nearest.best[n_chosen].slot, i_lane, slot);
            lane::set(nearest.best[n_chosen].d2, i_lane, d2);
            if (fades && same.n + 1 == params.scan_points_max) {
                fade_last_of_scan(nearest, fading, i_lane, {same.n + 1, n_chosen, same.last},
                                  pool_end_m);
            }
            ++n_chosen;
        }
    }
    for (uint32_t j = n_chosen; j < fading.n; ++j) {
        lane::set(nearest.best[j].slot, i_lane, int32_t{-1});
        lane::set(nearest.best[j].d2, i_lane, kNoDistance2);
    }
}

/// Choose n of the pool in its order, at most scan_points_max of any scan; they become the first n
/// entries, -1 where there are fewer. Beams of one scan share its errors and its view; a cap keeps
/// them from being taken for independent witnesses.
inline void cap_scans(const gpom_map &map, NearestK<F> &nearest, Fading &fading)
{
    for (int i = 0; i < kLanes; ++i) {
        cap_scans_of(map, nearest, fading, i);
    }
}

/// Choose n neighbours of one kind out of what was found, and their weights.
inline void choose(const gpom_map &map, NearestK<F> &nearest, F *weight, uint32_t n)
{
    const gpom_params_t &params = map.config.params;
    const uint32_t n_whole = n - params.n_fading;
    for (uint32_t j = 0; j < n; ++j) {
        weight[j] = lane::splat<F>(1.0f);
    }
    Fading fading = {weight, n, lane::sqrt(nearest.best[n_whole - 1].d2),
                     lane::sqrt(nearest.worst())};
    if (params.scan_points_max > 0) {
        cap_scans(map, nearest, fading);
    }
    if (params.n_fading == 0) {
        return;
    }
    for (uint32_t j = params.scan_points_max > 0 ? 0 : n_whole; j < n; ++j) {
        const F d_m = lane::sqrt(nearest.best[j].d2);
        weight[j] = weight[j] * fading_weight(d_m, fading.from_m, fading.end_m);
    }
}

/// One chosen neighbour of each lane: the point from its query, its beam's direction and its noise
/// variance. A lane without one has zeros, and kAbsentNoise.
struct Gathered {
    Offset<F> point;
    F dir_x, dir_y, noise;
};

/// Where queries near each other share their neighbours: each different beam is looked at once, for
/// all lanes, and kept where it was chosen. n_beams: how many there were.
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

/// The same lane by lane: faster where most lanes have a beam of their own.
template <class Part>
Gathered gather_each(const gpom_map &map, const Offset<F> &at, const Part &part, I slots)
{
    SegmentLanes<F> own = {};
    F noise = lane::splat<F>(kAbsentNoise);
    for (int i = 0; i < kLanes; ++i) {
        const int32_t slot = lane::get(slots, i);
        Segment segment = {lane::get(at.x_m, i), lane::get(at.y_m, i), 0.0f, 0.0f, 0.0f};
        if (slot >= 0) {
            const Beam &beam = map.index.beams[slot];
            segment = part(beam);
            lane::set(noise, i, noise_of(map, beam, part));
        }
        set_segment(own, i, segment);
    }
    return {to_segment(at, own), own.dir_x, own.dir_y, noise};
}

/// More different beams than this are gathered lane by lane.
constexpr uint32_t kSharedMax = kLanes == 1 ? 1 : static_cast<uint32_t>(kLanes) * 3 / 8;

/// Where the neighbours of a kind go in the neighbourhood.
struct GatherTo {
    size_t first, n;
};

/// What the beams of the chosen hits say, summed, each counting its weight: facing(), their
/// directions, and the weights.
struct BeamSums {
    F facing, dir_x, dir_y, weight;
};

/// Bring the chosen neighbours into the neighbourhood: each lane's own beams as points relative to
/// its query, with their noise; one that was not found is absent. Returns the beams' sums, zero
/// where no parameter asks for them.
template <class Part>
BeamSums gather(const gpom_map &map, Workspace &work, const NearestK<F> &nearest, const Part &part,
                const GatherTo &to)
{
    const gpom_params_t &params = map.config.params;
    const Offset<F> at = work.packet->at;
    const Neighbourhood<F> points = work.points;
    const F zero = lane::splat<F>(0.0f);
    const float softness_m2 = params.n_fading > 0 ? kFacingSoftness_m2 : 0.0f;
    const bool has_sums = params.vote != 0.0f || params.line != 0.0f;
    BeamSums sums = {zero, zero, zero, zero};
    uint32_t n_beams = 0; // of the rank before
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

/// How many of the first n entries of each lane were found.
inline F count_found(const NearestK<F> &nearest, size_t n)
{
    F count = lane::splat<F>(0.0f);
    for (size_t j = 0; j < n; ++j) {
        count = count +
                lane::select(nearest.best[j].slot >= 0, lane::splat<F>(1.0f), lane::splat<F>(0.0f));
    }
    return count;
}

/// True if a lane has two of n neighbours at the same distance: only those can be equal points.
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

/// What is added to alpha mu in eq. 7: beta, and what context says (params.h).
inline F context_offset(const gpom_params_t &params, const Workspace &work, const BeamSums &sums,
                        const HitAxis<F> &axis)
{
    F offset = lane::splat<F>(params.beta);
    if (has_log_terms(params)) {
        offset = offset + log_terms(params, work.points);
    }
    if (params.vote != 0.0f || params.line != 0.0f) {
        const F n = lane::max(sums.weight, lane::splat<F>(1.0f));
        const F mean = sums.facing / n;
        const F near = nearness(work.points);
        offset = offset + params.vote * mean * near;
        if (params.line != 0.0f) {
            offset = offset +
                     params.line * near * behind_line(axis, F(sums.dir_x / n), F(sums.dir_y / n));
        }
    }
    return offset;
}

/// What a search for one kind works with.
template <class Part> struct KindSearch {
    const Part &part;
    NearestK<F> &nearest;
    SearchStart &start;
};

/// Where to search for what is in a vicinity of queries that moved by `move`. A single query starts
/// at the root: on a microcontroller's small map a search start would not pay.
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

/// Search for one kind no farther than the k nearest of the packet before may be by now. Returns
/// false if the k nearest may not have been found.
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

/// Search for one kind without a bound. Returns false if it was cut.
template <class Part>
bool search_all(const gpom_map &map, const Workspace &work, const KindSearch<Part> &kind)
{
    kind.nearest.clear();
    const Walks walks = from_root(tree_of(map.index, kind.part), work.stack, map.config.walk_max);
    return search(kind.nearest, work.packet->at, map.index, kind.part, walks);
}

/// Search for both kinds. What the packet before found bounds how far to look, which saves most of
/// what a search takes into its lists only to drop it again; should it not suffice, there is a
/// second search without a bound. Returns false if that was cut.
inline bool search_both(const gpom_map &map, Workspace &work)
{
    const KindSearch<HitPart> hits = {map.index.hit_part, work.hits, work.hit_start};
    const KindSearch<FreePart> free = {map.index.free_part, work.free, work.free_start};
    const Offset<F> at = work.packet->at;
    const Offset<F> before = work.searched_at;
    const Offset<F> move = {at.x_m - before.x_m, at.y_m - before.y_m};
    bool is_whole = false;
    if (work.has_searched) {
        is_whole = search_near(map, work, hits, move);
        is_whole = search_near(map, work, free, move) && is_whole;
    }
    if (!is_whole) {
        is_whole = search_all(map, work, hits);
        is_whole = search_all(map, work, free) && is_whole;
    }
    work.searched_at = at;
    work.has_searched = is_whole;
    return is_whole;
}

/// Find, choose and prepare the neighbourhoods of a packet. Returns context_offset().
inline F find_neighbours(const gpom_map &map, Workspace &work)
{
    const gpom_params_t &params = map.config.params;
    work.is_cut = !search_both(map, work);
    const Neighbourhood<F> &p = work.points;
    choose(map, work.hits, p.weight, params.n_hits);
    choose(map, work.free, p.weight + p.n_hits, params.n_free);
    const BeamSums sums = gather(map, work, work.hits, map.index.hit_part, {0, p.n_hits});
    gather(map, work, work.free, map.index.free_part, {p.n_hits, p.n_free});
    HitAxis<F> axis = {};
    if (params.anisotropy > 0.0f || params.line != 0.0f) {
        axis = axis_of_hits(p);
    }
    const F offset = context_offset(params, work, sums, axis);
    // Before points are shrunk: after that a lane without ties may have equal points, too, which
    // would be merged only if another lane of its packet had ties.
    if (has_ties(work.hits, p.n_hits)) {
        merge_equal(p.x_m, p.y_m, p.noise, p.n_hits);
    }
    if (has_ties(work.free, p.n_free)) {
        merge_equal(p.x_m + p.n_hits, p.y_m + p.n_hits, p.noise + p.n_hits, p.n_free);
    }
    if (params.anisotropy > 0.0f) {
        shrink_along_hits(p, axis, params.anisotropy);
    }
    return offset;
}

} // namespace gpom
