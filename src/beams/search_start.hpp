/// \file search_start.hpp
/// A search start: the subtrees of a tree that may hold neighbours of queries near each other. The
/// searches of these queries start at the subtrees and not at the root of the tree.
#pragma once

#include "src/beams/nearest.hpp"

namespace gpom
{

/// Greatest number of parts of a search start. If more parts were needed, some subtrees are not
/// divided further.
constexpr uint32_t kStartPartsMax = 64;

/// A search start covers a margin around the area that its first packet needs. The width of the
/// margin is this times the reach of the packet.
constexpr float kStartMargin = 0.5f;

/// In each lane, the places at most reach_m away from the query `at`.
template <class F> struct Vicinity {
    Offset<F> at;
    F reach_m;
};

/// Subtrees that hold every item of a tree within an area. The subtrees near the middle of the area
/// come first, approximately.
struct SearchStart {
    Subtree *parts; ///< kStartPartsMax entries.
    uint32_t n;
    float reach_m; ///< Greatest reach of the packet that it was found for.
    Box area;
};

/// The greatest element of all lanes.
template <class F> inline float greatest(F lanes)
{
    Extent extent;
    for (int i = 0; i < lane::width<F>; ++i) {
        extent.include(lane::get(lanes, i));
    }
    return extent.high;
}

/// True if the search start holds all items in a vicinity, and not too many others. Rounding errors
/// here are smaller than the margins that reach2_after() and kBoxSlack add.
template <class F> inline bool suits(const SearchStart &start, const Vicinity<F> &v)
{
    const Box &area = start.area;
    const bool is_beyond =
        lane::any((v.at.x_m - v.reach_m < area.x_min_m) | (v.at.x_m + v.reach_m > area.x_max_m) |
                  (v.at.y_m - v.reach_m < area.y_min_m) | (v.at.y_m + v.reach_m > area.y_max_m));
    return !is_beyond && lane::any(2.0f * v.reach_m > start.reach_m);
}

/// True if finding a search start saves time, because the next packets can use it too. The next
/// packets are expected to move as far as this one did.
template <class F> inline bool is_worth_finding(const Vicinity<F> &v, F move_m)
{
    return 2.0f * greatest(move_m) < kStartMargin * greatest(v.reach_m);
}

/// The walks of a search of the parts of a search start, the first part first. The stack has room
/// for the parts and for one walk.
inline Walks from_start(const SearchStart &start, Subtree *stack, uint32_t n_max)
{
    for (uint32_t i = 0; i < start.n; ++i) {
        stack[i] = start.parts[start.n - 1 - i];
    }
    return {stack, start.n, n_max};
}

/// Find the leaves that hold all items in a vicinity and in a margin around it. If there are too
/// many leaves, some parts are larger subtrees.
///
/// stack   kDepthMax entries.
///
/// Cost: at most 2 kStartPartsMax boxes of each level.
template <class F, class Part>
inline void find_start(SearchStart &start, const KdTree &tree, const Part &part,
                       const Vicinity<F> &v, Subtree *stack)
{
    start.reach_m = greatest(v.reach_m);
    const float margin_m = kStartMargin * start.reach_m;
    const Box area = {-greatest(F(v.reach_m - v.at.x_m)) - margin_m,
                      -greatest(F(v.reach_m - v.at.y_m)) - margin_m,
                      greatest(F(v.reach_m + v.at.x_m)) + margin_m,
                      greatest(F(v.reach_m + v.at.y_m)) + margin_m};
    const Point middle = {0.5f * (area.x_min_m + area.x_max_m),
                          0.5f * (area.y_min_m + area.y_max_m)};
    const Area around(area);
    start.area = area;
    start.n = 0;
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = root_of(tree);
    }
    while (depth > 0) {
        const Subtree t = stack[--depth];
        if (!around.touches(tree.boxes[t.node])) {
            continue;
        }
        if (t.n_leaves == 1 || start.n + depth + 2 > kStartPartsMax) {
            start.parts[start.n++] = t;
            continue;
        }
        const Subtree left = left_of(t);
        const Subtree right = right_of(t);
        const bool is_left_nearer = priority(part, tree.boxes[left.node], middle) <=
                                    priority(part, tree.boxes[right.node], middle);
        stack[depth++] = is_left_nearer ? right : left;
        stack[depth++] = is_left_nearer ? left : right;
    }
}

} // namespace gpom
