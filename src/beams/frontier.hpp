/// \file frontier.hpp
/// Where queries near each other start their searches: not at the root of a tree, but at the parts
/// of it that any of them may have to look into.
#pragma once

#include "src/beams/nearest.hpp"

namespace gpom
{

/// Entries of a frontier; where more would be needed, subtrees stay whole.
constexpr uint32_t kFrontierMax = 64;

/// How far beyond what its first packet needs a frontier goes, in parts of the packet's reach.
constexpr float kFrontierMargin = 0.5f;

/// The places within reach_m of queries.
template <class F> struct Vicinity {
    Offset<F> at;
    F reach_m;
};

/// Subtrees that hold every item of a tree within an area, about the nearest to its middle first.
struct Frontier {
    Subtree *parts; ///< kFrontierMax entries.
    uint32_t n;
    float reach_m; ///< Of the packet that it was found for.
    Box area;
};

/// The greatest element.
template <class F> inline float greatest(F lanes)
{
    Extent extent;
    for (int i = 0; i < lane::width<F>; ++i) {
        extent.include(lane::get(lanes, i));
    }
    return extent.high;
}

/// True if all items in a vicinity are in the frontier, and not too many others. What rounding may
/// take is less than what reach2_after() and kBoxSlack add.
template <class F> inline bool suits(const Frontier &frontier, const Vicinity<F> &v)
{
    const Box &area = frontier.area;
    const bool is_beyond =
        lane::any((v.at.x_m - v.reach_m < area.x_min_m) | (v.at.x_m + v.reach_m > area.x_max_m) |
                  (v.at.y_m - v.reach_m < area.y_min_m) | (v.at.y_m + v.reach_m > area.y_max_m));
    return !is_beyond && lane::any(2.0f * v.reach_m > frontier.reach_m);
}

/// True if finding a frontier pays: packets that go on moving like this one will use it.
template <class F> inline bool is_worth_finding(const Vicinity<F> &v, F move_m)
{
    return 2.0f * greatest(move_m) < kFrontierMargin * greatest(v.reach_m);
}

/// To search a frontier's parts, the first one first. The stack has room for them, and for a walk.
inline Walks from_frontier(const Frontier &frontier, Subtree *stack, uint32_t n_max)
{
    for (uint32_t i = 0; i < frontier.n; ++i) {
        stack[i] = frontier.parts[frontier.n - 1 - i];
    }
    return {stack, frontier.n, n_max};
}

/// Find the leaves, or if they are too many the subtrees, that hold all items in a vicinity and a
/// margin around it. Looks at no more than 2 kFrontierMax boxes of each level.
///
/// stack   kDepthMax entries.
template <class F, class Part>
inline void find_frontier(Frontier &frontier, const KdTree &tree, const Part &part,
                          const Vicinity<F> &v, Subtree *stack)
{
    frontier.reach_m = greatest(v.reach_m);
    const float margin_m = kFrontierMargin * frontier.reach_m;
    const Box area = {-greatest(F(v.reach_m - v.at.x_m)) - margin_m,
                      -greatest(F(v.reach_m - v.at.y_m)) - margin_m,
                      greatest(F(v.reach_m + v.at.x_m)) + margin_m,
                      greatest(F(v.reach_m + v.at.y_m)) + margin_m};
    const Point middle = {0.5f * (area.x_min_m + area.x_max_m),
                          0.5f * (area.y_min_m + area.y_max_m)};
    frontier.area = area;
    frontier.n = 0;
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = root_of(tree);
    }
    while (depth > 0) {
        const Subtree t = stack[--depth];
        if (!are_near(tree.boxes[t.node], area, 0.0f)) {
            continue;
        }
        if (t.n_leaves == 1 || frontier.n + depth + 2 > kFrontierMax) {
            frontier.parts[frontier.n++] = t;
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
