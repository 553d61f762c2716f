#include "src/insert/keep.hpp"

#include "src/insert/known_free.hpp"
#include "src/insert/witness.hpp"
#include "src/map/map.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// A free segment is known if another runs by its end nearer than keep_m times this.
constexpr float kFreeSpacing = 4.0f;

/// A return this many times keep_m away from the next hit stands alone.
constexpr float kAloneGap = 2.0f;

/// keep_m as recommended.
constexpr float kUsualSpacing_m = 0.1f;

/// Gaps beyond this many times keep_m count alike when the least useful beam is sought.
constexpr float kWorthGap = 16.0f;

/// Kept beams of which the less useful makes room.
constexpr uint32_t kCandidates = 2;

/// A squared gap that nobody looked for: no gap is wider.
constexpr float kGapUnknown2_m2 = FLT_MAX;

float distance2(const Point &a, const Point &b)
{
    const float dx_m = a.x_m - b.x_m;
    const float dy_m = a.y_m - b.y_m;
    return dx_m * dx_m + dy_m * dy_m;
}

float square(float x) { return x * x; }

/// True if a hit is past since before now.
bool was_past(const gpom_map &map, const Beam &beam)
{
    const Keeper &now = map.keeper;
    return is_past(beam) && !(beam.hit_time == now.time_mark && beam.stamp_ms == now.stamp_ms);
}

/// The two nearest kept hits of a place, within a distance: fewer have id kNoId.
struct NearHits {
    Found<float> best[2];
};

/// What near_hits() looks for.
struct HitsAbout {
    Point at;
    float within2_m2;
    float enough2_m2; ///< Once one is nearer, others are not looked for.
    bool past;        ///< Hits that were past before now; else those that are not.
};

NearHits near_hits(const gpom_map &map, Subtree *stack, const HitsAbout &wanted)
{
    NearHits near = {{{wanted.within2_m2, kNoId, -1}, {wanted.within2_m2, kNoId, -1}}};
    NearestK<float> nearest = {near.best, 2, 2};
    const Offset<float> at = {wanted.at.x_m, wanted.at.y_m};
    const Index &index = map.index;
    walk(
        index, index.hit_part, stack,
        [&](const Box &box) {
            return box_distance2(box, at.x_m, at.y_m) <= box_reach2(nearest.worst());
        },
        [&](uint32_t slot) {
            const Beam &beam = index.beams[slot];
            if (wanted.past ? was_past(map, beam) : !is_past(beam)) {
                offer_beam(nearest, at, index.hit_part, {index.beams, slot, {0, index.next_id}});
            }
            return !(near.best[0].d2 < wanted.enough2_m2);
        });
    return near;
}

/// The two nearest hits that are not past.
NearHits near_hits(gpom_map &map, const Point &at, float within2_m2, float enough2_m2)
{
    return near_hits(map, map.keeper.hit_stack, {at, within2_m2, enough2_m2, false});
}

/// True if a hit that was past before now is nearer to a place than keep_m. Also while hits are
/// walked: as in what order must not matter, those that are past since now do not count.
bool is_near_past(gpom_map &map, const Point &at)
{
    const float keep2_m2 = square(map.config.keep_m);
    const NearHits near = near_hits(map, map.keeper.inner_stack, {at, keep2_m2, keep2_m2, true});
    return near.best[0].d2 < keep2_m2;
}

/// What gaps are compared with, also where every beam is kept.
float spacing_of(const gpom_map &map)
{
    return map.config.keep_m > 0.0f ? map.config.keep_m : kUsualSpacing_m;
}

/// The squared gap of a return that stands alone.
float alone2_of(const gpom_map &map) { return square(kAloneGap * spacing_of(map)); }

/// What a beam is worth: the squared gap between its hit and the nearest kept one of another beam
/// than `own_id`, at most `most2_m2` and at most as with a gap of kWorthGap. A past hit is worth
/// nothing; a free segment without a hit that stands as much as a hit that stands alone.
float worth_of(gpom_map &map, const Beam &beam, uint32_t own_id, float most2_m2)
{
    if (!has_hit(beam) || is_past(beam)) {
        return beam.has_free != 0 ? alone2_of(map) : 0.0f;
    }
    const float within2_m2 = lane::min(most2_m2, square(kWorthGap * spacing_of(map)));
    const NearHits near = near_hits(map, end_of(beam), within2_m2, 0.0f);
    return near.best[near.best[0].id == static_cast<int32_t>(own_id) ? 1 : 0].d2;
}

