// Runs queries for an instruction counter (tests/instructions.py), on the map of a simulated
// street, at places spread over it.
//
// usage: count-queries PARAMS.toml N_HITS N_FREE N_POINTS points|gradients
#include "ports/host/params_toml.hpp"
#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

using namespace gpom_tools;

namespace
{

/// Places over the whole area. Each is far from the one before, so that no query profits from its
/// predecessor.
std::vector<gpom_point_t> spread_points(const StreetConfig &street, std::size_t n)
{
    std::vector<gpom_point_t> points;
    for (std::size_t i = 0; i < n; ++i) {
        const double k = static_cast<double>(i);
        points.push_back({std::fmod(5.5 + 37.0 * k, street.width_m - 10.0),
                          std::fmod(3.5 + 53.0 * k, street.height_m - 8.0)});
    }
    return points;
}

std::uint16_t count_of(const char *text) { return static_cast<std::uint16_t>(std::atoi(text)); }

} // namespace

int main(int argc, char **argv)
{
    if (argc != 6) {
        std::fprintf(stderr,
                     "usage: count-queries PARAMS.toml N_HITS N_FREE N_POINTS points|gradients\n");
        return 2;
    }
    gpom_params_t params = read_params(argv[1]);
    params.n_hits = count_of(argv[2]);
    params.n_free = count_of(argv[3]);
    const StreetConfig street;
    const std::vector<Scan> scans = simulate_scans(make_street_world(street), street, {});
    HostMap map(params, beam_count(scans), {0.0, 0.0});
    map.insert(scans);
    const std::vector<gpom_point_t> points = spread_points(street, count_of(argv[4]));
    double sum = 0.0;
    if (std::strcmp(argv[5], "gradients") == 0) {
        for (const gpom_gradient_t &gradient : map.gradients(points)) {
            sum += static_cast<double>(gradient.probability_x);
        }
    } else {
        for (const gpom_answer_t &answer : map.query(points)) {
            sum += static_cast<double>(answer.probability);
        }
    }
    std::printf("points %zu lanes %u sum %.6f\n", points.size(), gpom_lanes(), sum);
    return 0;
}
