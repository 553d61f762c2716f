#include "gpom/exchange.h"

#include "src/insert/evict.hpp"
#include "src/insert/forget.hpp"
#include "src/map/near_hits.hpp"
#include "src/map/origin.hpp"
#include "src/map/store.hpp"
#include "src/move/shift.hpp"

namespace gpom
{

namespace
{

bool is_in(const gpom_disc_t &disc, double x_m, double y_m)
{
    const double dx_m = x_m - disc.x_m;
    const double dy_m = y_m - disc.y_m;
    return dx_m * dx_m + dy_m * dy_m <= disc.radius_m * disc.radius_m;
}

bool starts_or_ends_in(const gpom_disc_t &disc, const gpom_beam_t &beam)
{
    const auto range_m = static_cast<double>(beam.range_m);
    return is_in(disc, beam.x_m, beam.y_m) ||
           is_in(disc, beam.x_m + range_m * static_cast<double>(beam.dir_x),
                 beam.y_m + range_m * static_cast<double>(beam.dir_y));
}

bool are_flags(const gpom_beam_t &beam)
{
    const bool are_bits = (beam.is_hit | beam.is_free | beam.returned | beam.provisional |
                           beam.past | beam.arrived) <= 1;
    const bool has_part = beam.is_hit != 0 || beam.is_free != 0;
    const bool hit_returned = beam.is_hit == 0 || beam.returned != 0;
    const bool is_one_state = beam.provisional == 0 || beam.past == 0;
    const bool is_of_hit = beam.is_hit != 0 || (beam.provisional == 0 && beam.past == 0);
    return are_bits && has_part && hit_returned && is_one_state && is_of_hit &&
           beam.n_agreed <= kAgreedMax && beam.n_against <= 3;
}

bool is_whole(const gpom_beam_t &beam)
{
    const float length2 = beam.dir_x * beam.dir_x + beam.dir_y * beam.dir_y;
    return is_within(beam.x_m, GPOM_PLACE_MAX_M) && is_within(beam.y_m, GPOM_PLACE_MAX_M) &&
           is_between(length2, 1.0f - 1e-5f, 1.0f + 1e-5f) && beam.range_m > 0.0f &&
           beam.range_m <= static_cast<float>(GPOM_REACH_M) &&
           is_between(beam.excess, 0.0f, kExcessMax) && are_flags(beam);
}

HitState state_of(const gpom_beam_t &beam)
{
    if (beam.is_hit == 0) {
        return kNoHit;
    }
    if (beam.past != 0) {
        return kPast;
    }
    return beam.provisional != 0 ? kProvisional : kStanding;
}

/// The frames of an import: a shift between places relative to the pose `from` and places relative
/// to the origin.
struct Import {
    gpom_map &map;
    Shift shift;
    double from_x_m, from_y_m; ///< In the frame of the other map.
    gpom_import_report_t &report;
};

/// The beam as this map keeps it.
Beam taken(const Import &import, const gpom_beam_t &from)
{
    const gpom_map &map = import.map;
    Beam beam = {};
    beam.x_m = static_cast<float>(from.x_m - import.from_x_m);
    beam.y_m = static_cast<float>(from.y_m - import.from_y_m);
    beam.dir_x = from.dir_x;
    beam.dir_y = from.dir_y;
    move(beam, import.shift);
    beam.range_m = from.range_m;
    beam.excess = from.excess;
    beam.stamp_ms = milliseconds_since(map.lowres.stamp0_us, from.stamp_us);
    beam.scan = static_cast<uint16_t>((from.scan + map.stats.scans_inserted) & 0xffffu);
    beam.returned = from.returned != 0 ? 1u : 0u;
    beam.has_free = from.is_free != 0 ? 1u : 0u;
    beam.hit = state_of(from) & 3u;
    if (is_past(beam)) {
        set_past(beam, map.keeper.time_number - 1);
    } else {
        beam.agreed = from.n_agreed & 15u;
        beam.hit_against = from.n_against & 3u;
        beam.arrived = from.arrived & 1u;
    }
    return beam;
}

/// The kept hit that stands or waits within keep_m of a hit that stands, or kNoSlot.
uint32_t same_hit(gpom_map &map, const Beam &beam, const NearHits &near)
{
    const float keep2_m2 = map.config.keep_m * map.config.keep_m;
    const bool is_same = beam.hit == kStanding && near.best[0].d2 < keep2_m2;
    return is_same ? static_cast<uint32_t>(near.best[0].slot) : kNoSlot;
}

void add_counts(gpom_map &map, Beam &kept, const Beam &beam)
{
    const uint32_t both = uint32_t{kept.agreed} + beam.agreed + 1;
    set_agreed(map, kept, both < kAgreedMax ? both : kAgreedMax);
    make_standing(map, kept);
    kept.hit_against = 0;
}

/// Keep a beam if there is room, or a less useful beam.
void keep(const Import &import, const Beam &beam, float gap2_m2)
{
    gpom_map &map = import.map;
    if (map.index.next_id == kIdEnd) {
        ++map.stats.beams_ids_spent;
        ++import.report.n_not_useful;
    } else if (!make_room(map, beam, gap2_m2)) {
        ++import.report.n_not_useful;
    } else {
        put_beam(map, beam);
        ++import.report.n_kept;
    }
}

/// Keep a beam, or give its counts to a hit that is there.
void merge(const Import &import, Beam &beam)
{
    gpom_map &map = import.map;
    const bool is_live = map.config.keep_m > 0.0f;
    if (!is_live || !has_hit(beam)) {
        keep(import, beam, kGapUnknown2_m2);
        return;
    }
    if (is_past(beam) && is_near_past(map, end_of(beam))) {
        beam.hit = kNoHit;
    }
    const NearHits near = near_hits(map, {end_of(beam), alone2_of(map), 0.0f});
    const uint32_t slot = same_hit(map, beam, near);
    if (slot != kNoSlot) {
        add_counts(map, map.index.beams[slot], beam);
        ++import.report.n_known;
    } else if (!is_kept(beam)) {
        ++import.report.n_known;
    } else {
        keep(import, beam, near.best[0].d2);
    }
}

void take(const Import &import, const gpom_beam_t &from)
{
    if (!is_whole(from)) {
        ++import.report.n_damaged;
        return;
    }
    Beam beam = taken(import, from);
    const auto x_m = static_cast<double>(beam.x_m);
    const auto y_m = static_cast<double>(beam.y_m);
    if (!is_in_reach(x_m, y_m)) {
        ++import.report.n_out_of_reach;
        return;
    }
    merge(import, beam);
}

/// The oldest stamp of whole beams, or the given one.
int64_t oldest_of(const gpom_beam_t *beams, size_t n, int64_t oldest_us)
{
    for (size_t i = 0; i < n; ++i) {
        if (is_whole(beams[i]) && beams[i].stamp_us < oldest_us) {
            oldest_us = beams[i].stamp_us;
        }
    }
    return oldest_us;
}

Import import_of(gpom_map &map, const gpom_frames_t *frames, gpom_import_report_t &report)
{
    const gpom_point_t at = {map.config.origin_x_m, map.config.origin_y_m};
    if (frames == nullptr) { // about the origin, so that nothing is lost to rounding
        return {map, {0.0, 0.0, 0.0, 0.0, {1.0f, 0.0f}}, at.x_m, at.y_m, report};
    }
    const gpom_pose_t &to = frames->to;
    const Direction turn = direction_of(short_way(to.yaw_rad - frames->from.yaw_rad));
    return {map,
            {0.0, 0.0, to.x_m - at.x_m, to.y_m - at.y_m, turn},
            frames->from.x_m,
            frames->from.y_m,
            report};
}

} // namespace

} // namespace gpom

