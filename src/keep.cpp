#include "src/keep.hpp"

#include "src/map.hpp"
#include "src/workspace.hpp"

namespace gpom
{

namespace
{

/// A beam speaks against a hit that it passes nearer than keep_m times this, and nearer than this
/// share of the way it still has to go: beams that graze a wall run along it before they end
/// there. Leaves and fences let beams through a hand's breadth beside a hit that will be hit again,
/// so that wider margins cost accuracy outdoors (DESIGN.md).
constexpr float kPassWidth = 0.15f;
constexpr float kPassSlope = 0.05f;

/// A free segment is known if another runs by its end nearer than keep_m times this.
constexpr float kFreeSpacing = 4.0f;

/// Scans of different times that must have seen something on a free segment before it is given up.
constexpr uint32_t kFreeAgainst = 4;

/// Beams looked at for the least useful.
constexpr uint32_t kCandidates = 8;

/// Lane vectors that a group fills.
constexpr uint32_t kVectors = kGroup / static_cast<uint32_t>(kLanes);

/// Visit the slots of a kind that may satisfy touches(box): those of the tree's boxes that do, and
/// the recent ones. Visited slots hold a beam with this part.
template <class Part, class Touches, class Visit>
void walk(const Index &index, const Part &part, Subtree *stack, const Touches &touches,
          const Visit &visit)
{
    const KdTree &tree = tree_of(index, part);
    const auto visit_member = [&](uint32_t slot) {
        if (Part::is_in(index.beams[slot])) {
            visit(slot);
        }
    };
    for_each_recent(index, tree, visit_member);
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = {0, 0, leaf_count(tree.n_items)};
    }
    while (depth > 0) {
        const Subtree t = stack[--depth];
        if (!touches(tree.boxes[t.node])) {
            continue;
        }
        if (t.n_leaves > 1) {
            stack[depth++] = right_of(t);
            stack[depth++] = left_of(t);
            continue;
        }
        const Stretch slots = slots_of(tree, t);
        for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
            if (index.beams[tree.slots[i]].id < tree.id_end) {
                visit_member(tree.slots[i]);
            }
        }
    }
}

/// Where a beam speaks: its return, or the far end of its free segment.
Point end_of(const Beam &beam)
{
    return {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y};
}

/// kLanes new beams of a group. Lanes beyond its last beam have no length and speak of nothing.
struct BeamLanes {
    SegmentLanes<F> segment;
    F returned; ///< 1: it ends at a surface.
    F sure;
};

BeamLanes lanes_of(const Group &group, uint32_t i_vector)
{
    const F zero = lane::splat<F>(0.0f);
    BeamLanes lanes = {{zero, zero, zero, zero, zero}, zero, zero};
    for (int i = 0; i < kLanes; ++i) {
        const uint32_t i_beam = i_vector * static_cast<uint32_t>(kLanes) + static_cast<uint32_t>(i);
        if (i_beam < group.n) {
            const Beam &beam = group.beams[i_beam];
            set_segment(lanes.segment, i,
                        {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, beam.range_m});
            lane::set(lanes.returned, i, beam.returned != 0 ? 1.0f : 0.0f);
            lane::set(lanes.sure, i, (group.sure >> i_beam & 1u) != 0 ? 1.0f : 0.0f);
        }
    }
    return lanes;
}

/// Bit i set where the mask holds.
template <class M> uint32_t bits_of_mask(M mask)
{
    if constexpr (kLanes == 1) {
        return mask != 0 ? 1u : 0u;
    } else {
        uint32_t bits = 0;
        for (int i = 0; i < kLanes; ++i) {
            bits |= (mask[i] != 0 ? 1u : 0u) << i;
        }
        return bits;
    }
}

/// True if one of the beams comes within reach_m of the box: projections on the beam and across it.
bool touches(const BeamLanes &lanes, const Box &box, float reach_m)
{
    const SegmentLanes<F> &s = lanes.segment;
    const F from_x = 0.5f * (box.x_min_m + box.x_max_m) - s.x_m;
    const F from_y = 0.5f * (box.y_min_m + box.y_max_m) - s.y_m;
    const float half_x_m = 0.5f * (box.x_max_m - box.x_min_m);
    const float half_y_m = 0.5f * (box.y_max_m - box.y_min_m);
    const F along = from_x * s.dir_x + from_y * s.dir_y;
    const F across = lane::abs(F(from_x * s.dir_y - from_y * s.dir_x));
    const F half_along = half_x_m * lane::abs(s.dir_x) + half_y_m * lane::abs(s.dir_y) + reach_m;
    const F half_across = half_x_m * lane::abs(s.dir_y) + half_y_m * lane::abs(s.dir_x) + reach_m;
    return lane::any((across <= half_across) & (along >= -half_along) &
                     (along <= s.length_m + half_along));
}

