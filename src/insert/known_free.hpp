/// \file known_free.hpp
/// What free segments of kept beams say about a place, and how they are dropped when something
/// arrived there (live.h).
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// How near a beam must pass a place to count there: nearer than keep_m times `width`, and nearer
/// than `slope` times the distance that it still has to go.
struct Margin {
    float width, slope;
};

/// A beam speaks against a hit that it passes within this margin. The margin shrinks towards the
/// beam's end, because a beam that grazes a wall runs along the wall before it ends there. Wider
/// margins cost accuracy outdoors: leaves and fences let beams pass a hand's breadth beside a hit
/// that will be hit again (docs/decisions/keeping-beams.md).
constexpr Margin kPass = {0.15f, 0.05f};

/// A hit that arrived and was confirmed clears the free segments that pass it within this margin.
/// The margin is wider than kPass, because hits of one surface are keep_m apart, and beams passed
/// between them while the place was free.
constexpr Margin kClear = {0.6f, 0.2f};

/// True if the free segment of a kept beam of an earlier scan passes a place within a margin.
bool is_known_free(gpom_map &map, const Point &at, const Margin &margin);

/// A hit was confirmed in space that was free. Drops the free segments that pass the hit within
/// kClear or cross its occupied part. Seldom called, so it is compiled for size.
[[gnu::cold]] void clear_free(gpom_map &map, const Beam &hit);

} // namespace gpom
