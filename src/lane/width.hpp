/// \file width.hpp
/// The lane width of this build: the number of queries or beams that are computed together.
#pragma once

#include "src/lane/lane.hpp"

namespace gpom
{

constexpr int kLanes = GPOM_LANES;
using F = lane::Lane<kLanes>::F;
using I = lane::Lane<kLanes>::I;

} // namespace gpom
