#include "tools/eval/protocol.hpp"

#include "tools/eval/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace gpom_tools
{
namespace
{

/// Spurious returns use a random stream of their own, so that other users of the seed are not
/// affected.
constexpr std::uint64_t kSpuriousSeed = 1000;

struct Reading {
    std::size_t i_scan;
    std::size_t i_beam;
};

/// A test point at `distance_m` along a beam with a return.
TestPoint point_along(const Scan &scan, std::size_t i_beam, double distance_m, bool occupied)
{
    const double bearing_rad =
        scan.theta_rad + scan.angle_min_rad + static_cast<double>(i_beam) * scan.angle_step_rad;
    return {{scan.x_m + distance_m * std::cos(bearing_rad),
             scan.y_m + distance_m * std::sin(bearing_rad)},
            occupied,
            std::abs(double{scan.ranges_m[i_beam]} - distance_m) <= kBand};
}

std::vector<TestPoint> held_out_points(const std::vector<Scan> &scans,
                                       std::vector<Reading> &readings, ProtocolRandom &random)
{
    const std::size_t n = std::min(kLogPointsOfAKind, readings.size() / 2);
    choose_first(readings, 2 * n, random);
    std::vector<TestPoint> points;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const Scan &scan = scans[readings[i].i_scan];
        const double range_m = double{scan.ranges_m[readings[i].i_beam]};
        const bool occupied = i < n;
        const double distance_m = occupied ? range_m + kBeyondReturn
                                           : free_distance(range_m, i % 2 == 0, random.uniform());
        points.push_back(point_along(scan, readings[i].i_beam, distance_m, occupied));
    }
    return points;
}

enum class Part { kTrains, kJudges, kIgnored };

/// `choose(i_scan)` decides for each usable return, in the order of the log, which part it goes to.
template <class Choose>
LogSplit split_by(const std::vector<Scan> &scans, ProtocolRandom &random, const Choose &choose)
{
    LogSplit split{scans, scans, {}};
    std::vector<Reading> others;
    std::size_t n_training = 0;
    for (std::size_t i_scan = 0; i_scan < scans.size(); ++i_scan) {
        const Scan &scan = scans[i_scan];
        for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
            const double range_m = double{scan.ranges_m[i]};
            const bool usable = range_m > kLogRangeMin && range_m < scan.range_max_m;
            const Part part = usable ? choose(i_scan) : Part::kIgnored;
            constexpr float kLeftOut = std::numeric_limits<float>::quiet_NaN();
            if (part != Part::kTrains) {
                split.training[i_scan].ranges_m[i] = kLeftOut;
            }
            if (part != Part::kJudges) {
                split.others[i_scan].ranges_m[i] = kLeftOut;
            } else {
                others.push_back({i_scan, i});
            }
            n_training += part == Part::kTrains ? 1 : 0;
        }
    }
    if (n_training == 0 || others.size() < 2) {
        throw std::runtime_error(std::to_string(n_training) + " returns for the map and " +
                                 std::to_string(others.size()) +
                                 " to judge it; give more scans or another --fraction");
    }
    split.points = held_out_points(scans, others, random);
    return split;
}

double squared_distance(gpom_point_t point, const GridBeam &beam)
{
    const double c = std::cos(beam.bearing_rad), s = std::sin(beam.bearing_rad);
    const double dx_m = point.x_m - beam.x_m, dy_m = point.y_m - beam.y_m;
    const double along_m = std::clamp(c * dx_m + s * dy_m, 0.0, beam.range_m);
    const double off_x_m = dx_m - along_m * c, off_y_m = dy_m - along_m * s;
    return off_x_m * off_x_m + off_y_m * off_y_m;
}

} // namespace

std::vector<gpom_point_t> places_of(const std::vector<TestPoint> &points)
{
    std::vector<gpom_point_t> places;
    for (const TestPoint &point : points) {
        places.push_back(point.at);
    }
    return places;
}

