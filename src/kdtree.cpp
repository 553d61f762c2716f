#include "src/kdtree.hpp"

#include "src/assert.hpp"
#include "src/lane.hpp"
#include "src/select.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// A segment's far end and closest point are computed with rounding errors of about 2^-23 of its
/// length and coordinates; the box is widened by more than that, so that no box is ever farther
/// than an item inside it.
constexpr float kBoxSlack = 1e-6f;

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

/// The i_axis-th of the four coordinates of a segment's ends.
float coordinate(const Segment &s, int i_axis)
{
    switch (i_axis) {
    case 0:
        return s.x_m;
    case 1:
        return s.y_m;
    case 2:
        return s.x_m + s.length_m * s.dir_x;
    default:
        return s.y_m + s.length_m * s.dir_y;
    }
}

/// Extents of the four end-point coordinates, and how far rounding may reach.
struct Extents {
    Extent axis[4];
    float slack_m = 0.0f;
};

template <class Part> Extents extents_of(const KdTree &tree, const Stretch &slots, const Part &part)
{
    Extents extents;
    for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
        const Segment s = part(tree.beams[tree.slots[i]]);
        for (int i_axis = 0; i_axis < 4; ++i_axis) {
            extents.axis[i_axis].include(coordinate(s, i_axis));
        }
        const float reach_m = s.length_m + lane::abs(s.x_m) + lane::abs(s.y_m);
        extents.slack_m = lane::max(extents.slack_m, kBoxSlack * reach_m);
    }
    return extents;
}

Box box_of(const Extents &e)
{
    return {lane::min(e.axis[0].low, e.axis[2].low) - e.slack_m,
            lane::min(e.axis[1].low, e.axis[3].low) - e.slack_m,
            lane::max(e.axis[0].high, e.axis[2].high) + e.slack_m,
            lane::max(e.axis[1].high, e.axis[3].high) + e.slack_m};
}

int widest_axis(const Extents &extents)
{
    int widest = 0;
    for (int i_axis = 1; i_axis < 4; ++i_axis) {
        const Extent &best = extents.axis[widest];
        const Extent &here = extents.axis[i_axis];
        if (here.high - here.low > best.high - best.low) {
            widest = i_axis;
        }
    }
    return widest;
}

template <class Part> void build(KdTree &tree, const Part &part, Subtree *stack)
{
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = {0, 0, leaf_count(tree.n_items)};
    }
    while (depth > 0) {
        const Subtree t = stack[--depth];
        const Stretch slots = slots_of(tree, t);
        const Extents extents = extents_of(tree, slots, part);
        tree.boxes[t.node] = box_of(extents);
        if (t.n_leaves == 1) {
            continue;
        }
        const int i_axis = widest_axis(extents);
        const auto key = [&tree, &part, i_axis](uint32_t slot) {
            const Beam &beam = tree.beams[slot];
            return SortKey{coordinate(part(beam), i_axis), beam.id};
        };
        select_nth(tree.slots + slots.first, slots.n, left_of(t).n_leaves * kLeafSize, key);
        GPOM_ASSERT(depth + 2 <= kDepthMax);
        stack[depth++] = right_of(t);
        stack[depth++] = left_of(t);
    }
}

} // namespace

void build_hit_tree(KdTree &tree, const HitPart &part, Subtree *stack) { build(tree, part, stack); }

void build_free_tree(KdTree &tree, const FreePart &part, Subtree *stack)
{
    build(tree, part, stack);
}

} // namespace gpom
