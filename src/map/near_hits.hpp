/// \file near_hits.hpp
/// The kept hits nearest to a place.
#pragma once

#include "src/beams/nearest.hpp"

struct gpom_map;

namespace gpom
{

/// The two nearest hits of different beams, the nearest first. Where there are fewer, id is kNoId
/// and d2 the greatest squared distance that was asked for.
struct NearHits {
    Found<float> best[2];
};

/// What near_hits() looks for.
struct HitSearch {
    Point at;
    float within2_m2; ///< Squared distance of the farthest hit of interest.
    float enough2_m2; ///< The search ends once one hit is nearer than the root of this.
};

/// The two nearest hits that are not past.
NearHits near_hits(gpom_map &map, const HitSearch &search);

/// True if a hit that was past before this scan's time is nearer to a place than keep_m. Hits that
/// became past at this time do not count, because the answer must not depend on the order in which
/// hits are judged. May be called inside a traversal of hits.
bool is_near_past(gpom_map &map, const Point &at);

} // namespace gpom
