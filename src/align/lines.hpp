/// \file lines.hpp
/// Lines through kept hits.
#pragma once

#include "src/align/returns.hpp"
#include "src/beams/nearest.hpp"

struct gpom_map;

namespace gpom
{

/// How many hits a line is laid through, at most.
constexpr uint32_t kLineHits = 6;

/// A return that moved by less than this part of the reach since its search keeps its line.
constexpr float kStay = 0.02f;

/// What a return is compared with.
enum class Shape : uint8_t {
    kNone, ///< Fewer than two hits are near.
    kLine, ///< A line through the middle, across the normal.
    kSpot  ///< The hits do not form a line. The return is compared with their middle.
};

/// The hits near a return, as a line.
struct Line {
    Eigen::Vector2f middle_m;   ///< Of the hits, relative to the map's origin.
    Eigen::Vector2f normal;     ///< Unit vector.
    Eigen::Vector2f searched_m; ///< Where the search was made.
    float found2_m2;            ///< Squared distance of the farthest hit that was found.
    float error_m;              ///< Distance of the return from the line.
    uint8_t n_hits;             ///< Hits that were found.
    Shape shape;
};

/// Memory of searches.
struct LineSearch {
    Found<float> found[kLineHits];
    Subtree stack[kDepthMax];
    uint32_t n_searches;
};

/// Where a return is for a pose.
struct Placed {
    Eigen::Vector2f at_m; ///< Relative to the map's origin.
    Eigen::Vector2f direction;
};

/// Find the line near a return. Hits farther than reach_m do not count, nor do hits that were seen
/// from the other side. If line.n_hits is kLineHits, an earlier search nearby found them. That
/// makes the new search faster.
void find_line(const gpom_map &map, const Placed &placed, float reach_m, LineSearch &search,
               Line &line);

} // namespace gpom
