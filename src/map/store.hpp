/// \file store.hpp
/// Changes of kept beams that queries see: insert, drop, retire, shorten, confirm. The beam is
/// changed in the index, and the low-resolution cells in its reach become dirty.
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// Keep a beam. The store must have room, and ids. A provisional beam waits in a ring; if the ring
/// is full, the beam that waited longest is dropped.
void put_beam(gpom_map &map, const Beam &beam);

/// Keep a beam of a scan, and count it in the map's statistics.
void store_beam(gpom_map &map, const Beam &beam);

/// Drop a hit, a free segment or a whole beam.
void drop_hit(gpom_map &map, uint32_t slot);
void drop_free(gpom_map &map, uint32_t slot);
void drop_beam(gpom_map &map, uint32_t slot);

/// Drop a provisional beam because nothing confirmed it, and count it.
void drop_unconfirmed(gpom_map &map, uint32_t slot);

/// Drop all beams. No cell becomes dirty: the caller resets the low-resolution map.
void drop_all(gpom_map &map);

/// Drop all beams whose sensor is out of reach of the origin. No cell becomes dirty: the caller
/// marks all cells.
void drop_out_of_reach(gpom_map &map);

/// Several scans saw through a hit: it is past from now on. If another past hit is nearer than
/// keep_m, it is dropped instead, because one past hit says enough about that place.
void retire_hit(gpom_map &map, uint32_t slot);

/// Set how often a hit was seen again. Cells become dirty if its noise changes.
void set_agreed(gpom_map &map, Beam &beam, uint32_t agreed);

/// The hit stands. Cells become dirty if it was provisional, because no query saw the beam so far.
void make_standing(gpom_map &map, Beam &beam);

/// End a beam at range_m; it has no hit from now on.
void end_beam(gpom_map &map, uint32_t slot, float range_m);

/// Let a beam start start_m farther along its way.
void start_beam(gpom_map &map, uint32_t slot, float start_m);

} // namespace gpom
