#include "gpom/live.h"

#include "src/insert/origin.hpp"
#include "src/map/map.hpp"
#include "src/query/hot_path.hpp"

#include <float.h>

namespace gpom
{

namespace
{

/// The part of a beam inside a disc: distances along it, enter < leave; none if they are not.
struct Chord {
    float enter_m, leave_m;
};

Chord chord_of(const Beam &beam, const Point &centre, float radius_m)
{
    const float from_x = centre.x_m - beam.x_m;
    const float from_y = centre.y_m - beam.y_m;
    const float along = from_x * beam.dir_x + from_y * beam.dir_y;
    const float across = from_x * beam.dir_y - from_y * beam.dir_x;
    const float half2 = radius_m * radius_m - across * across;
    if (!(half2 > 0.0f)) {
        return {0.0f, 0.0f};
    }
    const float half = lane::sqrt(half2);
    return {along - half, along + half};
}

/// End a beam before a disc: what it tells of the way there stays, no more than was free.
void cut_end(gpom_map &map, uint32_t slot, float enter_m)
{
    Beam &beam = map.index.beams[slot];
    const float free_m = lane::min(enter_m, map.index.free_part(beam).length_m);
    if (beam.has_free == 0 || !(free_m > 0.0f)) {
        drop_beam(map, slot);
        return;
    }
    mark_beam(map, beam);
    beam.range_m = free_m;
    beam.returned = 0;
    if (has_hit(beam)) {
        remove_hit(map.index, slot);
    }
}

/// Begin a beam behind a disc; its hit alone stays where nothing free is left.
void cut_start(gpom_map &map, uint32_t slot, float leave_m)
{
    Beam &beam = map.index.beams[slot];
    if (!(leave_m < map.index.free_part(beam).length_m)) {
        drop_free(map, slot);
        return;
    }
    mark_beam(map, beam);
    beam.x_m += leave_m * beam.dir_x;
    beam.y_m += leave_m * beam.dir_y;
    beam.range_m -= leave_m;
}

void forget_in_disc(gpom_map &map, uint32_t slot, const Point &centre, float radius_m)
{
    const Beam &beam = map.index.beams[slot];
    const Chord inside = chord_of(beam, centre, radius_m);
    const bool is_apart = !(inside.enter_m < inside.leave_m) || inside.leave_m <= 0.0f ||
                          inside.enter_m > beam.range_m;
    if (is_apart) {
        return;
    }
    const bool ends_behind = inside.leave_m < beam.range_m;
    if (!ends_behind || !has_hit(beam)) {
        cut_end(map, slot, inside.enter_m);
    } else if (beam.has_free != 0) {
        cut_start(map, slot, inside.leave_m);
    }
}

bool is_disc(const gpom_disc_t *disc)
{
    return disc != nullptr && disc->x_m >= -DBL_MAX && disc->x_m <= DBL_MAX &&
           disc->y_m >= -DBL_MAX && disc->y_m <= DBL_MAX && disc->radius_m > 0.0 &&
           disc->radius_m <= 2.0 * GPOM_REACH_M;
}

void forget_disc(gpom_map &map, const gpom_disc_t &disc)
{
    const double dx_m = disc.x_m - map.config.origin_x_m;
    const double dy_m = disc.y_m - map.config.origin_y_m;
    const double far_m = 4.0 * GPOM_REACH_M; // no beam is there
    if (!(dx_m >= -far_m && dx_m <= far_m && dy_m >= -far_m && dy_m <= far_m)) {
        return;
    }
    const Point centre = {static_cast<float>(dx_m), static_cast<float>(dy_m)};
    const auto radius_m = static_cast<float>(disc.radius_m);
    const uint32_t n_before = map.index.n_beams;
    for (uint32_t slot = 0; slot < map.index.n_slots; ++slot) {
        if (is_kept(map.index.beams[slot])) {
            forget_in_disc(map, slot, centre, radius_m);
        }
    }
    map.stats.beams_forgotten += n_before - map.index.n_beams;
    lowres_count_change(map.lowres);
}

uint64_t build_slice(gpom_map &map, uint64_t budget)
{
    const uint64_t n_items = budget / GPOM_INDEX_ITEM_OPS;
    const auto n = static_cast<uint32_t>(n_items < UINT32_MAX ? n_items : UINT32_MAX);
    return uint64_t{GPOM_INDEX_ITEM_OPS} * build_some(map.index, n);
}

/// Towards zero. 32 bits hold it, as places are within GPOM_PLACE_MAX_M: 64 bits to double is
/// software on a Cortex-M.
double whole_metres(double offset_m) { return static_cast<double>(static_cast<int32_t>(offset_m)); }

void drop_out_of_reach(gpom_map &map)
{
    constexpr auto reach_m = static_cast<float>(GPOM_REACH_M);
    for (uint32_t slot = 0; slot < map.index.n_slots; ++slot) {
        const Beam &beam = map.index.beams[slot];
        if (is_kept(beam) && beam.x_m * beam.x_m + beam.y_m * beam.y_m > reach_m * reach_m) {
            remove_beam(map.index, slot);
        }
    }
}

/// True if the newest scan and the next, of stamp_us, both lie on the same side of the time that is
/// counted from stamp0_us on.
bool is_out_of_span(const gpom_map &map, int64_t stamp_us)
{
    const Keeper &newest = map.keeper;
    const int64_t stamp0_us = map.lowres.stamp0_us;
    if (newest.stamp_us < stamp0_us) {
        return milliseconds_since(stamp_us, stamp0_us) > kSetBack_ms;
    }
    return newest.stamp_ms == UINT32_MAX && milliseconds_since(stamp0_us, stamp_us) == UINT32_MAX;
}

} // namespace

Eigen::Vector2d origin_step(const gpom_map &map, double x_m, double y_m)
{
    const double from_x = x_m - map.config.origin_x_m;
    const double from_y = y_m - map.config.origin_y_m;
    const double rebase_m = static_cast<double>(map.config.rebase_m);
    if (!(rebase_m > 0.0) || !(from_x * from_x + from_y * from_y > rebase_m * rebase_m)) {
        return {0.0, 0.0};
    }
    return {whole_metres(from_x), whole_metres(from_y)};
}

bool note_out_of_reach(gpom_map &map, const Eigen::Vector2d &step_m)
{
    constexpr auto reach_m = static_cast<float>(GPOM_REACH_M);
    const Eigen::Vector2f place_m = step_m.cast<float>();
    const Eigen::Vector2f from_m = place_m - Eigen::Vector2f(map.refused.x_m, map.refused.y_m);
    const bool is_near = from_m.squaredNorm() <= reach_m * reach_m;
    map.refused = {place_m.x(), place_m.y()};
    map.n_refused = is_near ? map.n_refused + 1 : 1;
    return map.n_refused >= kBelieved;
}

void move_origin(gpom_map &map, const Eigen::Vector2d &step_m)
{
    map.n_refused = 0;
    const double dx_m = step_m.x();
    const double dy_m = step_m.y();
    if (dx_m == 0.0 && dy_m == 0.0) {
        return;
    }
    const uint32_t n_before = map.index.n_beams;
    if (n_before == 0) {
        drop_all(map);
    } else {
        shift_origin(map.index, static_cast<float>(dx_m), static_cast<float>(dy_m));
        drop_out_of_reach(map);
    }
    const uint32_t n_gone = n_before - map.index.n_beams;
    map.stats.beams_forgotten += n_gone;
    map.config.origin_x_m += dx_m;
    map.config.origin_y_m += dy_m;
    lowres_rebase(map.lowres, dx_m, dy_m);
    if (n_gone > 0) {
        lowres_mark_all(map.lowres);
    }
}

void follow_clock(gpom_map &map, int64_t stamp_us)
{
    if (!is_out_of_span(map, stamp_us)) {
        return;
    }
    const int64_t stamp0_us = map.lowres.stamp0_us;
    constexpr int64_t kHalf_us = INT64_C(1000) << 31;
    const int64_t from_us = stamp_us > INT64_MIN + kHalf_us ? stamp_us - kHalf_us : INT64_MIN;
    const StampShift shift = {milliseconds_since(from_us, stamp0_us),
                              milliseconds_since(stamp0_us, from_us)};
    for (uint32_t slot = 0; slot < map.index.n_slots; ++slot) {
        Beam &beam = map.index.beams[slot];
        if (is_kept(beam)) {
            beam.stamp_ms = shift(beam.stamp_ms);
        }
    }
    lowres_move_stamp0(map.lowres, from_us, shift);
}

} // namespace gpom

