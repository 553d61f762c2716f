// How wrong distances to obstacles are on simulated streets, and whether the intervals of
// gpom_distance_query() hold: beside OctoMap with dynamicEDT3D (B. Lau, C. Sprunk, W. Burgard,
// 2013), on the same scans.
//
// The places: uniform in the area, in the open, within 3 m of an obstacle and within 1 m of a beam.
//
// usage: distance-error PARAMS.toml FIRST_SEED END_SEED PLACES_A_STREET
#include "ports/host/params_toml.hpp"
#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <dynamicEDT3D/dynamicEDTOctomap.h>
#include <octomap/octomap.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

using namespace gpom_tools;

namespace
{

constexpr double kObstacle_m = 3.0;
constexpr double kBeam_m = 1.0;
constexpr double kRange_m = 10.0; ///< Both search up to here.
constexpr std::array<double, 4> kCells_m = {0.1, 0.25, 0.5, 1.0};

double distance_to(const Rect &r, gpom_point_t p)
{
    return std::hypot(std::max({r.x0_m - p.x_m, p.x_m - r.x1_m, 0.0}),
                      std::max({r.y0_m - p.y_m, p.y_m - r.y1_m, 0.0}));
}

double distance_to(const StreetWorld &world, gpom_point_t p)
{
    double least = INFINITY;
    for (const Rect &r : world.obstacles) {
        least = std::min(least, distance_to(r, p));
    }
    return least;
}

bool is_near_beam(const std::vector<gpom_beam_t> &beams, gpom_point_t p)
{
    return std::any_of(beams.begin(), beams.end(), [p](const gpom_beam_t &b) {
        const double x = p.x_m - b.x_m, y = p.y_m - b.y_m;
        const double dx = static_cast<double>(b.dir_x), dy = static_cast<double>(b.dir_y);
        const double t = std::clamp(x * dx + y * dy, 0.0, static_cast<double>(b.range_m));
        return std::hypot(x - t * dx, y - t * dy) <= kBeam_m;
    });
}

/// OctoMap at z = 0 and the distances in it.
class Rival {
public:
    Rival(const std::vector<Scan> &scans, const StreetConfig &street, double cell_m) : tree_(cell_m)
    {
        for (const Scan &scan : scans) {
            insert(scan);
        }
        const auto width = static_cast<float>(street.width_m);
        const auto height = static_cast<float>(street.height_m);
        const auto cell = static_cast<float>(cell_m);
        edt_ = std::make_unique<DynamicEDTOctomap>(
            static_cast<float>(kRange_m), &tree_, octomap::point3d(-1.0f, -1.0f, -cell),
            octomap::point3d(width + 1.0f, height + 1.0f, cell), false);
        edt_->update();
    }
    double distance(gpom_point_t p) const
    {
        const float d = edt_->getDistance(
            octomap::point3d(static_cast<float>(p.x_m), static_cast<float>(p.y_m), 0.0f));
        return d < 0.0f ? kRange_m : static_cast<double>(d);
    }

private:
    void insert(const Scan &scan)
    {
        octomap::Pointcloud cloud;
        for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
            const auto range_m = static_cast<double>(scan.ranges_m[i]);
            if (range_m > 0.0) { // NaN: the beam is ignored
                const double angle = scan.theta_rad + scan.angle_min_rad +
                                     static_cast<double>(i) * scan.angle_step_rad;
                const double end_m = std::min(range_m, scan.range_max_m + 1.0);
                cloud.push_back(static_cast<float>(scan.x_m + end_m * std::cos(angle)),
                                static_cast<float>(scan.y_m + end_m * std::sin(angle)), 0.0f);
            }
        }
        tree_.insertPointCloud(cloud,
                               {static_cast<float>(scan.x_m), static_cast<float>(scan.y_m), 0.0f},
                               scan.range_max_m);
    }

    octomap::OcTree tree_;
    std::unique_ptr<DynamicEDTOctomap> edt_;
};

