// Chooses the readings that make the map and the points that judge it.
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

constexpr std::size_t kLogScansMax = 600;       ///< Number of scans of the paper's outdoor set.
constexpr std::size_t kLogPointsOfAKind = 3000; ///< Number of occupied test points, and of free
                                                ///< ones.
constexpr std::size_t kRunScans = 40;           ///< Number of consecutive scans in a held-out run.
constexpr std::size_t kRunsHeldOut = 2;         ///< Number of held-out runs.
constexpr double kTrainingShareMax = 0.9;       ///< The other returns are needed to judge the map.
constexpr double kLogRangeMin = 0.05;           ///< Shorter returns come from the sensor's housing
                                                ///< [m].
constexpr double kBeyondReturn = 0.05;          ///< Occupied test points lie this far behind a
                                                ///< return [m].
constexpr double kShortOfReturn = 0.05;         ///< Free test points lie at least this far before a
                                                ///< return [m].
constexpr double kBand = 0.5;                   ///< The band: places this near to the return [m].
constexpr double kNearBeam = 5.0;               ///< Distance that counts as near a beam [m].

/// Uniform numbers from the raw bits of mt19937_64. They are the same with any standard library.
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

/// Move n random items, without repetition, to the front. n must be at most the number of items.
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
    bool in_band = false; ///< Within kBand of the return of its beam, or of a street's true
                          ///< surface.
};

std::vector<gpom_point_t> places_of(const std::vector<TestPoint> &points);

/// Distance of a free point on a beam with a return [m]. `share`, 0 to 1, is its position on the
/// allowed part of the beam. The allowed part ends kShortOfReturn before the return. With in_band
/// it is only the part in the band.
double free_distance(double range_m, bool in_band, double share);

/// Read all scans of a log. Usable ranges are cut to options.range_max_m. Throws FileError.
std::vector<Scan> read_log(const std::string &path, const ReadOptions &options);

/// At most n scans at even intervals, with the first and the last scan.
std::vector<Scan> evenly_taken(std::vector<Scan> scans, std::size_t n);

struct LogSplit {
    std::vector<Scan> training; ///< NaN for every beam that the map does not get.
    std::vector<Scan> others;   ///< NaN for every beam except the returns that may become test
                                ///< points.
    std::vector<TestPoint> points;
};

/// Split by held-out beams. Each return is for training with the probability `fraction`. Half of
/// the test points are occupied and lie kBeyondReturn behind a held-out return. The other half are
/// free and lie on a beam before a held-out return: every second one anywhere on the beam, the
/// others in the band, all at least kShortOfReturn before the return. Throws std::runtime_error if
/// either part is empty.
LogSplit split_log(const std::vector<Scan> &scans, double fraction, std::uint64_t seed);

/// Split by held-out runs. kRunsHeldOut runs of kRunScans consecutive scans give the test points,
/// by the rules of split_log(). Runs start at multiples of kRunScans. Returns of all other scans
/// are for training with the probability `fraction`. Throws std::runtime_error if there are fewer
/// than twice as many whole runs or if either part is empty.
LogSplit split_log_runs(const std::vector<Scan> &scans, double fraction, std::uint64_t seed);

/// Centres of n random cells. All cells have the same probability.
std::vector<TestPoint> street_points(const Truth &truth, std::size_t n, std::uint64_t seed);

/// Add returns that are too short, as dust, rain or another laser causes them. With the probability
/// `share` a return is replaced by a range that is uniform between 0 and the true range.
void add_spurious(std::vector<Scan> &scans, double share, std::uint64_t seed);

/// True if a point is within distance_m of any beam, from its origin to its end.
bool is_near(gpom_point_t point, const std::vector<GridBeam> &beams, double distance_m);

} // namespace gpom_tools

#endif
