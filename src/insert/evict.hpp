/// \file evict.hpp
/// Which kept beam makes room for a new one.
#pragma once

#include "src/map/map.hpp"

#include <float.h>

namespace gpom
{

/// A return whose nearest hit is this many times keep_m away stands alone.
constexpr float kAloneGap = 2.0f;

/// The recommended keep_m. Gaps are compared with it in a map that keeps every beam.
constexpr float kUsualSpacing_m = 0.1f;

/// The distance that gaps are compared with.
inline float spacing_of(const gpom_map &map)
{
    return map.config.keep_m > 0.0f ? map.config.keep_m : kUsualSpacing_m;
}

/// The squared gap of a return that stands alone: farther hits do not count as its neighbours.
inline float alone2_of(const gpom_map &map)
{
    const float gap_m = kAloneGap * spacing_of(map);
    return gap_m * gap_m;
}

/// A squared gap that was not looked for. It is greater than every gap.
constexpr float kGapUnknown2_m2 = FLT_MAX;

/// Make room for a new beam if the store is full: drop the least useful of a few kept beams and
/// count its cause. False if the new beam is not worth more than the least of them.
/// gap2_m2: squared distance from the new beam's hit to the nearest kept hit, exact if less than
/// alone2_of(); kGapUnknown2_m2 if nobody looked.
bool make_room(gpom_map &map, const Beam &beam, float gap2_m2);

} // namespace gpom
