/// \file lowres_step.hpp
/// Evaluating dirty cells of the low-resolution map.
#pragma once

#include "gpom/query.h"

namespace gpom
{

/// Evaluate cells in the order that lowres.h describes. Returns the operations used, at most
/// `budget`. The scratch must be large enough for a query.
uint64_t lowres_step(gpom_map &map, const gpom_scratch_t &scratch, uint64_t budget);

} // namespace gpom