/// What one hit has to do with the beams of a group.
struct Witnesses {
    uint32_t ends;   ///< Bit i: beam i ends at it.
    uint32_t passes; ///< Bit i: beam i runs past it.
};

/// One group under judgement.
struct Trial {
    gpom_map &map;
    Box box; ///< Around all its beams, keep_m wider.
    BeamLanes lanes[kVectors];
    F gap2_m2[kVectors];
};

bool is_inside(const Box &box, const Point &p)
{
    return p.x_m >= box.x_min_m && p.x_m <= box.x_max_m && p.y_m >= box.y_min_m &&
           p.y_m <= box.y_max_m;
}

bool overlap(const Box &a, const Box &b)
{
    return a.x_min_m <= b.x_max_m && b.x_min_m <= a.x_max_m && a.y_min_m <= b.y_max_m &&
           b.y_min_m <= a.y_max_m;
}

/// Compare a hit with kLanes beams of the group.
Witnesses witnesses_of(Trial &trial, uint32_t i_vector, const Point &at, bool is_standing)
{
    const float keep_m = trial.map.config.keep_m;
    const BeamLanes &lanes = trial.lanes[i_vector];
    const SegmentLanes<F> &s = lanes.segment;
    const F from_x = at.x_m - s.x_m;
    const F from_y = at.y_m - s.y_m;
    const F across = lane::abs(F(from_x * s.dir_y - from_y * s.dir_x));
    if (!lane::any(across < keep_m)) {
        return {0, 0};
    }
    const F along = from_x * s.dir_x + from_y * s.dir_y;
    const F to_go = s.length_m - along;
    const F gap2 = across * across + to_go * to_go;
    const F width = lane::min(F(kPassSlope * to_go), lane::splat<F>(kPassWidth * keep_m));
    const auto ends = (lanes.returned > 0.0f) & (gap2 < keep_m * keep_m);
    const auto passes = (lanes.sure > 0.0f) & (along > 0.0f) & (to_go > keep_m) & (across < width);
    if (is_standing) {
        F &least = trial.gap2_m2[i_vector];
        least = lane::select(ends & (gap2 < least), gap2, least);
    }
    return {bits_of_mask(ends), bits_of_mask(passes)};
}

Witnesses witnesses_of(Trial &trial, const Point &at, bool is_standing)
{
    Witnesses all = {0, 0};
    for (uint32_t v = 0; v < kVectors; ++v) {
        const Witnesses some = witnesses_of(trial, v, at, is_standing);
        all.ends |= some.ends << (v * static_cast<uint32_t>(kLanes));
        all.passes |= some.passes << (v * static_cast<uint32_t>(kLanes));
    }
    return all;
}

/// Something was seen at `at`, between a kept beam's sensor and its end: true if the free segment
/// stands all the same.
bool stands_against(gpom_map &map, uint32_t slot, const Point &at)
{
    Beam &beam = map.index.beams[slot];
    const float from_x = at.x_m - beam.x_m;
    const float from_y = at.y_m - beam.y_m;
    const float along = from_x * beam.dir_x + from_y * beam.dir_y;
    const float across = lane::abs(from_x * beam.dir_y - from_y * beam.dir_x);
    const float to_go = beam.range_m - along;
    const float keep_m = map.config.keep_m;
    const float width = lane::min(kPassSlope * to_go, kPassWidth * keep_m);
    const bool is_on_it = along > 0.0f && to_go > keep_m && across < width;
    if (!is_on_it || beam.id >= map.keeper.scan_first_id) {
        return false;
    }
    if (beam.free_against == 0 || beam.free_time != (map.keeper.time_mark & 3u)) {
        beam.free_against = (beam.free_against + 1u) & 3u;
        beam.free_time = map.keeper.time_mark & 3u;
    }
    if (beam.free_against != kFreeAgainst % 4u) {
        return true;
    }
    remove_free(map.index, slot);
    ++map.stats.free_cleared;
    return false;
}

