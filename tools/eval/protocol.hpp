// Which readings make the map and which points judge it.
#ifndef GPOM_TOOLS_EVAL_PROTOCOL_HPP
#define GPOM_TOOLS_EVAL_PROTOCOL_HPP

#include "ports/host/scan_log.hpp"
#include "tools/eval/occupancy_grid.hpp"
#include "tools/sim/truth.hpp"

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace gpom_tools
{

constexpr std::size_t kLogScansMax = 600;       ///< As many as the paper's outdoor set has.
constexpr std::size_t kLogPointsOfAKind = 3000; ///< Occupied ones, and as many free ones.
constexpr std::size_t kRunScans = 40;           ///< Held-out runs: consecutive scans in each,
constexpr std::size_t kRunsHeldOut = 2;         ///< and their number.
constexpr double kTrainingShareMax = 0.9;       ///< Someone has to judge.
constexpr double kLogRangeMin = 0.05;           ///< Shorter returns are the housing [m].
constexpr double kBeyondReturn = 0.05;          ///< Occupied test points [m].
constexpr double kShortOfReturn = 0.05;         ///< Free test points end here [m].
constexpr double kBand = 0.5;                   ///< The band: this near to the return [m].
constexpr double kNearBeam = 5.0;               ///< "Near" a beam [m].

/// Uniform numbers from the raw bits of mt19937_64: the same with any standard library.
class ProtocolRandom {
public:
    explicit ProtocolRandom(std::uint64_t seed) : bits_(seed) {}
    double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; } ///< In [0, 1).
    std::size_t below(std::size_t n)
    {
        return static_cast<std::size_t>(uniform() * static_cast<double>(n));
    }

private:
    std::mt19937_64 bits_;
};

/// Put n of the items, chosen at random without repetition, at the front; n <= their count.
template <class Item>
void choose_first(std::vector<Item> &items, std::size_t n, ProtocolRandom &random)
{
    for (std::size_t i = 0; i < n; ++i) {
        std::swap(items[i], items[i + random.below(items.size() - i)]);
    }
}

struct TestPoint {
    gpom_point_t at;
    bool occupied;
    bool in_band = false; ///< Within kBand of its beam's return, or of a street's true surface.
};

std::vector<gpom_point_t> places_of(const std::vector<TestPoint> &points);

/// Where on a beam with a return a free point lies [m], `share` of the way from 0 to 1: of all that
/// lies kShortOfReturn or more before the return, or of what is in the band alone.
double free_distance(double range_m, bool in_band, double share);

/// All scans of a log; the usable range of none is longer than options.range_max_m. Throws
/// FileError.
std::vector<Scan> read_log(const std::string &path, const ReadOptions &options);

/// At most n scans, evenly taken, the first and the last among them.
std::vector<Scan> evenly_taken(std::vector<Scan> scans, std::size_t n);

struct LogSplit {
    std::vector<Scan> training; ///< NaN for every beam that the map does not get.
    std::vector<Scan> others;   ///< NaN for every beam but the returns that may become test points.
    std::vector<TestPoint> points;
};

/// Held-out beams: each return is for training with the probability `fraction`. Half of the test
/// points are occupied and lie kBeyondReturn behind one of the other returns. Half are free and lie
/// before another one: every second anywhere on its beam, the others in the band, all of them
/// kShortOfReturn or more before the return. Throws std::runtime_error if either part is empty.
LogSplit split_log(const std::vector<Scan> &scans, double fraction, std::uint64_t seed);

/// Held-out runs: kRunsHeldOut runs of kRunScans consecutive scans, of those that start at
/// multiples of kRunScans, give the test points, by the same rules; returns of all other scans are
/// for training with the probability `fraction`. Throws std::runtime_error if there are fewer than
/// twice as many whole runs or either part is empty.
LogSplit split_log_runs(const std::vector<Scan> &scans, double fraction, std::uint64_t seed);

/// Centres of n random cells, each cell as likely as any other.
std::vector<TestPoint> street_points(const Truth &truth, std::size_t n, std::uint64_t seed);

/// Returns that are too short, as from dust, rain or another laser: with this probability a return
/// is replaced by a range that is uniform between 0 and the true one.
void add_spurious(std::vector<Scan> &scans, double share, std::uint64_t seed);

/// Whether a point is within distance_m of any beam, from its origin to its end.
bool is_near(gpom_point_t point, const std::vector<GridBeam> &beams, double distance_m);

} // namespace gpom_tools

#endif