/// By how much a kept beam is worth less for its distance from the robot and its age, if they
/// count, and for the scans in a row that saw through its hit.
struct Discount {
    float far, old, against;

    float divisor() const { return 1.0f + far + old + against; }
};

Discount discount_of(const gpom_map &map, const Beam &beam)
{
    Discount discount = {0.0f, 0.0f, static_cast<float>(beam.hit_against)};
    if (map.config.far_m > 0.0f) {
        const float far2 = distance2(end_of(beam), map.keeper.robot);
        discount.far = far2 / (map.config.far_m * map.config.far_m);
    }
    if (map.config.old_s > 0.0f) {
        const uint32_t now_ms = map.keeper.stamp_ms; // a clock may step back
        const uint32_t age_ms = now_ms > beam.stamp_ms ? now_ms - beam.stamp_ms : 0;
        discount.old = 1e-3f * static_cast<float>(age_ms) / map.config.old_s;
    }
    return discount;
}

/// A kept beam, what it is worth, and how much of that is left where it is discounted.
struct Candidate {
    uint32_t slot;
    float worth, usefulness;
};

/// The next beam in turn; one that waits for confirmation is worth nothing. Its usefulness is exact
/// if it is less than `most`: farther off its next hit need not be looked for.
Candidate next_candidate(gpom_map &map, float most)
{
    constexpr float kRounding = 1.00001f; // of the division that takes the divisor back
    const uint32_t slot = map.keeper.hand;
    map.keeper.hand = slot + 1 == map.index.n_slots ? 0 : slot + 1;
    const Beam &beam = map.index.beams[slot];
    if (is_provisional(beam)) {
        return {slot, 0.0f, 0.0f};
    }
    const float divisor = discount_of(map, beam).divisor();
    const float worth = worth_of(map, beam, beam.id, kRounding * most * divisor);
    return {slot, worth, worth / divisor};
}

/// The counter of what lowers a beam's usefulness by the greatest factor: its gap, if it is less
/// than that of a hit that stands alone, or a part of its discount.
uint64_t &cause_of(gpom_map &map, const Candidate &evicted)
{
    gpom_stats_t &stats = map.stats;
    const Beam &beam = map.index.beams[evicted.slot];
    if (is_provisional(beam)) {
        return stats.beams_not_confirmed;
    }
    if (is_past(beam) && beam.has_free == 0) {
        return stats.beams_evicted_contradicted;
    }
    const Discount discount = discount_of(map, beam);
    const float divisor = discount.divisor();
    const float most = lane::max(discount.against, lane::max(discount.far, discount.old));
    const float worth_alone = lane::max(evicted.worth, alone2_of(map));
    if (worth_alone * (divisor - most) >= evicted.worth * divisor) {
        return stats.beams_evicted_redundant;
    }
    if (most == discount.far) {
        return stats.beams_evicted_far;
    }
    return most == discount.old ? stats.beams_evicted_old : stats.beams_evicted_contradicted;
}

/// Make room for a beam that is worth `worth`. False if what is kept is worth more.
bool make_room(gpom_map &map, float worth)
{
    Candidate least = {kNoSlot, worth, worth};
    for (uint32_t i = 0; i < kCandidates; ++i) {
        const Candidate here = next_candidate(map, least.usefulness);
        if (here.usefulness < least.usefulness) {
            least = here;
        }
    }
    if (least.slot == kNoSlot) {
        return false;
    }
    ++cause_of(map, least);
    drop_beam(map, least.slot);
    return true;
}

/// Enter a provisional beam into the ring; the oldest, if still waiting, goes.
void enter_provisional(gpom_map &map, uint32_t slot)
{
    Keeper &keeper = map.keeper;
    Waiting &entry = keeper.provisional[keeper.n_provisional % keeper.provisional_max];
    if (keeper.n_provisional >= keeper.provisional_max) {
        const Beam &oldest = map.index.beams[entry.slot];
        if (oldest.id == entry.id && is_provisional(oldest)) {
            drop_beam(map, entry.slot);
            ++map.stats.beams_not_confirmed;
        }
    }
    entry = {slot, map.index.beams[slot].id};
    ++keeper.n_provisional;
}

