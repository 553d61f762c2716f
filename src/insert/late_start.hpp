/// \file late_start.hpp
/// Free segments that begin late: where kept free segments already crowd, a new one says nothing
/// new, but each search that comes near must look at it (docs/decisions/late-starts.md).
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// Let a new beam begin where its way to its end leaves crowded space (live.h). The beam keeps its
/// end, and its hit. A beam without a free segment stays as it is.
///
/// Cost: one traversal of free segments for each 32 late_m of the beam, at most kStretchesMax.
void begin_late(gpom_map &map, Beam &beam);

} // namespace gpom
