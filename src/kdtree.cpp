#include "src/kdtree.hpp"

#include "src/assert.hpp"
#include "src/lane.hpp"
#include "src/select.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// Where padding of a leaf stands: farther than any beam, near enough for its square to be finite.
constexpr float kFarAway_m = 1e15f;

/// A segment's far end and closest point are computed with rounding errors of about 2^-23 of its
/// length and coordinates; the box is widened by more than that, so that no box is ever farther than
/// an item inside it.
constexpr float kBoxSlack = 1e-6f;

/// A hit as the tree's item: two coordinates.
struct HitItem {
    using Leaf = HitLeaf;
    static constexpr int kCoordinates = 2;

    static float coordinate(const Beam &beam, float, int axis)
    {
        const Point hit = hit_of(beam);
        return axis == 0 ? hit.x_m : hit.y_m;
    }

    static Box box(const Beam &beam, float)
    {
        const Point hit = hit_of(beam);
        return {hit.x_m, hit.y_m, hit.x_m, hit.y_m};
    }

    static void store(HitLeaf &leaf, uint32_t place, const Beam &beam, float)
    {
        const Point hit = hit_of(beam);
        leaf.x_m[place] = hit.x_m;
        leaf.y_m[place] = hit.y_m;
        leaf.excess[place] = beam.excess;
        leaf.id[place] = static_cast<int32_t>(beam.id);
    }

    static void pad(HitLeaf &leaf, uint32_t place)
    {
        leaf.x_m[place] = kFarAway_m;
        leaf.y_m[place] = kFarAway_m;
        leaf.excess[place] = 0.0f;
        leaf.id[place] = kNoId;
    }
};

/// A free segment as the tree's item: the coordinates of its two ends.
struct SegmentItem {
    using Leaf = SegmentLeaf;
    static constexpr int kCoordinates = 4;

    static Point end(const Segment &s)
    {
        return {s.x_m + s.length_m * s.dir_x, s.y_m + s.length_m * s.dir_y};
    }

    static float coordinate(const Beam &beam, float gap_m, int axis)
    {
        const Segment s = free_segment_of(beam, gap_m);
        switch (axis) {
        case 0:
            return s.x_m;
        case 1:
            return s.y_m;
        case 2:
            return end(s).x_m;
        default:
            return end(s).y_m;
        }
    }

    static Box box(const Beam &beam, float gap_m)
    {
        const Segment s = free_segment_of(beam, gap_m);
        const Point far = end(s);
        const float slack_m =
            kBoxSlack * (s.length_m + lane::abs(s.x_m) + lane::abs(s.y_m));
        return {lane::min(s.x_m, far.x_m) - slack_m, lane::min(s.y_m, far.y_m) - slack_m,
                lane::max(s.x_m, far.x_m) + slack_m, lane::max(s.y_m, far.y_m) + slack_m};
    }

    static void store(SegmentLeaf &leaf, uint32_t place, const Beam &beam, float gap_m)
    {
        const Segment s = free_segment_of(beam, gap_m);
        leaf.x_m[place] = s.x_m;
        leaf.y_m[place] = s.y_m;
        leaf.dir_x[place] = s.dir_x;
        leaf.dir_y[place] = s.dir_y;
        leaf.length_m[place] = s.length_m;
        leaf.excess[place] = beam.excess;
        leaf.id[place] = static_cast<int32_t>(beam.id);
    }

    static void pad(SegmentLeaf &leaf, uint32_t place)
    {
        leaf.x_m[place] = kFarAway_m;
        leaf.y_m[place] = kFarAway_m;
        leaf.dir_x[place] = 0.0f;
        leaf.dir_y[place] = 0.0f;
        leaf.length_m[place] = 0.0f;
        leaf.excess[place] = 0.0f;
        leaf.id[place] = kNoId;
    }
};

/// Items of a subtree: a stretch of the order.
struct Stretch {
    uint32_t first, n;
};

Stretch items_of(const Subtree &t, uint32_t n_items)
{
    const uint32_t first = t.first_leaf * kLeafSize;
    const uint32_t n_max = t.n_leaves * kLeafSize;
    const uint32_t n_left = n_items - first;
    return {first, n_left < n_max ? n_left : n_max};
}

template <class Item> Box bounding_box(const BuildInput &input, const Stretch &items)
{
    Box box = {FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (uint32_t i = items.first; i < items.first + items.n; ++i) {
        const Box one = Item::box(input.beams[input.order[i]], input.gap_m);
        box.x_min_m = lane::min(box.x_min_m, one.x_min_m);
        box.y_min_m = lane::min(box.y_min_m, one.y_min_m);
        box.x_max_m = lane::max(box.x_max_m, one.x_max_m);
        box.y_max_m = lane::max(box.y_max_m, one.y_max_m);
    }
    return box;
}

template <class Item> int widest_axis(const BuildInput &input, const Stretch &items)
{
    int widest = 0;
    float widest_m = -1.0f;
    for (int axis = 0; axis < Item::kCoordinates; ++axis) {
        float low = FLT_MAX;
        float high = -FLT_MAX;
        for (uint32_t i = items.first; i < items.first + items.n; ++i) {
            const float c = Item::coordinate(input.beams[input.order[i]], input.gap_m, axis);
            low = lane::min(low, c);
            high = lane::max(high, c);
        }
        if (high - low > widest_m) {
            widest_m = high - low;
            widest = axis;
        }
    }
    return widest;
}

/// Put the items of the left half before those of the right half.
template <class Item> void split(const BuildInput &input, const Subtree &t)
{
    const Stretch items = items_of(t, input.n_order);
    const int axis = widest_axis<Item>(input, items);
    const auto key = [&input, axis](uint32_t i_beam) {
        const Beam &beam = input.beams[i_beam];
        return SortKey{Item::coordinate(beam, input.gap_m, axis), beam.id};
    };
    select_nth(input.order + items.first, items.n, left_of(t).n_leaves * kLeafSize, key);
}

/// The items of one leaf, in order of their ids so that equal sets give equal bytes.
template <class Item>
void fill_leaf(typename Item::Leaf &leaf, const BuildInput &input, const Stretch &items)
{
    uint32_t *const order = input.order + items.first;
    heap_sort(order, items.n, [&input](uint32_t i_beam) {
        return SortKey{0.0f, input.beams[i_beam].id};
    });
    for (uint32_t place = 0; place < kLeafSize; ++place) {
        if (place < items.n) {
            Item::store(leaf, place, input.beams[order[place]], input.gap_m);
        } else {
            Item::pad(leaf, place);
        }
    }
}

template <class Item> void build(KdTree<typename Item::Leaf> &tree, const BuildInput &input)
{
    tree.n_items = input.n_order;
    uint32_t depth = 0;
    if (input.n_order > 0) {
        input.stack[depth++] = {0, 0, leaf_count(input.n_order)};
    }
    while (depth > 0) {
        const Subtree t = input.stack[--depth];
        const Stretch items = items_of(t, input.n_order);
        tree.boxes[t.node] = bounding_box<Item>(input, items);
        if (t.n_leaves == 1) {
            fill_leaf<Item>(tree.leaves[t.first_leaf], input, items);
            continue;
        }
        split<Item>(input, t);
        GPOM_ASSERT(depth + 2 <= kDepthMax);
        input.stack[depth++] = right_of(t);
        input.stack[depth++] = left_of(t);
    }
}

} // namespace

void build_hit_tree(HitTree &tree, const BuildInput &input) { build<HitItem>(tree, input); }

void build_segment_tree(SegmentTree &tree, const BuildInput &input)
{
    build<SegmentItem>(tree, input);
}

} // namespace gpom
