/// \file known_free.hpp
/// What the free segments of kept beams say of a place, and how they give way to what arrived there
/// (live.h).
#pragma once

#include "src/beams/beam.hpp"

struct gpom_map;

namespace gpom
{

/// How near a beam passes a place to speak of it: this many times keep_m, and this share of the way
/// it still has to go.
struct Margin {
    float width, slope;
};

/// A beam speaks against a hit that it passes nearer than keep_m times this, and nearer than this
/// share of the way it still has to go: beams that graze a wall run along it before they end
/// there. Leaves and fences let beams through a hand's breadth beside a hit that will be hit again,
/// so that wider margins cost accuracy outdoors (docs/decisions/keeping-beams.md).
constexpr Margin kPass = {0.15f, 0.05f};

/// A hit that arrived and was confirmed takes away the free segments that pass it so near: wider
/// margins, as hits of one surface are keep_m apart and beams went between them.
constexpr Margin kClear = {0.6f, 0.2f};

/// True if a place lies on a free segment of a kept beam of another scan.
bool is_known_free(gpom_map &map, const Point &at, const Margin &margin);

/// A hit was confirmed where segments were free: those give way that pass by it, or cross its
/// occupied depth. Seldom, so that it is compiled for size.
[[gnu::cold]] void clear_free(gpom_map &map, const Beam &hit);

} // namespace gpom
