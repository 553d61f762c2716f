/// \file kdtree.hpp
/// Static KD-trees over one part of each beam, hits or free segments, in fixed arrays.
///
/// The tree is balanced over leaves of kLeafSize beams and laid out in preorder without pointers: a
/// node over m leaves has its left child, over m / 2 leaves, right behind it and its right child
/// 2 (m / 2) places on. A node is only the bounding box of its items; leaf i holds the slots
/// [kLeafSize i, kLeafSize (i + 1)), which name beams of the store.
///
/// Splits halve the items at the median of the widest coordinate of their two ends: a segment is a
/// point in four dimensions, a hit one in two (Bentley 1975).
#pragma once

#include "src/beams/beam.hpp"
#include "src/lane/lane.hpp"
#include "src/lane/select.hpp"

#include <float.h>
#include <stddef.h>

namespace gpom
{

constexpr uint32_t kLeafSize = 8;
/// Entries of the stack that walks and builds need; see GPOM_BEAM_MAX.
constexpr uint32_t kDepthMax = 24;

constexpr uint32_t leaf_count(uint32_t n_items) { return (n_items + kLeafSize - 1) / kLeafSize; }
/// Nodes of a tree, and one more so that the smallest has room.
constexpr uint32_t node_count(uint32_t n_items) { return 2 * leaf_count(n_items); }

/// A segment's far end and closest point are computed with rounding errors of about 2^-23 of its
/// length and coordinates; the box is widened by more than that, so that no box is ever farther
/// than an item inside it.
constexpr float kBoxSlack = 1e-6f;

struct Box {
    float x_min_m, y_min_m, x_max_m, y_max_m;
};

/// Around nothing.
inline Box empty_box() { return {FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX}; }

/// Make a box large enough for one more segment.
inline void include(Box &box, const Segment &s)
{
    const Point end = end_of(s);
    const float slack_m = kBoxSlack * (lane::abs(s.length_m) + lane::abs(s.x_m) + lane::abs(s.y_m));
    box = {lane::min(box.x_min_m, lane::min(s.x_m, end.x_m) - slack_m),
           lane::min(box.y_min_m, lane::min(s.y_m, end.y_m) - slack_m),
           lane::max(box.x_max_m, lane::max(s.x_m, end.x_m) + slack_m),
           lane::max(box.y_max_m, lane::max(s.y_m, end.y_m) + slack_m)};
}

/// True if two boxes come within reach_m of each other, in x and in y. All four comparisons at
/// once: which of them fails first, no processor guesses.
inline bool are_near(const Box &a, const Box &b, float reach_m)
{
    return (a.x_min_m <= b.x_max_m + reach_m) & (b.x_min_m <= a.x_max_m + reach_m) &
           (a.y_min_m <= b.y_max_m + reach_m) & (b.y_min_m <= a.y_max_m + reach_m);
}

/// A part of a tree: a node and the leaves below it.
struct Subtree {
    uint32_t node, first_leaf, n_leaves;
};

inline Subtree left_of(const Subtree &t) { return {t.node + 1, t.first_leaf, t.n_leaves / 2}; }
inline Subtree right_of(const Subtree &t)
{
    const uint32_t n_left = t.n_leaves / 2;
    return {t.node + 2 * n_left, t.first_leaf + n_left, t.n_leaves - n_left};
}

/// A tree in the map's arena.
struct KdTree {
    const Beam *beams; ///< The store.
    Box *boxes;        ///< node_count(n_items).
    uint32_t *slots;   ///< n_items indices into the beam store, leaf by leaf.
    uint32_t n_items;
    uint32_t id_end; ///< It knows the beams whose id is less; others in its slots are not its own.
};

/// The whole tree.
inline Subtree root_of(const KdTree &tree) { return {0, 0, leaf_count(tree.n_items)}; }

/// Slots of a subtree: a stretch of KdTree::slots.
struct Stretch {
    uint32_t first, n;
};

inline Stretch slots_of(const KdTree &tree, const Subtree &t)
{
    const uint32_t first = t.first_leaf * kLeafSize;
    const uint32_t n_max = t.n_leaves * kLeafSize;
    const uint32_t n_left = tree.n_items - first;
    return {first, n_left < n_max ? n_left : n_max};
}

/// Smallest and greatest value of a coordinate.
struct Extent {
    float low = FLT_MAX;
    float high = -FLT_MAX;

    void include(float c)
    {
        low = lane::min(low, c);
        high = lane::max(high, c);
    }
};

/// Extents of the four coordinates of segments' ends, and how far rounding may reach.
struct Extents {
    Extent axis[4];
    float slack_m = 0.0f;
};

/// Building a tree in slices: subtrees still to do, and the work on the topmost: first the extents
/// of its items, then, unless it is a leaf, the selection of the median.
struct TreeBuild {
    Subtree stack[kDepthMax];
    uint32_t depth;
    uint32_t i_item; ///< Items of the topmost subtree whose extents are known.
    int i_axis;      ///< Axis it is split along.
    Extents extents;
    Selection selection;
};

inline bool is_done(const TreeBuild &build) { return build.depth == 0; }

/// Start to build over the beams that tree.slots name.
void start_build(TreeBuild &build, const KdTree &tree);

/// Go on for at most `budget` operations, each an item looked at or a comparison. Returns those
/// used: in all (3 n + n) log2(n / 8) on average, at most (kSplitsMax + 1) n log2(n / 8).
uint32_t build_some(TreeBuild &build, KdTree &tree, const HitPart &part, uint32_t budget);
uint32_t build_some(TreeBuild &build, KdTree &tree, const FreePart &part, uint32_t budget);

} // namespace gpom
