// Probability of occupancy as a function of the distance from a surface.
#ifndef GPOM_TOOLS_EVAL_PROFILE_HPP
#define GPOM_TOOLS_EVAL_PROFILE_HPP

#include "tools/eval/protocol.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace gpom_tools
{

/// Offsets from a surface [m]. Negative: before the surface, in free space.
constexpr std::array<double, 10> kProfileOffsets{-1.0,  -0.5, -0.3, -0.2, -0.1,
                                                 -0.05, 0.0,  0.05, 0.1,  0.2};
constexpr std::size_t kProfileSurfaces = 3000; ///< Largest number of returns, or of places on true
                                               ///< surfaces.
constexpr double kProfileFree = 0.3;     ///< A probability of at most this counts as free, whatever
                                         ///< the thresholds of the parameters are.
constexpr double kProfileOccupied = 0.7; ///< A probability of at least this counts as occupied.

struct ProfilePlace {
    gpom_point_t at;
    std::size_t i_offset; ///< Index in kProfileOffsets.
};

/// Answers of a map at one offset.
struct ProfileRow {
    double offset_m;
    std::size_t n_places;
    double mean_probability;
    double share_free;
    double share_occupied;
};

struct Profile {
    std::vector<ProfileRow> rows; ///< By offset, without offsets that have no place.
    /// Offset at which the mean probability first rises to one half, seen from the free side [m].
    /// It is interpolated between the offsets. Empty: the probability never rises to one half, or
    /// is above it from the first offset on.
    std::optional<double> crossing_m;
};

/// Places along beams, with offsets from the return. Takes kProfileSurfaces of the beams with a
/// return, chosen by the seed. Places at or behind the sensor are left out.
std::vector<ProfilePlace> profile_along(std::vector<GridBeam> beams, std::uint64_t seed);

/// Places across the true surface, with offsets along its normal. Takes kProfileSurfaces of the
/// cell sides that the scans' sensor could see, chosen by the seed, and a random place on each.
/// Sides that no sensor could see are left out, because they say nothing about a map. A place is
/// left out if it is nearer to another surface or outside the raster, so that the offset of every
/// place is its signed distance.
std::vector<ProfilePlace> profile_across(const Truth &truth, const std::vector<Scan> &scans,
                                         std::uint64_t seed);

/// `probabilities` has one entry for each place.
Profile profile_of(const std::vector<ProfilePlace> &places,
                   const std::vector<double> &probabilities);

/// The test places, the same for all maps.
struct TestSet {
    std::vector<TestPoint> points;
    std::vector<bool> near_beam; ///< One for each point. Empty for logs.
    std::vector<ProfilePlace> profile;
};

/// All places to query in a map: first the points, then the places of the profile.
std::vector<gpom_point_t> places_of(const TestSet &test);

} // namespace gpom_tools

#endif
