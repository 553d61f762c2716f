// Computes the neighbourhoods of many queries: the part of the model that the continuous parameters
// do not change.
#ifndef GPOM_TOOLS_LEARN_NEIGHBOURS_HPP
#define GPOM_TOOLS_LEARN_NEIGHBOURS_HPP

#include <array>
#include <cstddef>
#include <vector>

namespace gpom_tools
{

/// What is known about a hit. It decides the hit's noise variance (live.h).
enum class HitNoise {
    kSeen, ///< Scans of several times returned from it, or the map does not record it: sn2.
    kOnce, ///< Scans of only one time returned from it: sn2_once.
    kPast  ///< Scans of several times saw through it.
};

/// A beam in the map frame. Its index in the world is its id.
struct LearnBeam {
    double x_m, y_m;
    double dir_x, dir_y; ///< Unit direction.
    double range_m;
    std::size_t i_scan;
    bool hit;            ///< Its hit is in the map.
    bool returned = hit; ///< Its range is that of a return, so a gap is left before its end.
    bool free = true;    ///< Its free segment is in the map.
    HitNoise noise = HitNoise::kSeen;
};

/// Value for LearnPlace::own: no beam.
constexpr std::size_t kNoBeam = static_cast<std::size_t>(-1);

/// A place with known occupancy in one of several worlds.
struct LearnPlace {
    double x_m, y_m;
    bool occupied;
    std::size_t i_world;
    std::size_t own; ///< The beam that gives the place's occupancy and is left out, or kNoBeam.
};

/// Beams of one log or street, in order of insertion.
using LearnWorld = std::vector<LearnBeam>;

/// A training point relative to the query. Its first coordinate is along the main axis of the
/// chosen hits. All covariances stay the same under a rotation about the query.
struct NeighbourPoint {
    double along_m, across_m;
    double label; ///< +1 occupied, -1 free.
    HitNoise noise;
    double count; ///< Number of equal points that were merged. The noise variance of one is divided
                  ///< by this number.
    double weight = 1.0; ///< Remaining weight of each of them where neighbours fade (params.h).
};

struct Neighbourhood {
    std::vector<NeighbourPoint> points; ///< Hits, then free points.
    double axis_ratio; ///< sqrt(lam2 / lam1) of the scatter of the hits. 1: no shrinking.
    double vote;       ///< cs. It fades with the distance of the first hit.
    double line;       ///< How far the query is behind the line of the hits (params.h). It fades
                       ///< like vote.
    std::array<double, 4> log_distances;
    bool occupied; ///< The true occupancy.
};

/// Rules that decide which points are neighbours.
struct NeighbourRule {
    double gap_m;
    double depth_m;
    std::size_t scan_points_max; ///< 0: no cap.
    std::size_t n_hits;
    std::size_t n_free;
    std::size_t n_fading = 0; ///< Number of last neighbours of each kind that fade.
};

/// Find neighbourhoods by brute force on all cores.
std::vector<Neighbourhood> neighbourhoods_of(const std::vector<LearnWorld> &worlds,
                                             const std::vector<LearnPlace> &places,
                                             const NeighbourRule &rule, unsigned n_threads);

} // namespace gpom_tools

#endif