gpom_status_t gpom_map_step(gpom_map_t *map, uint64_t budget, const gpom_scratch_t *scratch,
                            uint64_t *used)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = scratch == nullptr ? GPOM_OK : gpom::check_scratch(*map, *scratch);
    if (status != GPOM_OK) {
        return status;
    }
    const bool is_dirty = scratch != nullptr && gpom::has_dirty_cells(map->lowres);
    uint64_t done = gpom::build_slice(*map, is_dirty ? budget / 2 : budget);
    if (scratch != nullptr) {
        done += gpom::lowres_step(*map, *scratch, budget - done);
        done += gpom::build_slice(*map, budget - done);
    }
    if (used != nullptr) {
        *used = done;
    }
    return GPOM_OK;
}

gpom_status_t gpom_map_forget(gpom_map_t *map, const gpom_disc_t *disc)
{
    if (!gpom::is_map(map) || !gpom::is_disc(disc)) {
        return GPOM_ERR_ARG;
    }
    gpom::forget_disc(*map, *disc);
    return GPOM_OK;
}

gpom_status_t gpom_map_jump(gpom_map_t *map, gpom_jump_t rule, const gpom_disc_t *disc)
{
    const bool is_known = rule == GPOM_JUMP_KEEP || rule == GPOM_JUMP_CLEAR ||
                          (rule == GPOM_JUMP_FORGET && gpom::is_disc(disc));
    if (!gpom::is_map(map) || !is_known) {
        return GPOM_ERR_ARG;
    }
    const bool clears = rule == GPOM_JUMP_CLEAR;
    gpom::lowres_start_epoch(map->lowres, clears);
    if (clears) {
        gpom::drop_all(*map);
    } else if (rule == GPOM_JUMP_FORGET) {
        gpom::forget_disc(*map, *disc);
    }
    return GPOM_OK;
}

gpom_status_t gpom_map_origin(const gpom_map_t *map, gpom_point_t *origin)
{
    if (!gpom::is_map(map) || origin == nullptr) {
        return GPOM_ERR_ARG;
    }
    *origin = {map->config.origin_x_m, map->config.origin_y_m};
    return GPOM_OK;
}