/// True if none of the nearest hits was known before the scan, but for those that arrived, too.
bool stands_apart(const gpom_map &map, const NearHits &near)
{
    for (const Found<float> &hit : near.best) {
        if (hit.id != kNoId) {
            const Beam &other = map.index.beams[hit.slot];
            if (other.id < map.keeper.scan_first_id && other.arrived == 0) {
                return false;
            }
        }
    }
    return true;
}

/// Mark a new return that is at odds with free segments. Next to hits that were known it is not
/// asked: that is where surfaces go on. Where it stands alone it may be wrong and has to wait.
void mark_arrival(gpom_map &map, Beam &beam, const NearHits &near)
{
    const Point at = end_of(beam);
    if (stands_apart(map, near) && is_known_free(map, at, kClear)) {
        beam.arrived = 1;
        const bool is_alone = near.best[0].id == kNoId;
        beam.hit = is_alone && is_known_free(map, at, kPass) ? kProvisional : kStanding;
    }
}

/// What a beam says that is new: the squared gap between its hit and the nearest kept one, at most
/// that of one that stands alone; as much without a hit; 0: nothing. A return may then be
/// provisional.
float news_of(gpom_map &map, Beam &beam, bool is_sure)
{
    const float keep_m = map.config.keep_m;
    const Point at = end_of(beam);
    if (beam.returned == 0) {
        const float spacing_m = kFreeSpacing * keep_m;
        const bool is_known = is_near_free(map.index, map.keeper.inner_stack, at, spacing_m);
        return is_known ? 0.0f : alone2_of(map);
    }
    const NearHits near = near_hits(map, at, alone2_of(map), square(keep_m));
    const float gap2_m2 = near.best[0].d2;
    if (gap2_m2 < square(keep_m)) {
        return 0.0f;
    }
    if (is_sure && map.config.clear_scans > 0) {
        mark_arrival(map, beam, near);
    }
    return gap2_m2;
}

/// Put a beam into the store, making room if it is full; if what is there is worth more, the beam
/// is dropped and counted. gap2_m2: between its hit and the nearest kept one, exact if less than
/// that of one that stands alone.
void keep(gpom_map &map, const Beam &beam, float gap2_m2)
{
    if (map.index.next_id == kIdEnd) {
        ++map.stats.beams_ids_spent;
        return;
    }
    if (is_full(map.index)) {
        const bool is_exact = gap2_m2 < alone2_of(map);
        const float worth = is_exact ? gap2_m2 : worth_of(map, beam, kIdEnd, kGapUnknown2_m2);
        if (!make_room(map, worth)) {
            ++map.stats.beams_redundant;
            return;
        }
    }
    const uint32_t slot = insert(map.index, beam);
    mark_beam(map, beam);
    if (is_provisional(beam)) {
        enter_provisional(map, slot);
    }
    ++(beam.returned != 0 ? map.stats.beams_hit : map.stats.beams_no_return);
}

/// Keep a beam in place of the one whose hit it confirms, if that still has no free segment: what
/// gave way to something that has gone since is seen anew. True if it did.
bool renew(gpom_map &map, Beam &beam, uint32_t slot)
{
    if (slot == kNoSlot || map.index.next_id == kIdEnd) {
        return false;
    }
    const Beam &old = map.index.beams[slot];
    if (!has_hit(old) || old.has_free != 0) { // another one renewed it, or cleared it
        return false;
    }
    beam.agreed = old.agreed;
    beam.arrived = old.arrived;
    drop_hit(map, slot);
    keep(map, beam, kGapUnknown2_m2);
    return true;
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
    if (renew(map, beam, group.renews[i_beam])) {
        return;
    }
    const bool is_known = (group.known & bit) != 0;
    const float gap2_m2 = is_known ? 0.0f : news_of(map, beam, (group.sure & bit) != 0);
    if (gap2_m2 > 0.0f) {
        if ((group.isolated & bit) != 0) {
            beam.hit = kProvisional;
        }
        keep(map, beam, gap2_m2);
    } else if (clears) {
        keep(map, beam, kGapUnknown2_m2);
    } else {
        ++map.stats.beams_known;
    }
}