/// Let a hit at `at` speak against the free segments it lies on. True if one stands all the same.
bool speaks_against_free(gpom_map &map, const Point &at)
{
    const float reach_m = kPassWidth * map.config.keep_m;
    bool any_stands = false;
    walk(
        map.index, map.index.free_part, map.keeper.free_stack,
        [&](const Box &box) { return box_distance2(box, at.x_m, at.y_m) <= reach_m * reach_m; },
        [&](uint32_t slot) { any_stands |= stands_against(map, slot, at); });
    return any_stands;
}

/// A scan saw the hit again: one count more if at another time, and whoever saw through it erred.
/// One that is provisional goes on waiting if the time is its own.
void confirm(gpom_map &map, Beam &beam)
{
    const uint16_t time = map.keeper.time_mark;
    const bool is_own_time = beam.stamp_ms == map.keeper.stamp_ms && beam.hit_time == time;
    if (beam.provisional != 0 && is_own_time) {
        return;
    }
    const bool counted = beam.hit_against == 0 && beam.hit_time == time;
    if (beam.provisional == 0 && !counted && beam.agreed < kAgreedMax) {
        beam.agreed = (beam.agreed + 1u) & kAgreedMax;
    }
    beam.provisional = 0;
    beam.hit_against = 0;
    beam.hit_time = time & 3u;
}

/// A scan saw through a hit: the first in a row takes one count, the next two, four, eight, so
/// that five in a row outweigh any number that saw it before. True if it is gone: the counts are
/// used up and enough scans were in the row. One that is provisional goes at once; one that was
/// confirmed at this very time stays as it is.
bool contradict(gpom_map &map, uint32_t slot)
{
    Beam &beam = map.index.beams[slot];
    if (beam.provisional != 0) {
        remove_beam(map.index, slot);
        ++map.stats.beams_not_confirmed;
        return true;
    }
    if (beam.hit_time == map.keeper.time_mark) {
        return false;
    }
    beam.hit_time = map.keeper.time_mark & 3u;
    const uint32_t in_row = beam.hit_against;
    const uint32_t counts = 1u << in_row;
    if (beam.agreed < counts && in_row + 1u >= map.config.clear_scans) {
        remove_hit(map.index, slot);
        ++map.stats.hits_cleared;
        return true;
    }
    beam.agreed = (beam.agreed > counts ? beam.agreed - counts : 0u) & kAgreedMax;
    beam.hit_against = (in_row < 3 ? in_row + 1u : 3u) & 3u;
    return false;
}

/// Let the group's beams speak for or against one kept hit of another scan. Only a hit that stands
/// makes a beam's return known.
void judge_hit(Trial &trial, uint32_t slot)
{
    gpom_map &map = trial.map;
    Group &group = map.keeper.group;
    Beam &beam = map.index.beams[slot];
    const Point at = end_of(beam);
    if (!is_inside(trial.box, at)) {
        return;
    }
    const bool was_provisional = beam.provisional != 0;
    const Witnesses witnesses = witnesses_of(trial, at, !was_provisional);
    if (beam.id >= map.keeper.scan_first_id) {
        return;
    }
    if (witnesses.ends != 0) {
        group.known |= witnesses.ends;
        confirm(map, beam);
        if (was_provisional && beam.provisional == 0) {
            speaks_against_free(map, at);
        }
    } else if (witnesses.passes != 0 && map.config.clear_scans > 0) {
        const bool gone = contradict(map, slot);
        group.clearing |= gone && !was_provisional ? witnesses.passes : 0u;
        group.against |= gone ? 0u : witnesses.passes;
    }
}

float distance2(const Point &a, const Point &b)
{
    const float dx_m = a.x_m - b.x_m;
    const float dy_m = a.y_m - b.y_m;
    return dx_m * dx_m + dy_m * dy_m;
}

/// Squared distance from a place to the nearest part of a kind, of another beam than `own_id`.
template <class Part>
float gap2_of(gpom_map &map, const Part &part, const Point &at, uint32_t own_id)
{
    float d2[2];
    int32_t id[2], slot[2];
    NearestK<float> nearest = {d2, id, slot, 2};
    nearest.clear();
    search(nearest, {at.x_m, at.y_m}, map.index, part, map.keeper.hit_stack);
    return id[0] == static_cast<int32_t>(own_id) ? d2[1] : d2[0];
}

