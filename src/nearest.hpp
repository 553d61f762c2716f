/// \file nearest.hpp
/// The k nearest hits and the k nearest points on free segments (eq. 10) for W queries at once.
///
/// Exact, and ordered by (squared distance, id): whatever the order in which items are offered, the
/// same k remain, so that a tree, a list, and any packet of queries agree.
#pragma once

#include "src/kdtree.hpp"
#include "src/lane.hpp"

namespace gpom
{

/// Squared distance and id of nothing: any beam ranks before it.
constexpr float kNoDistance2 = 1e29f;
constexpr int32_t kNoId = INT32_MAX;

/// The best k so far of each lane, ascending. Arrays of k lanes in scratch memory.
template <class F> struct NearestK {
    using I = lane::IntOf<F>;
    F *d2;
    I *id;
    I *slot; ///< Its beam's index in the store, or -1.
    uint32_t k;

    void clear()
    {
        for (uint32_t j = 0; j < k; ++j) {
            d2[j] = lane::splat<F>(kNoDistance2);
            id[j] = lane::splat_int<I>(kNoId);
            slot[j] = lane::splat_int<I>(-1);
        }
    }

    /// Insert an item where it ranks, from the back: entries behind it move up, the last is gone.
    void offer(F item_d2, int32_t item_id, int32_t item_slot)
    {
        const I new_id = lane::splat_int<I>(item_id);
        const I new_slot = lane::splat_int<I>(item_slot);
        auto beats = ranks_before(item_d2, new_id, k - 1);
        for (uint32_t j = k - 1; j > 0; --j) {
            const auto beats_next = ranks_before(item_d2, new_id, j - 1);
            d2[j] = lane::select(beats_next, d2[j - 1], lane::select(beats, item_d2, d2[j]));
            id[j] = lane::select(beats_next, id[j - 1], lane::select(beats, new_id, id[j]));
            slot[j] = lane::select(beats_next, slot[j - 1], lane::select(beats, new_slot, slot[j]));
            if (!lane::any(beats_next)) {
                return;
            }
            beats = beats_next;
        }
        d2[0] = lane::select(beats, item_d2, d2[0]);
        id[0] = lane::select(beats, new_id, id[0]);
        slot[0] = lane::select(beats, new_slot, slot[0]);
    }

    auto ranks_before(F item_d2, I item_id, uint32_t j) const
    {
        return (item_d2 < d2[j]) | ((item_d2 == d2[j]) & (item_id < id[j]));
    }

    F worst() const { return d2[k - 1]; }
};

/// Vectors from the queries to a point.
template <class F> struct Offset {
    F x_m, y_m;

    F distance2() const { return lane::fma(x_m, x_m, F(y_m * y_m)); }
};

/// The same segment, or each lane's own.
template <class F> struct SegmentLanes {
    F x_m, y_m, dir_x, dir_y, length_m;
};

/// From the queries `at` to the closest point of a segment (eq. 10): the foot of the perpendicular,
/// kept on the segment.
template <class F> inline Offset<F> to_segment(const Offset<F> &at, const SegmentLanes<F> &s)
{
    const F from_x = s.x_m - at.x_m;
    const F from_y = s.y_m - at.y_m;
    const F along = -lane::fma(from_x, s.dir_x, F(from_y * s.dir_y));
    const F t = lane::min(lane::max(along, lane::splat<F>(0.0f)), s.length_m);
    return {lane::fma(t, s.dir_x, from_x), lane::fma(t, s.dir_y, from_y)};
}

template <class F> inline SegmentLanes<F> splat(const Segment &s)
{
    return {lane::splat<F>(s.x_m), lane::splat<F>(s.y_m), lane::splat<F>(s.dir_x),
            lane::splat<F>(s.dir_y), lane::splat<F>(s.length_m)};
}

template <class F> inline void set_segment(SegmentLanes<F> &lanes, int i, const Segment &s)
{
    lane::set(lanes.x_m, i, s.x_m);
    lane::set(lanes.y_m, i, s.y_m);
    lane::set(lanes.dir_x, i, s.dir_x);
    lane::set(lanes.dir_y, i, s.dir_y);
    lane::set(lanes.length_m, i, s.length_m);
}

/// Squared distances from the queries to one part of a beam.
template <class F> inline F distance2(const Offset<F> &at, const FreePart &part, const Beam &beam)
{
    return to_segment(at, splat<F>(part(beam))).distance2();
}

/// For a hit of no depth the same number with fewer operations.
template <class F> inline F distance2(const Offset<F> &at, const HitPart &part, const Beam &beam)
{
    const Segment hit = part(beam);
    if (hit.length_m > 0.0f) {
        return to_segment(at, splat<F>(hit)).distance2();
    }
    return Offset<F>{hit.x_m - at.x_m, hit.y_m - at.y_m}.distance2();
}

/// Squared distance to a box, shortened by more than float rounding so that it never exceeds the
/// computed distance of an item inside.
template <class F> inline F box_distance2(const Box &box, F x_m, F y_m)
{
    const F zero = lane::splat<F>(0.0f);
    const F dx = lane::max(lane::max(F(box.x_min_m - x_m), F(x_m - box.x_max_m)), zero);
    const F dy = lane::max(lane::max(F(box.y_min_m - y_m), F(y_m - box.y_max_m)), zero);
    return 0.999999f * lane::fma(dx, dx, F(dy * dy));
}

/// Ids from `first` up to, not including, `end`.
struct IdRange {
    uint32_t first, end;