double free_distance(double range_m, bool in_band, double share)
{
    const double most_m = std::max(range_m - kShortOfReturn, 0.0);
    const double least_m = in_band ? std::max(range_m - kBand, 0.0) : 0.0;
    return least_m + share * std::max(most_m - least_m, 0.0);
}

std::vector<Scan> read_log(const std::string &path, const ReadOptions &options)
{
    std::vector<Scan> scans = read_scans(path, options);
    for (Scan &scan : scans) { // scans of a CSV file carry their own
        scan.range_max_m = std::min(scan.range_max_m, options.range_max_m);
    }
    return scans;
}

std::vector<Scan> evenly_taken(std::vector<Scan> scans, std::size_t n)
{
    if (scans.size() <= n) {
        return scans;
    }
    std::vector<Scan> taken;
    for (std::size_t i = 0; i < n; ++i) {
        taken.push_back(std::move(scans[n > 1 ? i * (scans.size() - 1) / (n - 1) : 0]));
    }
    return taken;
}

LogSplit split_log(const std::vector<Scan> &scans, double fraction, std::uint64_t seed)
{
    ProtocolRandom random(seed);
    return split_by(scans, random, [&](std::size_t) {
        return random.uniform() < fraction ? Part::kTrains : Part::kJudges;
    });
}

LogSplit split_log_runs(const std::vector<Scan> &scans, double fraction, std::uint64_t seed)
{
    const std::size_t n_runs = scans.size() / kRunScans;
    if (n_runs < 2 * kRunsHeldOut) {
        throw std::runtime_error(std::to_string(scans.size()) + " scans are too few for --split " +
                                 "runs; it needs " + std::to_string(2 * kRunsHeldOut * kRunScans));
    }
    ProtocolRandom random(seed);
    std::vector<bool> held_out(n_runs, false);
    for (std::size_t n = 0; n < kRunsHeldOut;) {
        const std::size_t i_run = random.below(n_runs);
        n += held_out[i_run] ? 0 : 1;
        held_out[i_run] = true;
    }
    return split_by(scans, random, [&](std::size_t i_scan) {
        const std::size_t i_run = i_scan / kRunScans;
        if (i_run < n_runs && held_out[i_run]) {
            return Part::kJudges;
        }
        return random.uniform() < fraction ? Part::kTrains : Part::kIgnored;
    });
}

std::vector<TestPoint> street_points(const Truth &truth, std::size_t n, std::uint64_t seed)
{
    constexpr double kSearched = 2.0 * kBand;
    ProtocolRandom random(seed);
    std::vector<TestPoint> points;
    for (std::size_t i = 0; i < n; ++i) {
        const auto ix = static_cast<int>(random.below(static_cast<std::size_t>(truth.nx)));
        const auto iy = static_cast<int>(random.below(static_cast<std::size_t>(truth.ny)));
        const gpom_point_t centre = {truth.x0_m + (ix + 0.5) * truth.cell_m,
                                     truth.y0_m + (iy + 0.5) * truth.cell_m};
        const bool in_band = std::abs(signed_distance(truth, centre, kSearched)) <= kBand;
        points.push_back({centre, truth.at(ix, iy), in_band});
    }
    return points;
}

void add_spurious(std::vector<Scan> &scans, double share, std::uint64_t seed)
{
    ProtocolRandom random(seed + kSpuriousSeed);
    for (Scan &scan : scans) {
        for (float &range_m : scan.ranges_m) {
            const bool is_return = range_m > 0.0f && double{range_m} < scan.range_max_m;
            if (is_return && random.uniform() < share) {
                range_m = static_cast<float>(random.uniform()) * range_m;
            }
        }
    }
}

bool is_near(gpom_point_t point, const std::vector<GridBeam> &beams, double distance_m)
{
    return std::any_of(beams.begin(), beams.end(), [&](const GridBeam &beam) {
        return squared_distance(point, beam) <= distance_m * distance_m;
    });
}

} // namespace gpom_tools
