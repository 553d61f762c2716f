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

/// Squared distance of nothing: beyond it no item counts.
constexpr float kNoDistance2 = 1e29f;

/// The best k so far of each lane, ascending. Arrays of k lanes in scratch memory.
template <class F> struct NearestK {
    using I = lane::IntOf<F>;
    F *d2;
    I *id;
    I *place; ///< Where the item stands: see Places.
    uint32_t k;

    void clear()
    {
        for (uint32_t j = 0; j < k; ++j) {
            d2[j] = lane::splat<F>(kNoDistance2);
            id[j] = lane::splat_int<I>(kNoId);
            place[j] = lane::splat_int<I>(-1);
        }
    }

    /// Insert an item where it ranks; what ranked last is gone.
    void offer(F item_d2, int32_t item_id, int32_t item_place)
    {
        I new_id = lane::splat_int<I>(item_id);
        I new_place = lane::splat_int<I>(item_place);
        for (uint32_t j = 0; j < k; ++j) {
            const auto before = (item_d2 < d2[j]) | ((item_d2 == d2[j]) & (new_id < id[j]));
            const F kept_d2 = d2[j];
            const I kept_id = id[j];
            const I kept_place = place[j];
            d2[j] = lane::select(before, item_d2, kept_d2);
            id[j] = lane::select(before, new_id, kept_id);
            place[j] = lane::select(before, new_place, kept_place);
            item_d2 = lane::select(before, kept_d2, item_d2);
            new_id = lane::select(before, kept_id, new_id);
            new_place = lane::select(before, kept_place, new_place);
        }
    }

    F worst() const { return d2[k - 1]; }
};

/// Vectors from the queries to an item's closest point.
template <class F> struct Offset {
    F x_m, y_m;

    F distance2() const { return lane::fma(x_m, x_m, F(y_m * y_m)); }
};

template <class F> inline Offset<F> to_hit(F x_m, F y_m, F hit_x_m, F hit_y_m)
{
    return {hit_x_m - x_m, hit_y_m - y_m};
}

/// Eq. 10: the foot of the perpendicular on the beam, kept on the segment.
template <class F> struct SegmentLanes {
    F x_m, y_m, dir_x, dir_y, length_m;
};

template <class F> inline Offset<F> to_segment(F x_m, F y_m, const SegmentLanes<F> &s)
{
    const F from_x = s.x_m - x_m;
    const F from_y = s.y_m - y_m;
    const F along = -lane::fma(from_x, s.dir_x, F(from_y * s.dir_y));
    const F t = lane::min(lane::max(along, lane::splat<F>(0.0f)), s.length_m);
    return {lane::fma(t, s.dir_x, from_x), lane::fma(t, s.dir_y, from_y)};
}

template <class F> inline Offset<F> to_item(F x_m, F y_m, const HitLeaf &leaf, uint32_t i)
{
    return to_hit(x_m, y_m, lane::splat<F>(leaf.x_m[i]), lane::splat<F>(leaf.y_m[i]));
}

template <class F> inline SegmentLanes<F> splat(const Segment &s)
{
    return {lane::splat<F>(s.x_m), lane::splat<F>(s.y_m), lane::splat<F>(s.dir_x),
            lane::splat<F>(s.dir_y), lane::splat<F>(s.length_m)};
}

template <class F> inline Offset<F> to_item(F x_m, F y_m, const SegmentLeaf &leaf, uint32_t i)
{
    return to_segment(x_m, y_m,
                      splat<F>({leaf.x_m[i], leaf.y_m[i], leaf.dir_x[i], leaf.dir_y[i],
                                leaf.length_m[i]}));
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

/// Offer every item of a leaf that at least one lane wants.
template <class F, class Leaf>
inline void offer_leaf(NearestK<F> &nearest, const Leaf &leaf, int32_t first_place, Offset<F> at)
{
    for (uint32_t i = 0; i < kLeafSize; ++i) {
        const F d2 = to_item(at.x_m, at.y_m, leaf, i).distance2();
        if (lane::any(d2 <= nearest.worst())) {
            nearest.offer(d2, leaf.id[i], first_place + static_cast<int32_t>(i));
        }
    }
}

/// Offer the items of a tree: one walk for all lanes, nearer child of the packet's first query
/// first, skipping boxes that no lane needs. `stack` has kDepthMax entries; `at` are the queries.
/// At most every node and leaf is visited once.
template <class F, class Leaf>
void search_tree(NearestK<F> &nearest, const KdTree<Leaf> &tree, Offset<F> at, Subtree *stack)
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
            offer_leaf(nearest, tree.leaves[t.first_leaf],
                       static_cast<int32_t>(t.first_leaf * kLeafSize), at);
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
