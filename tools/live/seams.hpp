// Measures where the answers of a live map jump.
#ifndef GPOM_TOOLS_LIVE_SEAMS_HPP
#define GPOM_TOOLS_LIVE_SEAMS_HPP

#include "tools/live/judge.hpp"

#include <functional>

namespace gpom_tools
{

constexpr double kSeamLine = 1.0;                   ///< Length of a line [m].
constexpr double kSeamStep = 0.002;                 ///< Spacing of the places on a line [m].
constexpr std::size_t kSeamParts = 64;              ///< Number of parts of a step that is examined
                                                    ///< closely.
constexpr double kSeamBounds[] = {0.02, 0.05, 0.1}; ///< Bounds of the differences of probability.

/// Number of pairs of neighbouring places whose probabilities differ by more than each of
/// kSeamBounds, and the largest difference.
struct SeamCounts {
    std::size_t n_over[std::size(kSeamBounds)] = {};
    double largest = 0.0;
};

/// A large difference at kSeamStep is a steep slope or a jump. The jump is the difference that is
/// left when the places are kSeamParts times nearer to each other.
struct Seams {
    std::size_t n_lines = 0;
    SeamCounts differences;
    SeamCounts jumps;
};

/// Probabilities of occupancy at places.
using AskMap = std::function<std::vector<double>(const std::vector<gpom_point_t> &places)>;

/// Measure along lines of kSeamLine in random directions. Each line has one of `middles` in its
/// middle.
Seams seams_of(const AskMap &ask, const std::vector<gpom_point_t> &middles, std::uint64_t seed);

/// Measure the live map of all scans along n_lines lines. In a log, the middles lie evenly along
/// held-out beams. In a street, they are random places within kNearBeam of a beam.
nlohmann::ordered_json seams_report(const JudgeOptions &options, std::size_t n_lines);

} // namespace gpom_tools

#endif