/// How far a beam is from saying what is known: its hit from the next hit, or, without a hit, its
/// far end from the next free segment.
float gap2_of(gpom_map &map, const Beam &beam, uint32_t own_id)
{
    const Point end = end_of(beam);
    return beam.has_hit != 0 ? gap2_of(map, map.index.hit_part, end, own_id)
                             : gap2_of(map, map.index.free_part, end, own_id);
}

/// How much a kept beam is worth: its gap, less for one that is far from the robot or old, if that
/// counts; nothing while it waits for confirmation.
float usefulness(gpom_map &map, const Beam &beam)
{
    if (beam.provisional != 0) {
        return 0.0f;
    }
    float discount = 1.0f;
    if (map.config.far_m > 0.0f) {
        const float far2 = distance2(end_of(beam), map.keeper.robot_m);
        discount += far2 / (map.config.far_m * map.config.far_m);
    }
    if (map.config.old_s > 0.0f) {
        const uint32_t now_ms = map.keeper.stamp_ms; // a clock may step back
        const uint32_t age_ms = now_ms > beam.stamp_ms ? now_ms - beam.stamp_ms : 0;
        const float age_s = 1e-3f * static_cast<float>(age_ms);
        discount += age_s / map.config.old_s;
    }
    return gap2_of(map, beam, beam.id) / discount;
}

/// The least useful of the next kCandidates beams behind the hand.
struct Candidate {
    uint32_t slot;
    float usefulness;
};

Candidate least_useful(gpom_map &map)
{
    Candidate least = {kNoSlot, FLT_MAX};
    for (uint32_t i = 0; i < kCandidates; ++i) {
        const uint32_t slot = map.keeper.hand;
        map.keeper.hand = slot + 1 == map.index.n_slots ? 0 : slot + 1;
        const float here = usefulness(map, map.index.beams[slot]);
        if (here < least.usefulness) {
            least = {slot, here};
        }
    }
    return least;
}

/// Make room for a beam that is worth `worth`. False if what is kept is worth more.
bool make_room(gpom_map &map, float worth)
{
    const Candidate least = least_useful(map);
    if (least.slot == kNoSlot || !(least.usefulness < worth)) {
        return false;
    }
    remove_beam(map.index, least.slot);
    ++map.stats.beams_evicted;
    return true;
}

/// Enter a provisional beam into the ring; the oldest, if still waiting, goes.
void enter_provisional(gpom_map &map, uint32_t slot)
{
    Keeper &keeper = map.keeper;
    Waiting &entry = keeper.provisional[keeper.n_provisional % keeper.provisional_max];
    if (keeper.n_provisional >= keeper.provisional_max) {
        const Beam &oldest = map.index.beams[entry.slot];
        if (oldest.id == entry.id && oldest.has_hit != 0 && oldest.provisional != 0) {
            remove_beam(map.index, entry.slot);
            ++map.stats.beams_not_confirmed;
        }
    }
    entry = {slot, map.index.beams[slot].id};
    ++keeper.n_provisional;
}

/// True if a return of the group that was kept already is where this one is.
bool repeats_group(const gpom_map &map, uint32_t i_beam, uint32_t kept)
{
    const Group &group = map.keeper.group;
    const float keep2_m2 = map.config.keep_m * map.config.keep_m;
    const Point end = end_of(group.beams[i_beam]);
    for (uint32_t j = 0; j < i_beam; ++j) {
        const bool is_kept_return = (kept >> j & 1u) != 0 && group.beams[j].returned != 0;
        if (is_kept_return && distance2(end, end_of(group.beams[j])) < keep2_m2) {
            return true;
        }
    }
    return false;
}

/// Squared distance to what is known that makes a beam new.
float spacing2_of(const gpom_map &map, const Beam &beam)
{
    const float spacing_m =
        beam.returned != 0 ? map.config.keep_m : kFreeSpacing * map.config.keep_m;
    return spacing_m * spacing_m;
}

