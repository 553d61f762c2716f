#include "src/map/origin.hpp"

#include "gpom/live.h"
#include "src/map/map.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// Rounded towards zero. 32 bits are enough, because places are within GPOM_PLACE_MAX_M. They are
/// used because a Cortex-M converts 64-bit integers to double in software.
double whole_metres(double offset_m) { return static_cast<double>(static_cast<int32_t>(offset_m)); }

/// Half of the span of stamps.
constexpr int64_t kHalf_us = INT64_C(1000) << 31;

/// Set stamp0_us. The stamps of beams and cells shift.
void move_stamp0(gpom_map &map, int64_t from_us)
{
    const int64_t stamp0_us = map.lowres.stamp0_us;
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

/// True if the newest scan and the next scan, of stamp_us, are both outside of the span of stamps
/// on the same side. Before the span: the newest is before stamp0_us, and the next is more than
/// kSetBack_ms before stamp0_us. After the span: both are 2^32 - 1 ms or more after stamp0_us.
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
    move_stamp0(map, stamp_us > INT64_MIN + kHalf_us ? stamp_us - kHalf_us : INT64_MIN);
}

void reach_back(gpom_map &map, int64_t stamp_us)
{
    if (stamp_us == INT64_MAX) {
        return;
    }
    lowres_start_clock(map.lowres, stamp_us);
    const int64_t stamp0_us = map.lowres.stamp0_us;
    if (stamp_us < stamp0_us && milliseconds_since(stamp_us, stamp0_us) < kHalf_us / 1000) {
        move_stamp0(map, stamp_us);
        map.keeper.stamp_ms = milliseconds_since(stamp_us, map.keeper.stamp_us);
    }
}

} // namespace gpom

gpom_status_t gpom_map_origin(const gpom_map_t *map, gpom_point_t *origin)
{
    if (!gpom::is_map(map) || origin == nullptr) {
        return GPOM_ERR_ARG;
    }
    *origin = {map->config.origin_x_m, map->config.origin_y_m};
    return GPOM_OK;
}