/// Decide about the beams of a group.
void settle_group(gpom_map &map)
{
    Group &group = map.keeper.group;
    group.known = 0;
    group.against = 0;
    group.clearing = 0;
    for (uint32_t &slot : group.renews) {
        slot = kNoSlot;
    }
    const uint32_t first_free = map.index.first_free;
    judge(map);
    sort_freed(map.index, first_free);
    for (uint32_t i = 0; i < group.n; ++i) {
        decide(map, i);
    }
    group.n = 0;
    group.returned = 0;
    group.sure = 0;
    group.isolated = 0;
    index_long_scan(map.index, map.keeper.scan_first_id);
}

/// True if a neighbour in the scan looks past a beam's end: it is keep_m beside it or nearer, and
/// reaches 2 keep_m beyond.
bool looks_past(const Ray &neighbour, const Ray &ray, float keep_m)
{
    if (!(neighbour.range_m > ray.range_m + 2.0f * keep_m)) {
        return false;
    }
    const float x_m = ray.range_m * (neighbour.dir_x - ray.dir_x) + (neighbour.x_m - ray.x_m);
    const float y_m = ray.range_m * (neighbour.dir_y - ray.dir_y) + (neighbour.y_m - ray.y_m);
    return x_m * x_m + y_m * y_m <= keep_m * keep_m;
}

/// Note the next beam of the scan: with it both neighbours of the one before are known. If they
/// look past that, what it hit is thin, or it is wrong.
void note_ray(gpom_map &map, const Ray &ray)
{
    Keeper &keeper = map.keeper;
    Group &group = keeper.group;
    Ray &before_last = keeper.last[keeper.n_rays % 2];
    const Ray &last = keeper.last[1 - keeper.n_rays % 2];
    const float keep_m = map.config.keep_m;
    if (keeper.n_rays >= 2 && looks_past(before_last, last, keep_m) &&
        looks_past(ray, last, keep_m)) {
        group.isolated |= group.sure & (1u << (group.n - 1));
    }
    before_last = ray;
    ++keeper.n_rays;
}

} // namespace

void drop_all(gpom_map &map)
{
    forget_all(map.index);
    map.keeper.n_provisional = 0;
    map.keeper.hand = 0;
}

void mark_beam(gpom_map &map, const Beam &beam)
{
    const float length_m = beam.range_m + map.config.params.depth_m;
    const Segment whole = {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, length_m};
    lowres_mark_segment(map.lowres, {beam.x_m, beam.y_m}, end_of(whole), map.lowres.reach_m);
}

void mark_hit(gpom_map &map, const Beam &beam)
{
    const Segment part = map.index.hit_part(beam);
    lowres_mark_segment(map.lowres, end_of(beam), end_of(part), map.lowres.reach_m);
}

void drop_hit(gpom_map &map, uint32_t slot)
{
    mark_beam(map, map.index.beams[slot]);
    remove_hit(map.index, slot);
}

void retire_hit(gpom_map &map, uint32_t slot)
{
    Beam &beam = map.index.beams[slot];
    if (is_near_past(map, end_of(beam))) {
        drop_hit(map, slot);
        return;
    }
    mark_hit(map, beam);
    beam.hit = kPast;
    beam.stamp_ms = map.keeper.stamp_ms;
    beam.agreed = 0;
    beam.hit_against = 0;
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

void settle(gpom_map &map)
{
    if (map.keeper.group.n > 0) {
        settle_group(map);
    }
    map.keeper.n_rays = 0;
}

void consider(gpom_map &map, const Beam &beam, bool sure)
{
    if (!(map.config.keep_m > 0.0f)) {
        keep(map, beam, kGapUnknown2_m2);
        return;
    }
    Group &group = map.keeper.group;
    if (map.config.clear_scans > 0) {
        note_ray(map, {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, beam.range_m});
    }
    if (group.n == kGroup) {
        settle_group(map);
    }
    group.returned |= static_cast<uint32_t>(beam.returned) << group.n;
    group.sure |= (sure ? 1u : 0u) << group.n;
    group.beams[group.n++] = beam;
}

} // namespace gpom
