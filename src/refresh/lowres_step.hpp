/// \file lowres_step.hpp
/// Evaluating dirty cells of the low-resolution map.
#pragma once

#include "gpom/query.h"

namespace gpom
{

/// Evaluate cells in the order that lowres.h gives. Returns the operations used, at most `budget`.
/// The scratch is that of a query, and large enough.
uint64_t lowres_step(gpom_map &map, const gpom_scratch_t &scratch, uint64_t budget);

} // namespace gpom
