/// \file forget.hpp
/// Forgetting everything that beams say about a disc.
#pragma once

#include "gpom/live.h"

namespace gpom
{

/// True for a finite centre and a radius above 0 up to twice GPOM_REACH_M.
bool is_disc(const gpom_disc_t *disc);

/// Drop hits in a disc and shorten the beams that cross it.
/// Cost: O(slots of the store + cells in reach of the beams that change).
void forget_disc(gpom_map &map, const gpom_disc_t &disc);

} // namespace gpom
