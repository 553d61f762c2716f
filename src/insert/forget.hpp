/// \file forget.hpp
/// Forgetting what beams say of a disc.
#pragma once

#include "gpom/live.h"

namespace gpom
{

/// True for a finite centre and a radius above 0 up to twice GPOM_REACH_M.
bool is_disc(const gpom_disc_t *disc);

/// Drop hits in a disc and shorten the beams that cross it.
/// Cost: one look at every kept beam, and a mark of the cells of those that change.
void forget_disc(gpom_map &map, const gpom_disc_t &disc);

} // namespace gpom
