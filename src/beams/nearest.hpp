/// \file nearest.hpp
/// The k nearest hits and the k nearest points on free segments (eq. 10), for W queries at once.
///
/// The result is exact and ordered by (squared distance, id). It does not depend on the order in
/// which items are offered. So the result is the same for a tree, for a list, and for a query in
/// any packet.
#pragma once

#include "src/beams/kdtree.hpp"
#include "src/beams/visits.hpp"
#include "src/lane/lane.hpp"

namespace gpom
{

/// Squared distance and id of an empty rank. Any beam ranks before it.
constexpr float kNoDistance2 = 1e29f;
constexpr int32_t kNoId = INT32_MAX;

static_assert(kLeafSize <= 32, "offer_leaf() has a bit for each beam of a leaf");

/// Vectors from the queries to a point.
template <class F> struct Offset {
    F x_m, y_m;

    F distance2() const { return lane::fma(x_m, x_m, F(y_m * y_m)); }
};

/// A squared distance as an integer. Distances are not negative, so that the order of the integers
/// is that of the distances, and a comparison takes one instruction less. A NaN is the greatest.
inline uint32_t order_of(float d2_m2)
{
    uint32_t bits;
    memcpy(&bits, &d2_m2, sizeof bits);
    return bits;
}

/// The item that each lane found at one rank.
template <class F> struct Found {
    using Ints = lane::IntOf<F>;
    F d2;
    Ints id;
    Ints slot; ///< The slot of its beam in the store, or -1 if nothing was found.

    /// True in lanes where this item ranks before the other.
    auto operator<(const Found &other) const
    {
        return (d2 < other.d2) | ((d2 == other.d2) & (id < other.id));
    }
};

template <class F> inline Found<F> nothing_found()
{
    using Ints = lane::IntOf<F>;
    return {lane::splat<F>(kNoDistance2), lane::splat_int<Ints>(kNoId), lane::splat_int<Ints>(-1)};
}

template <class M, class F> inline Found<F> select(M mask, const Found<F> &a, const Found<F> &b)
{
    return {lane::select(mask, a.d2, b.d2), lane::select(mask, a.id, b.id),
            lane::select(mask, a.slot, b.slot)};
}

/// The k nearest items so far of each lane, the nearest first, in scratch memory.
template <class F> struct NearestK {
    Found<F> *best;
    uint32_t k;
    uint32_t n; ///< Ranks that any lane may have filled.

    void clear() { clear(lane::splat<F>(kNoDistance2)); }

    /// Start anew with a bound: items farther than d2_max are not taken. The caller expects the k
    /// nearest within the bound; has_all() checks this.
    void clear(F d2_max)
    {
        n = 0;
        Found<F> empty = nothing_found<F>();
        empty.d2 = d2_max;
        for (uint32_t j = 0; j < k; ++j) {
            best[j] = empty;
        }
    }

    /// Insert an item at its rank. Items behind it move on by one rank; the last one is lost.
    void offer(const Found<F> &item)
    {
        if constexpr (lane::width<F> == 1) {
            offer_one(item.d2, item.id, item.slot);
        } else {
            Found<F> *const place = best + (n < k ? n++ : k - 1);
            if (has_equal(item.d2, place)) {
                insert_by_id(item, place);
            } else {
                insert(item, place);
            }
        }
    }

    /// offer() for one lane. Not inlined: a search would have to save registers around it.
    [[gnu::noinline]] void offer_one(float d2, int32_t id, int32_t slot)
    {
        const uint32_t order = order_of(d2);
        const auto is_before = [order, id](const Found<F> &other) {
            const uint32_t other_order = order_of(other.d2);
            return order < other_order || (order == other_order && id < other.id);
        };
        Found<F> *const first = best;
        Found<F> *place = first + (n < k ? n++ : k - 1);
        if (!is_before(*place)) {
            return;
        }
        for (; place != first && is_before(place[-1]); --place) {
            place[0] = place[-1];
        }
        *place = {d2, id, slot};
    }

    /// True if a lane has an item at the same distance among the ranks up to `last`.
    bool has_equal(F d2, const Found<F> *last) const
    {
        uint32_t equal = 0;
        for (const Found<F> *place = best; place <= last; ++place) {
            equal |= lane::bits_where_equal(d2, place->d2);
        }
        return equal != 0;
    }

    /// Insert an item into the ranks up to `place`. No item there may have the same distance. The
    /// loop passes all ranks: with many lanes, the item usually ranks early in one of them.
    void insert(const Found<F> &item, Found<F> *place)
    {
        for (; place != best; --place) {
            const Found<F> &next = place[-1];
            const auto beats = item.d2 < place->d2;
            const auto beats_next = item.d2 < next.d2;
            place->id = lane::select(beats_next, next.id, lane::select(beats, item.id, place->id));
            place->slot =
                lane::select(beats_next, next.slot, lane::select(beats, item.slot, place->slot));
            place->d2 = lane::smaller(place->d2, lane::larger(item.d2, next.d2));
        }
        *place = select(item.d2 < place->d2, item, *place);
    }

    /// The same as insert(), if items may have the same distance. Their ids then decide.
    [[gnu::noinline]] void insert_by_id(const Found<F> &item, Found<F> *place)
    {
        auto beats = item < *place;
        for (; place != best; --place) {
            const auto beats_next = item < place[-1];
            place[0] = select(beats_next, place[-1], select(beats, item, place[0]));
            beats = beats_next;
        }
        *place = select(beats, item, *place);
    }

    F worst() const { return best[k - 1].d2; }

    /// False if a lane has a bound and found fewer than k items within it.
    bool has_all() const
    {
        const Found<F> &last = best[k - 1];
        return !lane::any((last.slot < 0) & (last.d2 < kNoDistance2));
    }
};

/// The squared distance within which the k nearest are after the queries moved. Before, they were
/// within `worst`. The distance from a query to an item grows by no more than the query moved. A
/// little is added for rounding. If this margin is too small, NearestK::has_all() is false.
template <class F> inline F reach2_after(F worst, const Offset<F> &move)
{
    const F reach_m = lane::sqrt(worst) + lane::sqrt(move.distance2());
    const F none = lane::splat<F>(kNoDistance2);
    return lane::select(worst < none, F(1.0001f * (reach_m * reach_m)), none);
}

/// One segment in each lane: the same in all lanes, or a different one in each lane.
template <class F> struct SegmentLanes {
    F x_m, y_m, dir_x, dir_y, length_m;
};

/// Vector from each query `at` to the closest point of a segment (eq. 10). The closest point is the
/// foot of the perpendicular. If the foot is outside the segment, it is an end of the segment.
template <class F> inline Offset<F> to_segment(const Offset<F> &at, const SegmentLanes<F> &s)
{
    const F x_m = at.x_m - s.x_m;
    const F y_m = at.y_m - s.y_m;
    const F along_m = lane::fma(x_m, s.dir_x, F(y_m * s.dir_y));
    const F foot_m = lane::clamp(along_m, lane::splat<F>(0.0f), s.length_m);
    return {lane::fma(foot_m, s.dir_x, F(-x_m)), lane::fma(foot_m, s.dir_y, F(-y_m))};
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

/// The same for a hit. A hit of depth 0 takes fewer operations, with the same result.
template <class F> inline F distance2(const Offset<F> &at, const HitPart &part, const Beam &beam)
{
    const Segment hit = part(beam);
    if (hit.length_m > 0.0f) {
        return to_segment(at, splat<F>(hit)).distance2();
    }
    return Offset<F>{hit.x_m - at.x_m, hit.y_m - at.y_m}.distance2();
}

/// Squared distances from the queries to a box. Always inlined early, as priority() is: otherwise
/// GCC keeps copies of boxes in memory (search_tree_of_one()).
template <class F> [[gnu::always_inline]] inline F box_distance2(const Box &box, F x_m, F y_m)
{
    const F near_x = lane::clamp(x_m, lane::splat<F>(box.x_min_m), lane::splat<F>(box.x_max_m));
    const F near_y = lane::clamp(y_m, lane::splat<F>(box.y_min_m), lane::splat<F>(box.y_max_m));
    const F dx = near_x - x_m;
    const F dy = near_y - y_m;
    return lane::fma(dx, dx, F(dy * dy));
}

/// Squared distance up to which boxes must be searched for items at most d2 away. It is a little
/// more than d2, because the computed distance of an item may be rounded down.
template <class F> inline F box_reach2(F d2) { return 1.000001f * d2; }

/// Ids from `first` up to `end`, without `end`.
struct IdRange {
    uint32_t first, end;

    bool has(uint32_t id) const { return id - first < end - first; }
};

/// A slot of the store in a tree or a list.
struct Listed {
    const Beam *beams;
    uint32_t slot;
    IdRange ids; ///< Ids of the beams that the tree or list knows.
};

/// Offer one part of a beam at the squared distances d2, if queries see the part and the id of the
/// beam is in range. The slot may hold another beam since it was listed.
template <class Part, class F>
inline void offer_at(NearestK<F> &nearest, F d2, const Listed &listed)
{
    using Ints = lane::IntOf<F>;
    const Beam &beam = listed.beams[listed.slot];
    if (Part::is_seen(beam) && listed.ids.has(beam.id)) {
        nearest.offer({d2, lane::splat_int<Ints>(static_cast<int32_t>(beam.id)),
                       lane::splat_int<Ints>(static_cast<int32_t>(listed.slot))});
    }
}

/// The same as offer_at(), but not inlined: inlined in a search for many lanes, it would take all
/// registers.
template <class Part, class F>
[[gnu::noinline]] void offer_apart(NearestK<F> &nearest, F d2, const Listed &listed)
{
    offer_at<Part>(nearest, d2, listed);
}

/// Offer one part of a beam if it is near enough in any lane.
template <class F, class Part>
inline void offer_beam(NearestK<F> &nearest, const Offset<F> &at, const Part &part,
                       const Listed &listed)
{
    const F d2 = distance2(at, part, listed.beams[listed.slot]);
    if (lane::bits_where_le(d2, nearest.worst()) != 0) {
        offer_at<Part>(nearest, d2, listed);
    }
}

/// The order in which boxes are searched for one query: the smaller number comes first. For hits
/// the number is the squared distance of the box. Boxes of free segments often overlap and contain
/// the query, so that their number is 4 times the squared distance of the box's centre.
[[gnu::always_inline]] inline float priority(const HitPart &, const Box &box, const Point &at)
{
    return box_distance2(box, at.x_m, at.y_m);
}

[[gnu::always_inline]] inline float priority(const FreePart &, const Box &box, const Point &at)
{
    const float twice_x = (box.x_min_m + box.x_max_m) - 2.0f * at.x_m;
    const float twice_y = (box.y_min_m + box.y_max_m) - 2.0f * at.y_m;
    return lane::fma(twice_x, twice_x, twice_y * twice_y);
}

/// A subtree that may be searched.
template <class F> struct Prospect {
    Subtree subtree;
    F d2;           ///< Squared distances from the queries to its box.
    float priority; ///< priority() for the first query of the packet.
};

template <class F, class Part>
inline Prospect<F> prospect(const KdTree &tree, const Offset<F> &at, const Part &part,
                            const Subtree &t)
{
    const Box &box = tree.boxes[t.node];
    const Point first = {lane::get(at.x_m, 0), lane::get(at.y_m, 0)};
    return {t, box_distance2(box, at.x_m, at.y_m), priority(part, box, first)};
}

/// Offer the beams of a leaf.
///
/// With many lanes, a processor cannot predict whether a beam is near enough in any lane, so that a
/// branch for each beam would be slow. The function computes the distances of all beams first. Then
/// it offers the beams that are near enough, bit by bit.
template <class F, class Part>
inline void offer_leaf(NearestK<F> &nearest, const Offset<F> &at, const Part &part,
                       const KdTree &tree, const Subtree &leaf)
{
    const Stretch slots = slots_of(tree, leaf);
    if constexpr (lane::width<F> == 1) {
        const F *const last = &nearest.best[nearest.k - 1].d2;
        const Beam *const beams = tree.beams;
        const uint32_t *const end = tree.slots + slots.first + slots.n;
        F worst = *last;
        for (const uint32_t *slot = end - slots.n; slot != end; ++slot) {
            const Beam &beam = beams[*slot];
            const F d2 = distance2(at, part, beam);
            if (d2 <= worst && Part::is_seen(beam) && beam.id < tree.id_end) {
                nearest.offer({d2, static_cast<int32_t>(beam.id), static_cast<int32_t>(*slot)});
                worst = *last;
            }
        }
    } else {
        const auto listed = [&](uint32_t i) {
            return Listed{tree.beams, tree.slots[slots.first + i], {0, tree.id_end}};
        };
        F d2[kLeafSize]; // a tile of registers
        const F worst = nearest.worst();
        uint32_t wanted = 0;
        for (uint32_t i = 0; i < slots.n; ++i) {
            d2[i] = distance2(at, part, tree.beams[tree.slots[slots.first + i]]);
            wanted |= (lane::bits_where_le(d2[i], worst) != 0 ? 1u : 0u) << i;
        }
        note_items(part, slots.n, static_cast<uint32_t>(__builtin_popcount(wanted)));
        for (; wanted != 0; wanted &= wanted - 1) {
            const auto i = static_cast<uint32_t>(__builtin_ctz(wanted));
            offer_apart<Part>(nearest, d2[i], listed(i));
        }
    }
}

/// The walks that a search has left. Each walk goes from a subtree of the stack down to a leaf.
struct Walks {
    Subtree *stack; ///< Has room for kDepthMax entries more than `depth`.
    uint32_t depth; ///< Subtrees on the stack, the topmost is next. None is a part of another.
    uint32_t n_max; ///< Number of walks that the search may take.
};

/// The walks of a search of a whole tree.
inline Walks from_root(const KdTree &tree, Subtree *stack, uint32_t n_max = UINT32_MAX)
{
    stack[0] = root_of(tree);
    return {stack, tree.n_items > 0 ? 1u : 0u, n_max};
}

/// Push a subtree if a search needs it.
inline void push_if(bool is_needed, Subtree *&top, const Subtree &subtree)
{
    if (is_needed) {
        *top++ = subtree;
    }
}

/// search_tree() for one query: the same steps, with fewer copies of subtrees and boxes.
template <class Part>
bool search_tree_of_one(NearestK<float> &nearest, const Offset<float> at, const Part part,
                        const KdTree tree, const Walks walks)
{
    const Point place = {at.x_m, at.y_m};
    const float &worst = nearest.best[nearest.k - 1].d2;
    Subtree *top = walks.stack + walks.depth;
    for (uint32_t n_walks = walks.n_max; top != walks.stack; --n_walks) {
        if (n_walks == 0) {
            return false;
        }
        Subtree here = *--top;
        const float reach2 = box_reach2(worst);
        float d2 = box_distance2(load_box<4>(tree.boxes[here.node]), at.x_m, at.y_m);
        while (d2 <= reach2) {
            if (here.n_leaves <= 1) {
                offer_leaf(nearest, at, part, tree, here);
                break;
            }
            const uint32_t n_left = here.n_leaves / 2;
            const Box left = load_box<4>(tree.boxes[here.node + 1]);
            const Box right = load_box<5>(tree.boxes[here.node + 2 * n_left]);
            const float left_d2 = box_distance2(left, at.x_m, at.y_m);
            const float right_d2 = box_distance2(right, at.x_m, at.y_m);
            if (priority(part, right, place) < priority(part, left, place)) {
                push_if(left_d2 <= reach2, top, left_of(here));
                here = right_of(here);
                d2 = right_d2;
            } else {
                push_if(right_d2 <= reach2, top, right_of(here));
                here = left_of(here);
                d2 = left_d2;
            }
        }
    }
    return true;
}

/// Offer the beams of a tree. There is one search for all lanes. It takes the child with the
/// smaller priority() for the first query of the packet first, and skips boxes that no lane needs.
///
/// at       the queries, relative to the map's origin.
/// returns  false if walks.n_max walks were not enough: nearer beams may have been missed.
///
/// Cost: at most one visit of each node and leaf; in each walk at most one leaf, and two nodes of
/// each level.
///
/// Not inlined: if one function contained the code twice, the inner loops would run out of
/// registers.
template <class F, class Part>
[[gnu::noinline]] bool search_tree(NearestK<F> &nearest, Offset<F> at, Part part, KdTree tree,
                                   Walks walks)
{
    if constexpr (lane::width<F> == 1) {
        return search_tree_of_one(nearest, at, part, tree, walks);
    }
    Subtree *const stack = walks.stack;
    uint32_t depth = walks.depth;
    while (depth > 0) {
        if (walks.n_max-- == 0) {
            return false;
        }
        Prospect<F> here = prospect(tree, at, part, stack[--depth]);
        note_boxes(part, 1);
        const F reach2 = box_reach2(nearest.worst());
        while (lane::bits_where_le(here.d2, reach2) != 0 && here.subtree.n_leaves > 1) {
            Prospect<F> near = prospect(tree, at, part, left_of(here.subtree));
            Prospect<F> far = prospect(tree, at, part, right_of(here.subtree));
            note_boxes(part, 2);
            if (far.priority < near.priority) {
                const Prospect<F> left = near;
                near = far;
                far = left;
            }
            if (lane::bits_where_le(far.d2, reach2) != 0) {
                stack[depth++] = far.subtree;
            }
            here = near;
        }
        if (lane::bits_where_le(here.d2, reach2) != 0) {
            offer_leaf(nearest, at, part, tree, here.subtree);
        }
    }
    return true;
}

} // namespace gpom
