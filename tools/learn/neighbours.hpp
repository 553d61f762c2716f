// The neighbourhoods of many queries: all of the model that the continuous parameters leave alone.
#ifndef GPOM_TOOLS_LEARN_NEIGHBOURS_HPP
#define GPOM_TOOLS_LEARN_NEIGHBOURS_HPP

#include <array>
#include <cstddef>
#include <vector>

namespace gpom_tools
{

/// What is known of a hit: it decides its noise variance (live.h).
enum class HitNoise {
    kSeen, ///< Scans of several times returned from it, or the map does not tell: sn2.
    kOnce, ///< Scans of one time alone saw it: sn2_once.
    kPast  ///< Scans of several times saw through it.
};

/// A beam in the map frame; its index in the world is its id.
struct LearnBeam {
    double x_m, y_m;
    double dir_x, dir_y; ///< Unit direction.
    double range_m;
    std::size_t i_scan;
    bool hit;            ///< Its hit is in the map.
    bool returned = hit; ///< Its range is that of a return: a gap is left before it.
    bool free = true;    ///< Its free segment is in the map.
    HitNoise noise = HitNoise::kSeen;
};

/// No beam, for LearnPlace::own.
constexpr std::size_t kNoBeam = static_cast<std::size_t>(-1);

/// A place whose occupancy is known, in one of several worlds.
struct LearnPlace {
    double x_m, y_m;
    bool occupied;
    std::size_t i_world;
    std::size_t own; ///< The beam that tells its occupancy and is left out, or kNoBeam.
};

/// Beams of one log or street, in order of insertion.
using LearnWorld = std::vector<LearnBeam>;

/// A training point relative to the query, its first coordinate along the chosen hits' main axis:
/// every covariance is the same after a rotation about the query.
struct NeighbourPoint {
    double along_m, across_m;
    double label; ///< +1 occupied, -1 free.
    HitNoise noise;
    double count; ///< Equal points made one: its noise variance is that of one over their count.
    double weight = 1.0; ///< What is left of each of them where neighbours fade (params.h).
};

struct Neighbourhood {
    std::vector<NeighbourPoint> points; ///< Hits, then free points.
    double axis_ratio; ///< sqrt(lam2 / lam1) of the hits' scatter; 1: no shrinking.
    double vote;       ///< cs, faded out with the first hit's distance.
    double line;       ///< How far the query is behind the hits' line (params.h), faded likewise.
    std::array<double, 4> log_distances;
    bool occupied; ///< What is there.
};

/// What decides which points are neighbours.
struct NeighbourRule {
    double gap_m;
    double depth_m;
    std::size_t scan_points_max; ///< 0: no cap.
    std::size_t n_hits;
    std::size_t n_free;
    std::size_t n_fading = 0; ///< Of each kind, the last that fade.
};

/// Brute force on all cores.
std::vector<Neighbourhood> neighbourhoods_of(const std::vector<LearnWorld> &worlds,
                                             const std::vector<LearnPlace> &places,
                                             const NeighbourRule &rule, unsigned n_threads);

} // namespace gpom_tools

#endif
