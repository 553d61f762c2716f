/// \file witness.hpp
/// What new beams say of kept ones: that their hits are still there, or that one can see through
/// them (live.h).
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// Compare the beams of the keeper's group with all kept hits near them: hits are confirmed,
/// contradicted or cleared, and the group's bits are set.
void judge(gpom_map &map);

} // namespace gpom