    bool has(uint32_t id) const { return id - first < end - first; }
};

/// A slot of the store as a tree or list names it.
struct Listed {
    const Beam *beams;
    uint32_t slot;
    IdRange ids; ///< Of the beams that it may mean.
};

/// Offer one part of a beam if a lane wants it, a query may see it, and its id is in range: a slot
/// may have got another beam since it was listed.
template <class F, class Part>
inline void offer_beam(NearestK<F> &nearest, const Offset<F> &at, const Part &part,
                       const Listed &listed)
{
    const Beam &beam = listed.beams[listed.slot];
    const F d2 = distance2(at, part, beam);
    if (lane::any(d2 <= nearest.worst()) && Part::is_seen(beam) && listed.ids.has(beam.id)) {
        nearest.offer(d2, static_cast<int32_t>(beam.id), static_cast<int32_t>(listed.slot));
    }
}

/// Offer the beams of a tree: one walk for all lanes, the child nearer to the packet's first query
/// first, skipping boxes that no lane needs. At most every node and leaf is visited once.
///
/// at     the queries, relative to the map's origin.
/// stack  kDepthMax entries.
template <class F, class Part>
void search_tree(NearestK<F> &nearest, const Offset<F> &at, const Part &part, const KdTree &tree,
                 Subtree *stack)
{
    const float x_m = lane::get(at.x_m, 0);
    const float y_m = lane::get(at.y_m, 0);
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = {0, 0, leaf_count(tree.n_items)};
    }
    while (depth > 0) {
        const Subtree t = stack[--depth];
        if (!lane::any(box_distance2(tree.boxes[t.node], at.x_m, at.y_m) <= nearest.worst())) {
            continue;
        }
        if (t.n_leaves == 1) {
            const Stretch slots = slots_of(tree, t);
            for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
                offer_beam(nearest, at, part, {tree.beams, tree.slots[i], {0, tree.id_end}});
            }
            continue;
        }
        const Subtree left = left_of(t);
        const Subtree right = right_of(t);
        const bool left_first = box_distance2(tree.boxes[left.node], x_m, y_m) <=
                                box_distance2(tree.boxes[right.node], x_m, y_m);
        stack[depth++] = left_first ? right : left;
        stack[depth++] = left_first ? left : right;
    }
}

} // namespace gpom
