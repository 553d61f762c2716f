#include "tools/live/seams.hpp"

#include "ports/host/params_toml.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

/// Lines use a random stream of their own, so that other users of the seed are not affected.
constexpr std::uint64_t kSeamSeed = 4000;
constexpr double kPi = 3.14159265358979323846;

/// n + 1 places on a line, with both ends.
std::vector<gpom_point_t> places_between(gpom_point_t from, gpom_point_t to, std::size_t n)
{
    std::vector<gpom_point_t> places;
    for (std::size_t i = 0; i <= n; ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(n);
        places.push_back(
            {from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)});
    }
    return places;
}

void count(SeamCounts &counts, double difference)
{
    counts.largest = std::max(counts.largest, difference);
    for (std::size_t i = 0; i < std::size(kSeamBounds); ++i) {
        counts.n_over[i] += difference > kSeamBounds[i] ? 1 : 0;
    }
}

/// Largest difference between neighbouring places on a line.
double jump_between(const AskMap &ask, gpom_point_t from, gpom_point_t to)
{
    const std::vector<double> p = ask(places_between(from, to, kSeamParts));
    double jump = 0.0;
    for (std::size_t i = 1; i < p.size(); ++i) {
        jump = std::max(jump, std::abs(p[i] - p[i - 1]));
    }
    return jump;
}

void look_along(const AskMap &ask, gpom_point_t middle, double bearing_rad, Seams &seams)
{
    const double x_m = kSeamLine / 2.0 * std::cos(bearing_rad);
    const double y_m = kSeamLine / 2.0 * std::sin(bearing_rad);
    const auto n_steps = static_cast<std::size_t>(std::lround(kSeamLine / kSeamStep));
    const std::vector<gpom_point_t> places = places_between(
        {middle.x_m - x_m, middle.y_m - y_m}, {middle.x_m + x_m, middle.y_m + y_m}, n_steps);
    const std::vector<double> p = ask(places);
    for (std::size_t i = 1; i < p.size(); ++i) {
        const double difference = std::abs(p[i] - p[i - 1]);
        count(seams.differences, difference);
        if (difference > kSeamBounds[0]) {
            count(seams.jumps, jump_between(ask, places[i - 1], places[i]));
        }
    }
    ++seams.n_lines;
}

std::vector<gpom_point_t> middles_along(const std::vector<GridBeam> &beams, std::size_t n_lines,
                                        std::uint64_t seed)
{
    ProtocolRandom random(seed + kSeamSeed);
    std::vector<gpom_point_t> middles;
    while (middles.size() < n_lines) {
        GridBeam beam = beams[random.below(beams.size())];
        beam.range_m *= random.uniform();
        middles.push_back(end_of(beam));
    }
    return middles;
}

Json json_of(const SeamCounts &counts, double length_m)
{
    Json per_m;
    for (std::size_t i = 0; i < std::size(kSeamBounds); ++i) {
        per_m.push_back({{"over", kSeamBounds[i]},
                         {"per_m", static_cast<double>(counts.n_over[i]) / length_m}});
    }
    return {{"per_m", per_m}, {"largest", counts.largest}};
}

} // namespace

Seams seams_of(const AskMap &ask, const std::vector<gpom_point_t> &middles, std::uint64_t seed)
{
    ProtocolRandom random(seed + kSeamSeed + 1);
    Seams seams;
    for (const gpom_point_t &middle : middles) {
        look_along(ask, middle, 2.0 * kPi * random.uniform(), seams);
    }
    return seams;
}

Json seams_report(const JudgeOptions &options, std::size_t n_lines)
{
    const JudgeData data = judge_data(options);
    const HostMap map = live_map(read_params(options.params_path), options.live, data.scans);
    const AskMap ask = [&map](const std::vector<gpom_point_t> &places) {
        return map.probabilities(places);
    };
    std::vector<gpom_point_t> middles = places_of(data.points);
    if (options.truth_path.empty()) {
        middles = middles_along(data.others, n_lines, options.seed);
    } else if (middles.size() > n_lines) {
        middles.resize(n_lines);
    }
    const Seams seams = seams_of(ask, middles, options.seed);
    const double length_m = kSeamLine * static_cast<double>(seams.n_lines);
    return {{"lines", seams.n_lines},
            {"length_m", length_m},
            {"kept", gpom_map_beam_count(map.get())},
            {"differences", json_of(seams.differences, length_m)},
            {"step_m", kSeamStep},
            {"jumps", json_of(seams.jumps, length_m)},
            {"jump_step_m", kSeamStep / kSeamParts}};
}

} // namespace gpom_tools
