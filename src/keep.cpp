#include "src/keep.hpp"

#include "src/map.hpp"
#include "src/witness.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// A free segment is known if another runs by its end nearer than keep_m times this.
constexpr float kFreeSpacing = 4.0f;

/// A return this many times keep_m away from the next hit stands alone.
constexpr float kAloneGap = 4.0f;

/// Beams looked at for the least useful.
constexpr uint32_t kCandidates = 4;

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
        const float far2 = distance2(end_of(beam), map.keeper.robot);
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
    drop_beam(map, least.slot);
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
            drop_beam(map, entry.slot);
            ++map.stats.beams_not_confirmed;
        }
    }
    entry = {slot, map.index.beams[slot].id};
    ++keeper.n_provisional;
}

/// Squared distance to what is known that makes a beam new.
float spacing2_of(const gpom_map &map, const Beam &beam)
{
    const float spacing_m =
        beam.returned != 0 ? map.config.keep_m : kFreeSpacing * map.config.keep_m;
    return spacing_m * spacing_m;
}

/// True if a new return is at odds with free segments. Next to hits it is not asked: that is where
/// surfaces go on.
bool is_at_odds(gpom_map &map, const Beam &beam, float gap2_m2)
{
    const float alone_m = kAloneGap * map.config.keep_m;
    return map.config.clear_scans > 0 && gap2_m2 > alone_m * alone_m &&
           is_known_free(map, end_of(beam));
}

/// Decide about beam i of the group.
void decide(gpom_map &map, uint32_t i_beam)
{
    Group &group = map.keeper.group;
    Beam &beam = group.beams[i_beam];
    const uint32_t bit = 1u << i_beam;
    const bool clears = (group.clearing & bit) != 0;
    if ((group.against & bit) != 0 && !clears) {
        ++map.stats.beams_contradicting;
        return;
    }
    if ((group.known & bit) != 0 && !clears) {
        ++map.stats.beams_known;
        return;
    }
    const float gap2_m2 = gap2_of(map, beam, kIdEnd);
    const bool is_new = gap2_m2 >= spacing2_of(map, beam);
    if (!is_new && !clears) {
        ++map.stats.beams_known;
        return;
    }
    if (is_new && beam.returned != 0 && (group.sure & bit) != 0) {
        beam.provisional = is_at_odds(map, beam, gap2_m2) ? 1 : 0;
    }
    keep(map, beam, gap2_m2);
}

} // namespace

void mark_beam(gpom_map &map, const Beam &beam)
{
    const float length_m = beam.range_m + map.config.params.depth_m;
    const Segment whole = {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, length_m};
    lowres_mark_segment(map.lowres, {beam.x_m, beam.y_m}, end_of(whole), map.lowres.reach_m);
}

void drop_hit(gpom_map &map, uint32_t slot)
{
    mark_beam(map, map.index.beams[slot]);
    remove_hit(map.index, slot);
}

void drop_free(gpom_map &map, uint32_t slot)
{
    mark_beam(map, map.index.beams[slot]);
    remove_free(map.index, slot);
}

void drop_beam(gpom_map &map, uint32_t slot)
{
    mark_beam(map, map.index.beams[slot]);
    remove_beam(map.index, slot);
}

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
    mark_beam(map, beam);
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
    for (uint32_t i = 0; i < group.n; ++i) {
        decide(map, i);
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
