/// \file witness.hpp
/// What new beams say of kept ones: that their hits are still there, or that one can see through
/// them (live.h).
#pragma once

#include "src/beam.hpp"

struct gpom_map;

namespace gpom
{

/// Compare the beams of the keeper's group with all kept hits near them: hits are confirmed,
/// contradicted or cleared, and the group's bits are set.
void judge(gpom_map &map);

/// True if a place is within reach of a free segment of a kept beam.
bool is_near_free(gpom_map &map, const Point &at, float reach_m);

/// True if a place lies on a free segment of a kept beam of another scan.
bool is_known_free(gpom_map &map, const Point &at);

} // namespace gpom
