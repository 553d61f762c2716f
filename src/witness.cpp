#include "src/witness.hpp"

#include "src/known_free.hpp"
#include "src/map.hpp"
#include "src/workspace.hpp"

namespace gpom
{

namespace
{

/// Counts at which a hit that arrived where the place was free has settled.
constexpr uint32_t kArrivedCounts = 3;

/// Lane vectors that a group fills.
constexpr uint32_t kVectors = kGroup / static_cast<uint32_t>(kLanes);

/// kLanes new beams of a group, all from one place. Lanes beyond its last beam have no length and
/// speak of nothing.
struct BeamLanes {
    F dir_x, dir_y, length_m;
    F returned; ///< 1: it ends at a surface.
    F sure;
};

BeamLanes lanes_of(const Group &group, uint32_t i_vector)
{
    const F zero = lane::splat<F>(0.0f);
    BeamLanes lanes = {zero, zero, zero, zero, zero};
    for (int i = 0; i < kLanes; ++i) {
        const uint32_t i_beam = i_vector * static_cast<uint32_t>(kLanes) + static_cast<uint32_t>(i);
        if (i_beam < group.n) {
            const Beam &beam = group.beams[i_beam];
            lane::set(lanes.dir_x, i, beam.dir_x);
            lane::set(lanes.dir_y, i, beam.dir_y);
            lane::set(lanes.length_m, i, beam.range_m);
            lane::set(lanes.returned, i, beam.returned != 0 ? 1.0f : 0.0f);
            lane::set(lanes.sure, i, (group.sure >> i_beam & 1u) != 0 ? 1.0f : 0.0f);
        }
    }
    return lanes;
}

/// True if one of the beams from a sensor comes within reach_m of the box: projections on the beam
/// and across it.
bool touches(const Point &sensor, const BeamLanes &s, const Box &box, float reach_m)
{
    const float from_x = 0.5f * (box.x_min_m + box.x_max_m) - sensor.x_m;
    const float from_y = 0.5f * (box.y_min_m + box.y_max_m) - sensor.y_m;
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
    Box box;      ///< Around all its beams, keep_m wider.
    Point sensor; ///< Where they start.
    BeamLanes lanes[kVectors];
};

bool is_inside(const Box &box, const Point &p)
{
    return p.x_m >= box.x_min_m && p.x_m <= box.x_max_m && p.y_m >= box.y_min_m &&
           p.y_m <= box.y_max_m;
}

/// Compare a hit with kLanes beams of the group.
Witnesses witnesses_of(const Trial &trial, uint32_t i_vector, const Point &at)
{
    const float keep_m = trial.map.config.keep_m;
    const BeamLanes &s = trial.lanes[i_vector];
    const float from_x = at.x_m - trial.sensor.x_m;
    const float from_y = at.y_m - trial.sensor.y_m;
    const F across = lane::abs(F(from_x * s.dir_y - from_y * s.dir_x));
    if (!lane::any(across < keep_m)) {
        return {0, 0};
    }
    const F along = from_x * s.dir_x + from_y * s.dir_y;
    const F to_go = s.length_m - along;
    const F gap2 = across * across + to_go * to_go;
    const F width = lane::min(F(kPass.slope * to_go), lane::splat<F>(kPass.width * keep_m));
    const auto ends = (s.returned > 0.0f) & (gap2 < keep_m * keep_m);
    const auto passes = (s.sure > 0.0f) & (along > 0.0f) & (to_go > keep_m) & (across < width);
    return {lane::bits_of_mask(ends), lane::bits_of_mask(passes)};
}

Witnesses witnesses_of(const Trial &trial, const Point &at)
{
    Witnesses all = {0, 0};
    for (uint32_t v = 0; v < kVectors; ++v) {
        const Witnesses some = witnesses_of(trial, v, at);
        all.ends |= some.ends << (v * static_cast<uint32_t>(kLanes));
        all.passes |= some.passes << (v * static_cast<uint32_t>(kLanes));
    }
    return all;
}

/// A scan saw the hit again: one count more if at another time, and whoever saw through it erred.
/// One that is provisional goes on waiting if the time is its own. One that arrived takes the place
/// from the free segments when it ceases to be provisional, and again with its last count needed.
void confirm(gpom_map &map, Beam &beam)
{
    const uint16_t time = map.keeper.time_mark;
    const bool is_own_time = beam.stamp_ms == map.keeper.stamp_ms && beam.hit_time == time;
    const bool was_provisional = beam.provisional != 0;
    if (was_provisional && is_own_time) {
        return;
    }
    const bool is_counted = !was_provisional && beam.agreed < kAgreedMax &&
                            !(beam.hit_against == 0 && beam.hit_time == time);
    beam.agreed = (beam.agreed + (is_counted ? 1u : 0u)) & kAgreedMax;
    beam.provisional = 0;
    beam.hit_against = 0;
    beam.hit_time = time & kTimeMarkMask;
    if (was_provisional) {
        mark_beam(map, beam);
    }
    if (beam.arrived != 0 && (was_provisional || (is_counted && beam.agreed == kArrivedCounts))) {
        clear_free(map, beam);
    }
}

/// Let beams that end at a hit stand for it should it have no free segment; one that ends at
/// several stands for the oldest.
void offer_renewal(gpom_map &map, uint32_t ends, uint32_t slot)
{
    Group &group = map.keeper.group;
    const Beam *const beams = map.index.beams;
    for (uint32_t i = 0; i < group.n; ++i) {
        const uint32_t other = group.renews[i];
        if ((ends >> i & 1u) != 0 && (other == kNoSlot || beams[slot].id < beams[other].id)) {
            group.renews[i] = slot;
        }
    }
}

/// A scan saw through a hit: the first in a row takes one count, the next two, four, eight, so
/// that five in a row outweigh any number that saw it before. True if it is gone: the counts are
/// used up and enough scans were in the row. One that is provisional goes at once; one that was
/// confirmed at this very time stays as it is.
bool contradict(gpom_map &map, uint32_t slot)
{
    Beam &beam = map.index.beams[slot];
    if (beam.provisional != 0) {
        drop_beam(map, slot);
        ++map.stats.beams_not_confirmed;
        return true;
    }
    if (beam.hit_time == map.keeper.time_mark) {
        return false;
    }
    beam.hit_time = map.keeper.time_mark & kTimeMarkMask;
    const uint32_t in_row = beam.hit_against;
    const uint32_t counts = 1u << in_row;
    if (beam.agreed < counts && in_row + 1u >= map.config.clear_scans) {
        drop_hit(map, slot);
        ++map.stats.hits_cleared;
        return true;
    }
    beam.agreed = (beam.agreed > counts ? beam.agreed - counts : 0u) & kAgreedMax;
    beam.hit_against = (in_row < 3 ? in_row + 1u : 3u) & 3u;
    return false;
}

/// Let the group's beams speak for or against one kept hit; one of their own scan only makes their
/// returns known.
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
    const Witnesses witnesses = witnesses_of(trial, at);
    group.known |= witnesses.ends;
    if (beam.id >= map.keeper.scan_first_id) {
        return;
    }
    if (witnesses.passes != 0) { // so nothing stands there that would hide what is behind
        beam.arrived = 0;
    }
    if (witnesses.ends != 0) {
        confirm(map, beam);
        offer_renewal(map, witnesses.ends, slot);
    } else if (witnesses.passes != 0 && map.config.clear_scans > 0) {
        const bool gone = contradict(map, slot);
        group.clearing |= gone && !was_provisional ? witnesses.passes : 0u;
        group.against |= gone ? 0u : witnesses.passes;
    }
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

} // namespace

/// Compare all kept hits near a group's beams with them.
void judge(gpom_map &map)
{
    Group &group = map.keeper.group;
    const Point sensor = {group.beams[0].x_m, group.beams[0].y_m};
    Trial trial = {map, box_around(group, map.config.keep_m), sensor, {}};
    for (uint32_t v = 0; v < kVectors; ++v) {
        trial.lanes[v] = lanes_of(group, v);
    }
    const auto touches_any = [&](const Box &box) {
        if (!are_near(box, trial.box, 0.0f)) {
            return false;
        }
        for (uint32_t v = 0; v < kVectors; ++v) {
            if (touches(trial.sensor, trial.lanes[v], box, map.config.keep_m)) {
                return true;
            }
        }
        return false;
    };
    walk(map.index, map.index.hit_part, map.keeper.hit_stack, touches_any,
         [&](uint32_t slot) { judge_hit(trial, slot); });
}

} // namespace gpom
