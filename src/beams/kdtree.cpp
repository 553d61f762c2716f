#include "src/beams/kdtree.hpp"

#include "src/base/assert.hpp"

namespace gpom
{

namespace
{

/// One of the four coordinates of a segment's ends.
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

/// Enlarge the extents by one segment.
void include(Extents &extents, const Segment &s)
{
    for (int i_axis = 0; i_axis < 4; ++i_axis) {
        extents.axis[i_axis].include(coordinate(s, i_axis));
    }
    const float reach_m = lane::abs(s.length_m) + lane::abs(s.x_m) + lane::abs(s.y_m);
    extents.slack_m = lane::max(extents.slack_m, kBoxSlack * reach_m);
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

/// The topmost subtree is done. Continue with the next one on the stack.
void pop(TreeBuild &build)
{
    --build.depth;
    build.i_item = 0;
    build.extents = {};
}

void push_children(TreeBuild &build)
{
    const Subtree t = build.stack[build.depth - 1];
    pop(build);
    GPOM_ASSERT(build.depth + 2 <= kDepthMax);
    build.stack[build.depth++] = right_of(t);
    build.stack[build.depth++] = left_of(t);
}

/// The extents of all items of the topmost subtree are known: store its box. A leaf is then done.
/// Another subtree starts to split.
void finish_extents(TreeBuild &build, KdTree &tree, const Stretch &slots)
{
    const Subtree t = build.stack[build.depth - 1];
    tree.boxes[t.node] = box_of(build.extents);
    if (t.n_leaves == 1) {
        pop(build);
        return;
    }
    build.i_axis = widest_axis(build.extents);
    build.selection = selection_of(slots.first, slots.n, left_of(t).n_leaves * kLeafSize);
}

/// One of the two parts of a beam. The choice is made while the program runs, so that the code that
/// builds a tree exists once.
struct EitherPart {
    bool is_hit;
    float length_m; ///< depth_m of hits, gap_m of free segments.

    Segment operator()(const Beam &beam) const
    {
        return is_hit ? HitPart{length_m}(beam) : FreePart{length_m}(beam);
    }
};

uint32_t build_slice(TreeBuild &build, KdTree &tree, const EitherPart &part, uint32_t budget)
{
    uint32_t used = 0;
    while (!is_done(build) && used < budget) {
        const Stretch slots = slots_of(tree, build.stack[build.depth - 1]);
        if (build.i_item < slots.n) {
            for (; build.i_item < slots.n && used < budget; ++build.i_item, ++used) {
                include(build.extents, part(tree.beams[tree.slots[slots.first + build.i_item]]));
            }
            if (build.i_item == slots.n) {
                finish_extents(build, tree, slots);
            }
            continue;
        }
        const auto key = [&](uint32_t slot) {
            return SortKey{coordinate(part(tree.beams[slot]), build.i_axis), tree.beams[slot].id};
        };
        used += select_some(build.selection, tree.slots, key, budget - used);
        if (is_done(build.selection)) {
            push_children(build);
        }
    }
    return used;
}

} // namespace

void start_build(TreeBuild &build, const KdTree &tree)
{
    build = {};
    if (tree.n_items > 0) {
        build.stack[build.depth++] = root_of(tree);
    }
}

uint32_t build_some(TreeBuild &build, KdTree &tree, const HitPart &part, uint32_t budget)
{
    return build_slice(build, tree, {true, part.depth_m}, budget);
}

uint32_t build_some(TreeBuild &build, KdTree &tree, const FreePart &part, uint32_t budget)
{
    return build_slice(build, tree, {false, part.gap_m}, budget);
}

} // namespace gpom
