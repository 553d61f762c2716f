/// \file keep.hpp
/// Which beams are worth keeping.
///
/// A return near a kept hit only confirms that hit. A beam that runs past a kept hit speaks against
/// it. Scans of several times decide together whether a hit or a free segment stands: parked cars
/// clear once they leave, while a single wrong return erases nothing. Hits that no longer stand are
/// past; queries see them with more noise. When the store is full, the least useful beam makes
/// room.
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// Take a new beam of the current scan. It is kept or dropped when its group is complete.
/// is_sure: the place of the beam is known well enough to speak against others.
void consider(gpom_map &map, const Beam &beam, bool is_sure);

/// The scan is complete: decide about the beams that still wait.
void settle(gpom_map &map);

} // namespace gpom
