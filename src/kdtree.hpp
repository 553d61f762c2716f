/// \file kdtree.hpp
/// Static KD-trees over hits and over free segments, in fixed arrays.
///
/// The tree is balanced over leaves of kLeafSize items and laid out in preorder without pointers: a
/// node over m leaves has its left child, over m / 2 leaves, right behind it and its right child
/// 2 (m / 2) places on. A node is only the bounding box of its items. Leaves hold what a query
/// needs, field by field, so that a search never touches the beam store.
///
/// Splits halve the items at the median of their widest coordinate: x or y of a hit, one of the
/// four end-point coordinates of a segment (Bentley 1975; segments as points in four dimensions).
#pragma once

#include "src/beam.hpp"

#include <stddef.h>

namespace gpom
{

constexpr uint32_t kLeafSize = 8;
/// Levels of the largest tree: 2^22 leaves hold GPOM_BEAM_MAX beams. Bounds the walk's stack.
constexpr uint32_t kDepthMax = 24;

constexpr uint32_t leaf_count(uint32_t n_items) { return (n_items + kLeafSize - 1) / kLeafSize; }
constexpr uint32_t node_count(uint32_t n_items) { return 2 * leaf_count(n_items); }

struct Box {
    float x_min_m, y_min_m, x_max_m, y_max_m;
};

/// Up to kLeafSize hits; unused places are far away with id kNoId.
struct HitLeaf {
    float x_m[kLeafSize], y_m[kLeafSize];
    float excess[kLeafSize];
    int32_t id[kLeafSize];
};

/// Up to kLeafSize free segments; unused places as above.
struct SegmentLeaf {
    float x_m[kLeafSize], y_m[kLeafSize];
    float dir_x[kLeafSize], dir_y[kLeafSize];
    float length_m[kLeafSize];
    float excess[kLeafSize];
    int32_t id[kLeafSize];
};

/// Id of no item: greater than any beam's, so that it loses every tie.
constexpr int32_t kNoId = INT32_MAX;

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

/// A tree in the map's arena: node_count() boxes and leaf_count() leaves.
template <class Leaf> struct KdTree {
    Box *boxes;
    Leaf *leaves;
    uint32_t n_items;
};
using HitTree = KdTree<HitLeaf>;
using SegmentTree = KdTree<SegmentLeaf>;

/// What a build works with besides the tree.
struct BuildInput {
    const Beam *beams;
    float gap_m;
    uint32_t *order; ///< Indices of the beams to take, n_order of them; permuted.
    uint32_t n_order;
    Subtree *stack; ///< kDepthMax entries.
};

/// Build in O(n log n) expected, O(n log^2 n) worst case comparisons. The result depends on the set
/// of beams alone, not on their order.
void build_hit_tree(HitTree &tree, const BuildInput &input);
void build_segment_tree(SegmentTree &tree, const BuildInput &input);

} // namespace gpom