gpom_status_t gpom_map_export_beams(const gpom_map_t *map, gpom_export_t *progress,
                                    gpom_beam_t *beams, size_t beam_max)
{
    if (!gpom::is_map(map) || progress == nullptr || beams == nullptr || beam_max == 0 ||
        (progress->disc != nullptr && !gpom::is_disc(progress->disc))) {
        return GPOM_ERR_ARG;
    }
    uint32_t &n = progress->n;
    n = 0;
    for (; progress->i_slot < map->index.n_slots && n < beam_max; ++progress->i_slot) {
        if (!is_kept(map->index.beams[progress->i_slot])) {
            continue;
        }
        const gpom_status_t status = gpom_map_beam(map, progress->i_slot, &beams[n]);
        if (status != GPOM_OK) {
            return status;
        }
        const bool is_wanted =
            progress->disc == nullptr || gpom::starts_or_ends_in(*progress->disc, beams[n]);
        n += is_wanted ? 1u : 0u;
    }
    return GPOM_OK;
}

gpom_status_t gpom_map_import_beams(gpom_map_t *map, const gpom_beam_t *beams, size_t n,
                                    const gpom_frames_t *frames, gpom_import_report_t *report)
{
    const bool are_frames = frames == nullptr || (gpom::is_place_and_yaw(frames->from) &&
                                                  gpom::is_place_and_yaw(frames->to));
    if (!gpom::is_map(map) || (beams == nullptr && n > 0) || !are_frames) {
        return GPOM_ERR_ARG;
    }
    gpom_import_report_t ignored;
    gpom_import_report_t &counts = report != nullptr ? *report : ignored;
    counts = {};
    gpom::reach_back(*map, gpom::oldest_of(beams, n, INT64_MAX));
    const gpom::Import import = gpom::import_of(*map, frames, counts);
    for (size_t i = 0; i < n; ++i) {
        gpom::take(import, beams[i]);
    }
    gpom::lowres_count_change(map->lowres);
    return GPOM_OK;
}
