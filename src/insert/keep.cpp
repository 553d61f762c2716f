#include "src/insert/keep.hpp"

#include "src/insert/evict.hpp"
#include "src/insert/known_free.hpp"
#include "src/insert/witness.hpp"
#include "src/map/map.hpp"
#include "src/map/near_hits.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// A beam without a return says nothing new if a free segment passes its end nearer than keep_m
/// times this.
constexpr float kFreeSpacing = 4.0f;

/// True if every near hit is new: of this scan, or one that arrived where the place was free.
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

/// Mark a new return that lies on free segments. Next to a known hit the return is not marked,
/// because surfaces go on there. A return that stands alone may be wrong: it becomes provisional.
void mark_arrival(gpom_map &map, Beam &beam, const NearHits &near)
{
    const Point at = end_of(beam);
    if (stands_apart(map, near) && is_known_free(map, at, kClear)) {
        beam.arrived = 1;
        const bool is_alone = near.best[0].id == kNoId;
        beam.hit = is_alone && is_known_free(map, at, kPass) ? kProvisional : kStanding;
    }
}

/// Squared distance from a beam's hit to the nearest kept hit, at most alone2_of(); 0 if the beam
/// is not worth keeping. A beam without a return counts as alone. A new return may become
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
    const NearHits near = near_hits(map, {at, alone2_of(map), keep_m * keep_m});
    const float gap2_m2 = near.best[0].d2;
    if (gap2_m2 < keep_m * keep_m) {
        return 0.0f;
    }
    if (is_sure && map.config.clear_scans > 0) {
        mark_arrival(map, beam, near);
    }
    return gap2_m2;
}

/// Keep a beam. If the store is full of beams that are worth more, or no id is left, the beam is
/// dropped and counted. gap2_m2: as in make_room().
/// The beam may begin late.
void keep(gpom_map &map, Beam &beam, float gap2_m2)
{
    if (map.index.next_id == kIdEnd) {
        ++map.stats.beams_ids_spent;
        return;
    }
    if (!make_room(map, beam, gap2_m2)) {
        ++map.stats.beams_redundant;
        return;
    }
    if (map.keeper.begin_late != nullptr) {
        map.keeper.begin_late(map, beam);
    }
    store_beam(map, beam);
}

/// Replace the beam whose hit a new beam confirms, if that beam has no free segment: it lost the
/// segment to something that is gone now. True if it did.
bool renew(gpom_map &map, Beam &beam, uint32_t slot)
{
    if (slot == kNoSlot || map.index.next_id == kIdEnd) {
        return false;
    }
    const Beam &old = map.index.beams[slot];
    if (!has_hit(old) || old.has_free != 0) { // another beam renewed it, or cleared it
        return false;
    }
    beam.agreed = old.agreed;
    beam.arrived = old.arrived;
    drop_hit(map, slot);
    keep(map, beam, kGapUnknown2_m2);
    return true;
}

/// Keep or drop beam i of the group.
void decide(gpom_map &map, uint32_t i_beam, const Judgement &judgement)
{
    Group &group = map.keeper.group;
    Beam &beam = group.beams[i_beam];
    const Verdict verdict = judgement.of(i_beam);
    if (verdict == Verdict::kRefused) {
        ++map.stats.beams_contradicting;
        return;
    }
    if (renew(map, beam, judgement.renews[i_beam])) {
        return;
    }
    const uint32_t bit = 1u << i_beam;
    const bool is_known = verdict == Verdict::kKnown || verdict == Verdict::kClearsKnown;
    const float gap2_m2 = is_known ? 0.0f : news_of(map, beam, (group.sure & bit) != 0);
    if (gap2_m2 > 0.0f) {
        if ((group.isolated & bit) != 0) {
            beam.hit = kProvisional;
        }
        keep(map, beam, gap2_m2);
    } else if (verdict == Verdict::kClears || verdict == Verdict::kClearsKnown) {
        keep(map, beam, kGapUnknown2_m2);
    } else {
        ++map.stats.beams_known;
    }
}

/// Decide about the beams of a complete group.
void settle_group(gpom_map &map)
{
    Group &group = map.keeper.group;
    const uint32_t first_vacant = map.index.first_vacant;
    Judgement judgement;
    judge(map, judgement);
    sort_vacated(map.index, first_vacant);
    for (uint32_t i = 0; i < group.n; ++i) {
        decide(map, i, judgement);
    }
    group.n = 0;
    group.returned = 0;
    group.sure = 0;
    group.isolated = 0;
    index_long_scan(map.index, map.keeper.scan_first_id);
}

/// True if a neighbour in the scan looks past the end of a beam: it passes that end keep_m away or
/// nearer, and reaches 2 keep_m beyond.
bool looks_past(const Ray &neighbour, const Ray &ray, float keep_m)
{
    if (!(neighbour.range_m > ray.range_m + 2.0f * keep_m)) {
        return false;
    }
    const float x_m = ray.range_m * (neighbour.dir_x - ray.dir_x) + (neighbour.x_m - ray.x_m);
    const float y_m = ray.range_m * (neighbour.dir_y - ray.dir_y) + (neighbour.y_m - ray.y_m);
    return x_m * x_m + y_m * y_m <= keep_m * keep_m;
}

/// Take note of the next beam of the scan. Now both neighbours of the beam before are known: if
/// both look past its end, its hit is on something thin, or wrong.
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

void settle(gpom_map &map)
{
    if (map.keeper.group.n > 0) {
        settle_group(map);
    }
    map.keeper.n_rays = 0;
}

void consider(gpom_map &map, const Beam &beam, bool is_sure)
{
    if (!(map.config.keep_m > 0.0f)) {
        Beam kept = beam;
        keep(map, kept, kGapUnknown2_m2);
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
    group.sure |= (is_sure ? 1u : 0u) << group.n;
    group.beams[group.n++] = beam;
}

} // namespace gpom