struct Sums {
    std::size_t n = 0, n_held = 0;
    double error_m = 0.0, width_m = 0.0;
    std::array<double, kCells_m.size()> rival_m = {};

    void add(const Sums &more)
    {
        n += more.n, n_held += more.n_held;
        error_m += more.error_m, width_m += more.width_m;
        for (std::size_t i = 0; i < rival_m.size(); ++i) {
            rival_m[i] += more.rival_m[i];
        }
    }
    void print(const char *name) const
    {
        const double all = static_cast<double>(n);
        std::printf("%-8s %6zu places: error %.3f m, interval +-%.2f m holds %.1f %%; OctoMap",
                    name, n, error_m / all, width_m / all,
                    100.0 * static_cast<double>(n_held) / all);
        for (std::size_t i = 0; i < rival_m.size(); ++i) {
            std::printf(" %.3f m (%.2f)", rival_m[i] / all, kCells_m[i]);
        }
        std::printf("\n");
    }
};

gpom_distance_answer_t ask(const HostMap &map, gpom_point_t p)
{
    std::vector<unsigned char> memory(gpom_scratch_bytes(map.get()));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    gpom_distance_answer_t answer;
    if (gpom_distance_query(map.get(), &p, kRange_m, &answer, &scratch) != GPOM_OK) {
        throw std::runtime_error("gpom_distance_query failed");
    }
    return answer;
}

Sums judge(const gpom_params_t &params, std::uint64_t seed, std::size_t n_places)
{
    StreetConfig street;
    street.seed = seed;
    const StreetWorld world = make_street_world(street);
    const std::vector<Scan> scans = simulate_scans(world, street, {});
    HostMap map(params, beam_count(scans), {0.0, 0.0});
    map.insert(scans);
    const std::vector<gpom_beam_t> beams = map.kept();
    std::vector<std::unique_ptr<Rival>> rivals;
    for (const double cell_m : kCells_m) {
        rivals.push_back(std::make_unique<Rival>(scans, street, cell_m));
    }
    std::mt19937_64 bits(seed * 77 + 5);
    const auto uniform = [&bits] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
    Sums sums;
    while (sums.n < n_places) {
        const gpom_point_t p = {street.width_m * uniform(), street.height_m * uniform()};
        const double truth_m = distance_to(world, p);
        if (truth_m <= 0.0 || truth_m > kObstacle_m || !is_near_beam(beams, p)) {
            continue;
        }
        const gpom_distance_answer_t answer = ask(map, p);
        const double error_m = std::fabs(static_cast<double>(answer.distance_m) - truth_m);
        const double half_m = 1.96 * static_cast<double>(answer.deviation_m);
        ++sums.n;
        sums.n_held += error_m <= half_m ? 1u : 0u;
        sums.error_m += error_m, sums.width_m += half_m;
        for (std::size_t i = 0; i < rivals.size(); ++i) {
            sums.rival_m[i] += std::fabs(rivals[i]->distance(p) - truth_m);
        }
    }
    return sums;
}

} // namespace

int main(int argc, char **argv)
{
    if (argc != 5) {
        std::fprintf(stderr,
                     "usage: distance-error PARAMS.toml FIRST_SEED END_SEED PLACES_A_STREET\n");
        return 2;
    }
    try {
        const gpom_params_t params = read_params(argv[1]);
        Sums all;
        for (int seed = std::atoi(argv[2]); seed < std::atoi(argv[3]); ++seed) {
            const Sums sums = judge(params, static_cast<std::uint64_t>(seed),
                                    static_cast<std::size_t>(std::atoi(argv[4])));
            char name[32];
            std::snprintf(name, sizeof name, "seed %d", seed);
            sums.print(name);
            all.add(sums);
        }
        all.print("all");
    } catch (const std::exception &error) {
        std::fprintf(stderr, "distance-error: %s\n", error.what());
        return 1;
    }
    return 0;
}
