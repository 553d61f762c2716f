// Probability of occupancy by the distance from a surface.
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

/// Offsets from a surface [m]: negative before it, where it is free.
constexpr std::array<double, 10> kProfileOffsets{-1.0,  -0.5, -0.3, -0.2, -0.1,
                                                 -0.05, 0.0,  0.05, 0.1,  0.2};
constexpr std::size_t kProfileSurfaces = 3000; ///< Returns, or places on true surfaces, at most.
constexpr double kProfileFree = 0.3;     ///< Free means a probability of at most this, occupied
constexpr double kProfileOccupied = 0.7; ///< of at least this, whatever the parameters say.

struct ProfilePlace {
    gpom_point_t at;
    std::size_t i_offset; ///< In kProfileOffsets.
};

/// What a map says at one offset.
struct ProfileRow {
    double offset_m;
    std::size_t n_places;
    double mean_probability;
    double share_free;
    double share_occupied;
};

struct Profile {
    std::vector<ProfileRow> rows; ///< By offset; offsets without a place are left out.
    /// Where the mean probability, linear between the offsets, first rises to one half, seen from
    /// the free side [m]; none if it never does, or is there from the first offset on.
    std::optional<double> crossing_m;
};

/// Along beams, offsets from the return: of the beams with a return kProfileSurfaces, chosen by the
/// seed. A place before the sensor, or at it, is left out.
std::vector<ProfilePlace> profile_along(std::vector<GridBeam> beams, std::uint64_t seed);

/// Across the true surface, offsets along its normal: of the sides of cells that the scans' sensor
/// could see kProfileSurfaces, chosen by the seed, a random place on each. What no sensor could see
/// says nothing of a map. A place that is nearer to another surface, or outside the raster, is left
/// out, so that the offset is the signed distance of every place.
std::vector<ProfilePlace> profile_across(const Truth &truth, const std::vector<Scan> &scans,
                                         std::uint64_t seed);

/// `probabilities` holds one for each place.
Profile profile_of(const std::vector<ProfilePlace> &places,
                   const std::vector<double> &probabilities);

/// What judges every map alike.
struct TestSet {
    std::vector<TestPoint> points;
    std::vector<bool> near_beam; ///< For each point; empty for logs.
    std::vector<ProfilePlace> profile;
};

/// All places to ask a map for: the points, then the profile's.
std::vector<gpom_point_t> places_of(const TestSet &test);

} // namespace gpom_tools

#endif
