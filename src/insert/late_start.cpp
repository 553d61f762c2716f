#include "src/insert/late_start.hpp"

#include "gpom/live.h"
#include "src/base/check.hpp"
#include "src/map/map.hpp"

namespace gpom
{

namespace
{

/// A cell of a beam's way is crowded if this many kept free segments pass it.
constexpr uint32_t kCrowd = 2;

/// The last cells of a free segment are always kept: what is free just before a hit decides where
/// the map puts the surface.
constexpr float kLastCells = 12.0f;

/// A hit nearer to its beam's start than two keep_m refuses no beams (witness.cpp). A late start
/// must not turn a hit into such a hit.
constexpr float kLastSpacings = 2.0f;

/// Cells that are looked at in one traversal: one bit each.
constexpr uint32_t kStretchCells = 32;

/// A way that is not crowded within this many stretches starts at the sensor.
constexpr uint32_t kStretchesMax = 64;

/// Directions whose sine is less than this count as parallel.
constexpr float kParallel = 1e-6f;

/// Distances along a way. Empty if first_m > last_m.
struct Interval {
    float first_m, last_m;
};

/// The numbers t for which a + b t is between `low` and `high`.
Interval where_between(float a, float b, float low, float high)
{
    if (lane::abs(b) < kParallel) {
        return a >= low && a <= high ? Interval{-FLT_MAX, FLT_MAX} : Interval{1.0f, 0.0f};
    }
    const float at_low = (low - a) / b;
    const float at_high = (high - a) / b;
    return {lane::min(at_low, at_high), lane::max(at_low, at_high)};
}

/// Where a way runs beside another segment: nearer than reach_m, and not beyond the segment's ends.
Interval beside(const Segment &way, const Segment &other, float reach_m)
{
    const float x_m = way.x_m - other.x_m;
    const float y_m = way.y_m - other.y_m;
    const Interval near =
        where_between(other.dir_x * y_m - other.dir_y * x_m,
                      other.dir_x * way.dir_y - other.dir_y * way.dir_x, -reach_m, reach_m);
    const Interval along =
        where_between(x_m * other.dir_x + y_m * other.dir_y,
                      way.dir_x * other.dir_x + way.dir_y * other.dir_y, 0.0f, other.length_m);
    return {lane::max(near.first_m, along.first_m), lane::min(near.last_m, along.last_m)};
}

/// Bits of the cells of a stretch whose centres come before way_m.
uint32_t cells_before(float way_m, float cell_m)
{
    const auto n = static_cast<uint32_t>(
        lane::clamp(way_m / cell_m + 0.5f, 0.0f, static_cast<float>(kStretchCells)));
    return n < kStretchCells ? (1u << n) - 1u : UINT32_MAX;
}

/// Bits of the crowded cells of a stretch. Cell i is the i-th from the start of `way`.
uint32_t crowded_cells(gpom_map &map, const Segment &way, float cell_m)
{
    const float reach_m = 0.5f * cell_m;
    Box box_of_way = empty_box();
    include(box_of_way, way);
    const Area around(widened(box_of_way, reach_m));
    uint32_t n_least[kCrowd] = {}; // bit i of n_least[n]: more than n segments pass cell i
    traverse(
        map.index, map.index.free_part, {map.keeper.inner_stack, map.index.next_id},
        [&](const Box &box) { return around.touches(box); },
        [&](uint32_t slot) {
            const Segment other = map.index.free_part(map.index.beams[slot]);
            const Interval passes = beside(way, other, reach_m);
            const uint32_t cells =
                cells_before(passes.last_m, cell_m) & ~cells_before(passes.first_m, cell_m);
            for (uint32_t n = kCrowd - 1; n > 0; --n) {
                n_least[n] |= n_least[n - 1] & cells;
            }
            n_least[0] |= cells;
            return true;
        });
    return n_least[kCrowd - 1];
}

/// Length of a free segment from its end back to the first crowded cell.
float uncrowded_m(gpom_map &map, const Segment &free)
{
    const float cell_m = map.keeper.late_m;
    const float stretch_m = static_cast<float>(kStretchCells) * cell_m;
    const Point end = end_of(free);
    for (uint32_t i = 0; i < kStretchesMax; ++i) {
        const float from_m = static_cast<float>(i) * stretch_m;
        if (!(from_m + cell_m <= free.length_m)) {
            break;
        }
        const Segment way = {end.x_m - from_m * free.dir_x, end.y_m - from_m * free.dir_y,
                             -free.dir_x, -free.dir_y,
                             lane::min(stretch_m, free.length_m - from_m)};
        const uint32_t crowded =
            crowded_cells(map, way, cell_m) & cells_before(way.length_m - 0.5f * cell_m, cell_m);
        if (crowded != 0) {
            return from_m + static_cast<float>(__builtin_ctz(crowded)) * cell_m;
        }
    }
    return free.length_m;
}

} // namespace

void begin_late(gpom_map &map, Beam &beam)
{
    if (beam.has_free == 0) {
        return;
    }
    const Segment free = map.index.free_part(beam);
    const float last_m =
        lane::max(kLastCells * map.keeper.late_m, kLastSpacings * map.config.keep_m);
    if (free.length_m > last_m) {
        advance_start(beam, free.length_m - lane::max(uncrowded_m(map, free), last_m));
    }
}

} // namespace gpom

gpom_status_t gpom_map_begin_late(gpom_map_t *map, float late_m)
{
    const bool is_on = late_m >= 1e-3f && late_m <= 1e3f;
    if (!gpom::is_map(map) || !(is_on || late_m == 0.0f)) {
        return GPOM_ERR_ARG;
    }
    map->keeper.late_m = late_m;
    map->keeper.begin_late = is_on ? gpom::begin_late : nullptr;
    return GPOM_OK;
}
