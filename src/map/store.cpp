#include "src/map/store.hpp"

#include "src/map/map.hpp"
#include "src/map/near_hits.hpp"

namespace gpom
{

namespace
{

/// The cells in reach of a beam become dirty.
void mark_beam(gpom_map &map, const Beam &beam)
{
    const float length_m = beam.range_m + map.config.params.depth_m;
    const Segment whole = {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, length_m};
    lowres_mark_segment(map.lowres, {beam.x_m, beam.y_m}, end_of(whole), map.lowres.reach_m);
}

/// The cells in reach of a beam's hit become dirty.
void mark_hit(gpom_map &map, const Beam &beam)
{
    const Segment part = map.index.hit_part(beam);
    lowres_mark_segment(map.lowres, end_of(beam), end_of(part), map.lowres.reach_m);
}

/// Enter a provisional beam into the ring.
void enter_provisional(gpom_map &map, uint32_t slot)
{
    Keeper &keeper = map.keeper;
    Waiting &entry = keeper.provisional[keeper.n_provisional % keeper.provisional_max];
    if (keeper.n_provisional >= keeper.provisional_max) {
        const Beam &oldest = map.index.beams[entry.slot];
        if (oldest.id == entry.id && is_provisional(oldest)) {
            drop_unconfirmed(map, entry.slot);
        }
    }
    entry = {slot, map.index.beams[slot].id};
    ++keeper.n_provisional;
}

} // namespace

void put_beam(gpom_map &map, const Beam &beam)
{
    const uint32_t slot = insert(map.index, beam);
    mark_beam(map, beam);
    if (is_provisional(beam)) {
        enter_provisional(map, slot);
    }
}

void store_beam(gpom_map &map, const Beam &beam)
{
    put_beam(map, beam);
    ++(beam.returned != 0 ? map.stats.beams_hit : map.stats.beams_no_return);
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

void drop_unconfirmed(gpom_map &map, uint32_t slot)
{
    drop_beam(map, slot);
    ++map.stats.beams_not_confirmed;
}

void drop_all(gpom_map &map)
{
    forget_all(map.index);
    map.keeper.n_provisional = 0;
    map.keeper.hand = 0;
}

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

void retire_hit(gpom_map &map, uint32_t slot)
{
    ++map.stats.hits_cleared;
    Beam &beam = map.index.beams[slot];
    if (is_near_past(map, end_of(beam))) {
        drop_hit(map, slot);
        return;
    }
    mark_hit(map, beam);
    set_past(beam, map.keeper.time_number);
}

void set_agreed(gpom_map &map, Beam &beam, uint32_t agreed)
{
    const float sn2 = sn2_of(map.noise, beam, map.index.hit_part);
    beam.agreed = agreed & kAgreedMax;
    if (sn2_of(map.noise, beam, map.index.hit_part) != sn2) {
        mark_hit(map, beam);
    }
}

void make_standing(gpom_map &map, Beam &beam)
{
    const bool was_provisional = is_provisional(beam);
    beam.hit = kStanding;
    if (was_provisional) {
        mark_beam(map, beam);
    }
}

void end_beam(gpom_map &map, uint32_t slot, float range_m)
{
    Beam &beam = map.index.beams[slot];
    mark_beam(map, beam);
    beam.range_m = range_m;
    beam.returned = 0;
    if (has_hit(beam)) {
        remove_hit(map.index, slot);
    }
}

void start_beam(gpom_map &map, uint32_t slot, float start_m)
{
    Beam &beam = map.index.beams[slot];
    mark_beam(map, beam);
    advance_start(beam, start_m);
}

} // namespace gpom