/// Decide about beam i of the group. True if it was kept.
bool decide(gpom_map &map, uint32_t i_beam, uint32_t kept)
{
    Group &group = map.keeper.group;
    Beam &beam = group.beams[i_beam];
    const uint32_t bit = 1u << i_beam;
    if (beam.returned == 0) {
        group.gap2_m2[i_beam] = gap2_of(map, beam, kIdEnd);
    }
    const bool is_known = (group.known & bit) != 0 ||
                          group.gap2_m2[i_beam] < spacing2_of(map, beam) ||
                          (beam.returned != 0 && repeats_group(map, i_beam, kept));
    const bool clears = (group.clearing & bit) != 0;
    if ((group.against & bit) != 0 && !clears) {
        ++map.stats.beams_contradicting;
        return false;
    }
    if (is_known && !clears) {
        ++map.stats.beams_known;
        return false;
    }
    if (beam.returned != 0 && !is_known && (group.sure & bit) != 0 && map.config.clear_scans > 0) {
        beam.provisional = speaks_against_free(map, end_of(beam)) ? 1 : 0;
    }
    return keep(map, beam, group.gap2_m2[i_beam]) != kNoSlot;
}

Box box_around(const Group &group, float reach_m)
{
    Box box = {FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (uint32_t i = 0; i < group.n; ++i) {
        const Beam &beam = group.beams[i];
        const Point end = end_of(beam);
        box = {lane::min(box.x_min_m, lane::min(beam.x_m, end.x_m) - reach_m),
               lane::min(box.y_min_m, lane::min(beam.y_m, end.y_m) - reach_m),
               lane::max(box.x_max_m, lane::max(beam.x_m, end.x_m) + reach_m),
               lane::max(box.y_max_m, lane::max(beam.y_m, end.y_m) + reach_m)};
    }
    return box;
}

/// Compare all kept hits near a group's beams with them.
void judge(gpom_map &map)
{
    Group &group = map.keeper.group;
    Trial trial = {map, box_around(group, map.config.keep_m), {}, {}};
    for (uint32_t v = 0; v < kVectors; ++v) {
        trial.lanes[v] = lanes_of(group, v);
        trial.gap2_m2[v] = lane::splat<F>(kNoDistance2);
    }
    const auto touches_any = [&](const Box &box) {
        if (!overlap(box, trial.box)) {
            return false;
        }
        for (uint32_t v = 0; v < kVectors; ++v) {
            if (touches(trial.lanes[v], box, map.config.keep_m)) {
                return true;
            }
        }
        return false;
    };
    walk(map.index, map.index.hit_part, map.keeper.hit_stack, touches_any,
         [&](uint32_t slot) { judge_hit(trial, slot); });
    for (uint32_t i = 0; i < group.n; ++i) {
        group.gap2_m2[i] = lane::get(trial.gap2_m2[i / static_cast<uint32_t>(kLanes)],
                                     static_cast<int>(i % static_cast<uint32_t>(kLanes)));
    }
}

} // namespace

uint32_t keep(gpom_map &map, const Beam &beam, float gap2_m2)
{
    if (map.index.next_id == kIdEnd) {
        ++map.stats.beams_ids_spent;
        return kNoSlot;
    }
    if (is_full(map.index) && !make_room(map, gap2_m2)) {
        ++map.stats.beams_redundant;
        return kNoSlot;
    }
    const uint32_t slot = insert(map.index, beam);
    if (beam.provisional != 0) {
        enter_provisional(map, slot);
    }
    ++(beam.returned != 0 ? map.stats.beams_hit : map.stats.beams_no_return);
    return slot;
}

void forget_all(Keeper &keeper)
{
    keeper.n_provisional = 0;
    keeper.hand = 0;
}

void settle(gpom_map &map)
{
    Group &group = map.keeper.group;
    group.known = 0;
    group.against = 0;
    group.clearing = 0;
    judge(map);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < group.n; ++i) {
        kept |= (decide(map, i, kept) ? 1u : 0u) << i;
    }
    group.n = 0;
    group.sure = 0;
}

void consider(gpom_map &map, const Beam &beam, bool sure)
{
    if (!(map.config.keep_m > 0.0f)) {
        keep(map, beam, kNoDistance2);
        return;
    }
    Group &group = map.keeper.group;
    group.sure |= (sure ? 1u : 0u) << group.n;
    group.beams[group.n++] = beam;
    if (group.n == kGroup) {
        settle(map);
    }
}

} // namespace gpom
