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

/// Vectors from the queries to a point.
template <class F> struct Offset {
    F x_m, y_m;

    F distance2() const { return lane::fma(x_m, x_m, F(y_m * y_m)); }
};

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

    /// Insert an item where it ranks: entries behind it move up, the last is gone.
    void offer(F item_d2, int32_t item_id, int32_t item_slot)
    {
        if constexpr (lane::width<F> == 1) {
            offer_scalar(item_d2, item_id, item_slot);
        } else {
            offer_lanes(item_d2, lane::splat_int<I>(item_id), lane::splat_int<I>(item_slot));
        }
    }

    void offer_scalar(float item_d2, int32_t item_id, int32_t item_slot)
    {
        if (!ranks_before(item_d2, item_id, k - 1)) {
            return;
        }
        size_t j = k - 1;
        for (; j > 0 && ranks_before(item_d2, item_id, j - 1); --j) {
            d2[j] = d2[j - 1];
            id[j] = id[j - 1];
            slot[j] = slot[j - 1];
        }
        d2[j] = item_d2;
        id[j] = item_id;
        slot[j] = item_slot;
    }

    /// Each lane where it ranks there, over all k: with many lanes one always has far to go.
    void offer_lanes(F item_d2, I new_id, I new_slot)
    {
        auto beats = ranks_before(item_d2, new_id, k - 1);
        for (uint32_t j = k - 1; j > 0; --j) {
            const auto beats_next = ranks_before(item_d2, new_id, j - 1);
            d2[j] = lane::select(beats_next, d2[j - 1], lane::select(beats, item_d2, d2[j]));
            id[j] = lane::select(beats_next, id[j - 1], lane::select(beats, new_id, id[j]));
            slot[j] = lane::select(beats_next, slot[j - 1], lane::select(beats, new_slot, slot[j]));
            beats = beats_next;
        }
        d2[0] = lane::select(beats, item_d2, d2[0]);
        id[0] = lane::select(beats, new_id, id[0]);
        slot[0] = lane::select(beats, new_slot, slot[0]);
    }

    auto ranks_before(F item_d2, I item_id, size_t j) const
    {
        if constexpr (lane::width<F> == 1) {
            return item_d2 < d2[j] || (item_d2 == d2[j] && item_id < id[j]);
        } else {
            return (item_d2 < d2[j]) | ((item_d2 == d2[j]) & (item_id < id[j]));
        }
    }

    F worst() const { return d2[k - 1]; }
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
inline void offer_beam(NearestK<F> nearest, const Offset<F> &at, const Part &part,
                       const Listed &listed)
{
    const Beam &beam = listed.beams[listed.slot];
    const F d2 = distance2(at, part, beam);
    if (lane::any(d2 <= nearest.worst()) && Part::is_seen(beam) && listed.ids.has(beam.id)) {
        nearest.offer(d2, static_cast<int32_t>(beam.id), static_cast<int32_t>(listed.slot));
    }
}

/// Offer the beams of a leaf.
template <class F, class Part>
inline void offer_leaf(NearestK<F> nearest, const Offset<F> &at, const Part &part,
                       const KdTree &tree, const Subtree &leaf)
{
    const Stretch slots = slots_of(tree, leaf);
    for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
        offer_beam(nearest, at, part, {tree.beams, tree.slots[i], {0, tree.id_end}});
    }
}

/// A part of a tree and whether a lane may find something in it.
template <class F> struct Prospect {
    Subtree subtree;
    F d2; ///< To its box.
};

template <class F>
inline Prospect<F> prospect(const KdTree &tree, const Offset<F> &at, const Subtree &t)
{
    return {t, box_distance2(tree.boxes[t.node], at.x_m, at.y_m)};
}

/// The means of a search: where it puts parts of a tree that it has still to walk down, and how
/// many such walks it may take.
struct Walks {
    Subtree *stack; ///< kDepthMax entries.
    uint32_t n_max;

    Walks(Subtree *stack_, uint32_t n_max_ = UINT32_MAX) : stack(stack_), n_max(n_max_) {}
};

/// Offer the beams of a tree: one search for all lanes, the child nearer to the packet's first
/// query first, skipping boxes that no lane needs. At most every node and leaf is visited once, and
/// in each walk at most one leaf and two nodes of each level.
///
/// at       the queries, relative to the map's origin.
/// returns  false if walks.n_max walks did not suffice: nearer beams may have been missed.
///
/// Not inlined: twice in one function its inner loops run out of registers.
template <class F, class Part>
[[gnu::noinline]] bool search_tree(NearestK<F> nearest, Offset<F> at, Part part, KdTree tree,
                                   Walks walks)
{
    Subtree *const stack = walks.stack;
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = {0, 0, leaf_count(tree.n_items)};
    }
    while (depth > 0) {
        if (walks.n_max-- == 0) {
            return false;
        }
        Prospect<F> here = prospect(tree, at, stack[--depth]);
        while (lane::any(here.d2 <= nearest.worst()) && here.subtree.n_leaves > 1) {
            Prospect<F> near = prospect(tree, at, left_of(here.subtree));
            Prospect<F> far = prospect(tree, at, right_of(here.subtree));
            if (lane::get(far.d2, 0) < lane::get(near.d2, 0)) {
                const Prospect<F> left = near;
                near = far;
                far = left;
            }
            if (lane::any(far.d2 <= nearest.worst())) {
                stack[depth++] = far.subtree;
            }
            here = near;
        }
        if (lane::any(here.d2 <= nearest.worst())) {
            offer_leaf(nearest, at, part, tree, here.subtree);
        }
    }
    return true;
}

} // namespace gpom
