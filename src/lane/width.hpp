/// \file width.hpp
/// The lane width of this build: how many queries or beams are computed together.
#pragma once

#include "src/lane/lane.hpp"

namespace gpom
{

constexpr int kLanes = GPOM_LANES;
using F = lane::Lane<kLanes>::F;
using I = lane::Lane<kLanes>::I;

} // namespace gpom
