#include "src/insert/forget.hpp"

#include "src/base/check.hpp"
#include "src/map/map.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// The part of a beam's line inside a disc, as distances along the beam. If enter_m < leave_m does
/// not hold, the line does not cross the disc.
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

/// End a beam where it enters a disc. The free segment before the disc stays. If nothing before the
/// disc is free, the beam is dropped.
void cut_end(gpom_map &map, uint32_t slot, float enter_m)
{
    const Beam &beam = map.index.beams[slot];
    const float free_m = lane::min(enter_m, map.index.free_part(beam).length_m);
    if (beam.has_free == 0 || !(free_m > 0.0f)) {
        drop_beam(map, slot);
        return;
    }
    end_beam(map, slot, free_m);
}

/// Let a beam start where it leaves a disc. If nothing behind the disc is free, only its hit stays.
void cut_start(gpom_map &map, uint32_t slot, float leave_m)
{
    const Beam &beam = map.index.beams[slot];
    if (!(leave_m < map.index.free_part(beam).length_m)) {
        drop_free(map, slot);
        return;
    }
    start_beam(map, slot, leave_m);
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

} // namespace

bool is_disc(const gpom_disc_t *disc)
{
    return disc != nullptr && is_finite(disc->x_m) && is_finite(disc->y_m) &&
           disc->radius_m > 0.0 && disc->radius_m <= 2.0 * GPOM_REACH_M;
}

void forget_disc(gpom_map &map, const gpom_disc_t &disc)
{
    const double dx_m = disc.x_m - map.config.origin_x_m;
    const double dy_m = disc.y_m - map.config.origin_y_m;
    const double far_m = 4.0 * GPOM_REACH_M; // a disc farther away touches no beam
    if (!is_within(dx_m, far_m) || !is_within(dy_m, far_m)) {
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

} // namespace gpom
