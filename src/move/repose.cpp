#include "gpom/repose.h"

#include "src/beams/reindex.hpp"
#include "src/map/map.hpp"
#include "src/map/store.hpp"
#include "src/move/shift.hpp"

namespace gpom
{

namespace
{

struct Corrections {
    const gpom_correction_t *all;
    size_t n;
    double origin_x_m, origin_y_m;

    const gpom_correction_t &first() const { return all[0]; }
    const gpom_correction_t &last() const { return all[n - 1]; }
};

/// The number of the last correction that is not after a time; 0 if all are after it.
size_t before(const Corrections &corrections, int64_t stamp_us)
{
    size_t low = 0;
    size_t high = corrections.n;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        (corrections.all[middle].stamp_us <= stamp_us ? low : high) = middle;
    }
    return low;
}

double turn_of(const gpom_correction_t &correction)
{
    return correction.to.yaw_rad - correction.from.yaw_rad;
}

/// How far a time is from one stamp to a later one, in [0, 1]. The difference of two stamps may
/// need 64 bits without a sign.
double fraction(int64_t stamp_us, int64_t from_us, int64_t to_us)
{
    if (stamp_us <= from_us) {
        return 0.0;
    }
    const auto since =
        static_cast<double>(static_cast<uint64_t>(stamp_us) - static_cast<uint64_t>(from_us));
    const auto whole =
        static_cast<double>(static_cast<uint64_t>(to_us) - static_cast<uint64_t>(from_us));
    return since < whole ? since / whole : 1.0;
}

double between(double from, double to, double part) { return from + part * (to - from); }

/// The motion of the beams of one time (repose.h).
Shift shift_at(const Corrections &corrections, int64_t stamp_us)
{
    const size_t i = before(corrections, stamp_us);
    const gpom_correction_t &a = corrections.all[i];
    const gpom_correction_t &b = corrections.all[i + 1 < corrections.n ? i + 1 : i];
    const double part = fraction(stamp_us, a.stamp_us, b.stamp_us);
    const double turn_rad = turn_of(a) + part * short_way(turn_of(b) - turn_of(a));
    return {between(a.from.x_m, b.from.x_m, part) - corrections.origin_x_m,
            between(a.from.y_m, b.from.y_m, part) - corrections.origin_y_m,
            between(a.to.x_m, b.to.x_m, part) - corrections.origin_x_m,
            between(a.to.y_m, b.to.y_m, part) - corrections.origin_y_m,
            direction_of(short_way(turn_rad))};
}

gpom_status_t check(const Corrections &corrections)
{
    for (size_t i = 0; i < corrections.n; ++i) {
        const gpom_correction_t &c = corrections.all[i];
        const bool rises = i == 0 || corrections.all[i - 1].stamp_us < c.stamp_us;
        if (!rises || !is_place_and_yaw(c.from) || !is_place_and_yaw(c.to)) {
            return GPOM_ERR_ARG;
        }
        const double ox_m = corrections.origin_x_m;
        const double oy_m = corrections.origin_y_m;
        if (is_in_reach(c.from.x_m - ox_m, c.from.y_m - oy_m) &&
            !is_in_reach(c.to.x_m - ox_m, c.to.y_m - oy_m)) {
            return GPOM_ERR_REACH;
        }
    }
    return GPOM_OK;
}

/// What drifted poses said against a hit no longer counts. True if the hit stands again.
bool restore(Beam &beam)
{
    if (!has_hit(beam)) {
        return false;
    }
    const bool stood = beam.hit == kStanding;
    if (is_past(beam)) { // its counts hold a time
        beam.agreed = 0;
        beam.arrived = 0;
        beam.hit_time = 0;
    }
    beam.hit = kStanding;
    beam.hit_against = 0;
    return !stood;
}

/// True if a beam's time is before a stamp. Stamps of beams are rounded down to a millisecond.
bool is_before(int64_t beam_us, int64_t stamp_us)
{
    constexpr uint64_t kRounding_us = 999;
    return beam_us<stamp_us &&static_cast<uint64_t>(stamp_us) - static_cast<uint64_t>(beam_us)>
        kRounding_us;
}

void move_beams(gpom_map &map, const Corrections &corrections, gpom_repose_report_t &report)
{
    for (uint32_t slot = 0; slot < map.index.n_slots; ++slot) {
        Beam &beam = map.index.beams[slot];
        if (!is_kept(beam)) {
            continue;
        }
        const int64_t stamp_us = map.lowres.stamp0_us + INT64_C(1000) * beam.stamp_ms;
        move(beam, shift_at(corrections, stamp_us));
        ++report.n_moved;
        report.n_before += is_before(stamp_us, corrections.first().stamp_us) ? 1u : 0u;
        report.n_after += stamp_us > corrections.last().stamp_us ? 1u : 0u;
        report.n_restored += restore(beam) ? 1u : 0u;
    }
    map.keeper.n_provisional = 0;
}

/// The robot moves like the newest scan. Windows that follow it move along.
void move_robot(gpom_map &map, const Corrections &corrections)
{
    if (map.stats.scans_inserted == 0) {
        return;
    }
    Keeper &keeper = map.keeper;
    keeper.robot = moved(keeper.robot, shift_at(corrections, keeper.stamp_us));
    lowres_follow(map.lowres, keeper.robot, keeper.stamp_us);
}

void repose(gpom_map &map, const Corrections &corrections, gpom_repose_report_t &report)
{
    report = {};
    move_beams(map, corrections, report);
    const uint32_t n_before = map.index.n_beams;
    drop_out_of_reach(map);
    report.n_forgotten = n_before - map.index.n_beams;
    map.stats.beams_forgotten += report.n_forgotten;
    restart_index(map.index);
    lowres_start_epoch(map.lowres, true);
    move_robot(map, corrections);
}

} // namespace

} // namespace gpom

gpom_status_t gpom_map_repose(gpom_map_t *map, const gpom_correction_t *corrections, size_t n,
                              gpom_repose_report_t *report)
{
    if (!gpom::is_map(map) || corrections == nullptr || n == 0) {
        return GPOM_ERR_ARG;
    }
    const gpom::Corrections all = {corrections, n, map->config.origin_x_m, map->config.origin_y_m};
    const gpom_status_t status = gpom::check(all);
    if (status != GPOM_OK) {
        return status;
    }
    gpom_repose_report_t ignored;
    gpom::repose(*map, all, report != nullptr ? *report : ignored);
    return GPOM_OK;
}
