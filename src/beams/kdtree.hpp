/// \file kdtree.hpp
/// Static KD-trees over one part of each beam, hits or free segments, in fixed arrays.
///
/// The tree is balanced, has leaves of kLeafSize beams, and is stored in preorder without pointers.
/// Take a node over m leaves. Its left child is over m / 2 leaves and is the next node. Its right
/// child is 2 (m / 2) nodes after it. A node is only the bounding box of its items. Leaf i holds
/// the entries [kLeafSize i, kLeafSize (i + 1)) of `slots`, which are slots of the store.
///
/// Each split halves the items at the median of a coordinate of their two ends: the coordinate with
/// the widest extent. So a segment is a point in four dimensions, and a hit is a point in two
/// (Bentley 1975).
#pragma once

#include "src/beams/beam.hpp"
#include "src/lane/four.hpp"
#include "src/lane/select.hpp"

#include <float.h>
#include <stddef.h>
#include <string.h>

namespace gpom
{

constexpr uint32_t kLeafSize = 8;
/// Entries of the stack that a walk or a build needs, at most, for GPOM_BEAM_MAX beams.
constexpr uint32_t kDepthMax = 24;

constexpr uint32_t leaf_count(uint32_t n_items) { return (n_items + kLeafSize - 1) / kLeafSize; }
/// Room for the nodes of a tree. A tree over m leaves has 2 m - 1 nodes; one entry stays unused.
constexpr uint32_t node_count(uint32_t n_items) { return 2 * leaf_count(n_items); }

/// The far end and the closest point of a segment are computed with rounding errors of about 2^-23
/// of its length and coordinates. A box is widened by more than these errors, so that a box is
/// never farther away than an item inside it.
constexpr float kBoxSlack = 1e-6f;

struct Box {
    float x_min_m, y_min_m, x_max_m, y_max_m;
};

/// A box in registers (lane::load_four()).
template <int block> inline Box load_box(const Box &from)
{
    float corners[4];
    lane::load_four<block>(&from.x_min_m, corners);
    return {corners[0], corners[1], corners[2], corners[3]};
}

/// A box around nothing.
inline Box empty_box() { return {FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX}; }

/// Enlarge a box by one segment.
inline void include(Box &box, const Segment &s)
{
    const Point end = end_of(s);
    const float slack_m = kBoxSlack * (lane::abs(s.length_m) + lane::abs(s.x_m) + lane::abs(s.y_m));
    box = {lane::min(box.x_min_m, lane::min(s.x_m, end.x_m) - slack_m),
           lane::min(box.y_min_m, lane::min(s.y_m, end.y_m) - slack_m),
           lane::max(box.x_max_m, lane::max(s.x_m, end.x_m) + slack_m),
           lane::max(box.y_max_m, lane::max(s.y_m, end.y_m) + slack_m)};
}

/// The same box with reach_m more on each side.
inline Box widened(const Box &box, float reach_m)
{
    return {box.x_min_m - reach_m, box.y_min_m - reach_m, box.x_max_m + reach_m,
            box.y_max_m + reach_m};
}

inline bool is_inside(const Box &box, const Point &at)
{
    return (at.x_m >= box.x_min_m) & (at.x_m <= box.x_max_m) & (at.y_m >= box.y_min_m) &
           (at.y_m <= box.y_max_m);
}

/// A rectangle that many boxes are compared with. No branch tells which side of a box is outside,
/// because a processor cannot predict it. One lane: the greatest of four differences decides.
template <int W> struct AreaOf {
    Box box;

    explicit AreaOf(const Box &rectangle) : box(rectangle) {}

    /// True if another box has a point in common with the rectangle.
    bool touches(const Box &other) const
    {
        const float x_m = lane::max(other.x_min_m - box.x_max_m, box.x_min_m - other.x_max_m);
        const float y_m = lane::max(other.y_min_m - box.y_max_m, box.y_min_m - other.y_max_m);
        return lane::max(x_m, y_m) <= 0.0f;
    }
};

/// The same with four lanes: one comparison for all four sides. Coordinates of the far sides have
/// their signs changed, so that all sides are compared in the same direction.
template <> struct AreaOf<4> {
    using Sides = lane::Lane<4>::F;
    Sides limits;

    explicit AreaOf(const Box &rectangle)
        : limits{rectangle.x_max_m, rectangle.y_max_m, -rectangle.x_min_m, -rectangle.y_min_m}
    {
    }

    bool touches(const Box &other) const
    {
        constexpr Sides kFarSides = {0.0f, 0.0f, -0.0f, -0.0f};
        constexpr uint32_t kAll = 0xf;
        static_assert(sizeof(Sides) == sizeof(Box), "a box is four sides");
        Sides sides;
        memcpy(&sides, &other, sizeof sides);
        return lane::bits_where_le(lane::flip_sign(sides, kFarSides), limits) == kAll;
    }
};

using Area = AreaOf<(GPOM_LANES > 1 ? 4 : 1)>;

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
    uint32_t *slots;   ///< n_items slots of the store, leaf by leaf.
    uint32_t n_items;
    uint32_t id_end; ///< The tree knows beams with smaller ids. It ignores others in its slots.
};

/// The whole tree.
inline Subtree root_of(const KdTree &tree) { return {0, 0, leaf_count(tree.n_items)}; }

/// The slots of a subtree: a stretch of KdTree::slots.
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

/// Extents of the four coordinates of segments' ends.
struct Extents {
    Extent axis[4];
    float slack_m = 0.0f; ///< Greatest rounding error of an end (kBoxSlack).
};

/// State of building a tree in slices: a stack of the subtrees that are left to do. The topmost is
/// worked on: first the extents of its items are computed, then, if it is not a leaf, the median is
/// selected.
struct TreeBuild {
    Subtree stack[kDepthMax];
    uint32_t depth;
    uint32_t i_item; ///< Items of the topmost subtree whose extents are known.
    int i_axis;      ///< Coordinate at which the topmost subtree is split.
    Extents extents;
    Selection selection;
};

inline bool is_done(const TreeBuild &build) { return build.depth == 0; }

/// Start to build a tree over the beams in tree.slots.
void start_build(TreeBuild &build, const KdTree &tree);

/// Continue for at most `budget` operations: items looked at, and comparisons. Returns the number
/// of operations used.
/// Cost: all calls for one tree take (3 n + n) log2(n / 8) operations on average, and at most
/// (kSplitsMax + 1) n log2(n / 8).
uint32_t build_some(TreeBuild &build, KdTree &tree, const HitPart &part, uint32_t budget);
uint32_t build_some(TreeBuild &build, KdTree &tree, const FreePart &part, uint32_t budget);

} // namespace gpom
