// Simulated streets: the same on every run and platform, physically sound, and frozen.
#include "tools/sim/street.hpp"

#include <doctest/doctest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace gpom_tools;

namespace
{

StreetConfig config_of(std::uint64_t seed)
{
    StreetConfig config;
    config.seed = seed;
    return config;
}

std::string scans_text(const StreetConfig &config)
{
    const StreetWorld world = make_street_world(config);
    return scans_csv(simulate_scans(world, config, nullptr), street_comment(config));
}

std::string truth_bytes(const StreetConfig &config)
{
    const StreetWorld world = make_street_world(config);
    return truth_pgm(street_truth(world, config.truth_cell_m), street_comment(config));
}

unsigned long crc(const std::string &bytes)
{
    return crc32(0, reinterpret_cast<const Bytef *>(bytes.data()), static_cast<uInt>(bytes.size()));
}

/// Cells around a point that are occupied, of 9; cells outside the raster count as free.
int occupied_around(const Truth &truth, double x_m, double y_m)
{
    const int ix = static_cast<int>(std::floor((x_m - truth.x0_m) / truth.cell_m));
    const int iy = static_cast<int>(std::floor((y_m - truth.y0_m) / truth.cell_m));
    int n = 0;
    for (int jy = std::max(iy - 1, 0); jy <= std::min(iy + 1, truth.ny - 1); ++jy) {
        for (int jx = std::max(ix - 1, 0); jx <= std::min(ix + 1, truth.nx - 1); ++jx) {
            n += truth.at(jx, jy) ? 1 : 0;
        }
    }
    return n;
}

/// Steps along a beam's free part, short of its end by a cell, that lie deep inside an obstacle.
int steps_through_walls(const Truth &truth, const StreetPose &beam, double free_m)
{
    int n = 0;
    const double step_m = 0.5 * truth.cell_m;
    for (double s_m = 0.0; s_m < free_m - truth.cell_m; s_m += step_m) {
        const double x_m = beam.x_m + s_m * std::cos(beam.theta_rad);
        const double y_m = beam.y_m + s_m * std::sin(beam.theta_rad);
        n += occupied_around(truth, x_m, y_m) == 9 ? 1 : 0;
    }
    return n;
}

/// Free cells reached from the first free one, going to the four neighbours.
std::size_t reached_cells(const Truth &truth)
{
    std::vector<std::uint8_t> closed = truth.occupied;
    const auto first = std::find(closed.begin(), closed.end(), 0) - closed.begin();
    std::vector<std::size_t> stack{static_cast<std::size_t>(first)};
    closed[stack[0]] = 1;
    std::size_t n_reached = 0;
    while (!stack.empty()) {
        const int ix = static_cast<int>(stack.back() % static_cast<std::size_t>(truth.nx));
        const int iy = static_cast<int>(stack.back() / static_cast<std::size_t>(truth.nx));
        stack.pop_back();
        ++n_reached;
        const int neighbours[4][2] = {{ix - 1, iy}, {ix + 1, iy}, {ix, iy - 1}, {ix, iy + 1}};
        for (const auto &next : neighbours) {
            const bool inside =
                next[0] >= 0 && next[0] < truth.nx && next[1] >= 0 && next[1] < truth.ny;
            if (inside && closed[truth.index(next[0], next[1])] == 0) {
                closed[truth.index(next[0], next[1])] = 1;
                stack.push_back(truth.index(next[0], next[1]));
            }
        }
    }
    return n_reached;
}

} // namespace

TEST_CASE("street: a seed always gives the same files, another seed gives others")
{
    CHECK(scans_text(config_of(7)) == scans_text(config_of(7)));
    CHECK(truth_bytes(config_of(7)) == truth_bytes(config_of(7)));
    const StreetWorld world_7 = make_street_world(config_of(7));
    const StreetWorld world_8 = make_street_world(config_of(8));
    CHECK(street_truth(world_7, 0.25).occupied != street_truth(world_8, 0.25).occupied);
}

// Published results name recipe and seed. If this fails, the recipe has changed: take a new
// kStreetRecipe, and then new sums.
TEST_CASE("street: recipe 1 is frozen")
{
    REQUIRE(kStreetRecipe == 1);
    CHECK(crc(scans_text(config_of(0))) == 446301990ul);
    CHECK(crc(truth_bytes(config_of(0))) == 1996110187ul);
}

TEST_CASE("street: the default is the paper's data set, 476 beams in 18,000 m2")
{
    const StreetConfig config;
    const auto scans = simulate_scans(make_street_world(config), config, nullptr);
    REQUIRE(scans.size() == 28);
    std::size_t n_beams = 0, n_hits = 0;
    for (const Scan &scan : scans) {
        n_beams += scan.ranges_m.size();
        for (const float range_m : scan.ranges_m) {
            CHECK((std::isinf(range_m) || (range_m > 0.0f && range_m < 34.0f)));
            n_hits += std::isinf(range_m) ? 0 : 1;
        }
        CHECK(scan.angle_min_rad == doctest::Approx(-1.5707963));
        CHECK(scan.angle_min_rad + 16 * scan.angle_step_rad == doctest::Approx(1.5707963));
    }
    CHECK(n_beams == 476);
    CHECK(n_hits > 238);
    const Truth truth = street_truth(make_street_world(config), config.truth_cell_m);
    CHECK(truth.nx * truth.cell_m * truth.ny * truth.cell_m == doctest::Approx(18000.0));
}

TEST_CASE("street: the robot stays inside the area, clear of obstacles, a step between scans")
{
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        StreetConfig config = config_of(seed);
        config.n_scans = 400;
        config.step_m = 2.0;
        if (seed >= 10) { // other shapes, the smallest allowed among them
            config.width_m = 40.0 + 31.0 * static_cast<double>(seed - 10);
            config.height_m = 40.0 + 17.0 * static_cast<double>(seed - 10);
        }
        CAPTURE(seed);
        const StreetWorld world = make_street_world(config);
        const ObstacleGrid obstacles(world);
        const auto poses = drive_streets(world, config);
        REQUIRE(poses.size() == 400);
        int n_bad = 0;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const StreetPose &pose = poses[i];
            for (int k = 0; k < 8; ++k) { // a robot of 0.4 m radius
                const double x_m = pose.x_m + 0.4 * std::cos(0.785398 * k);
                const double y_m = pose.y_m + 0.4 * std::sin(0.785398 * k);
                n_bad += obstacles.contains(x_m, y_m) ? 1 : 0;
            }
            const bool inside = pose.x_m > 0.0 && pose.x_m < config.width_m && pose.y_m > 0.0 &&
                                pose.y_m < config.height_m;
            n_bad += inside ? 0 : 1;
            const std::size_t j = i > 0 ? i - 1 : 0;
            const double step_m = std::hypot(pose.x_m - poses[j].x_m, pose.y_m - poses[j].y_m);
            n_bad += step_m < 2.0 + 1e-9 ? 0 : 1; // chords of curves are shorter
        }
        CHECK(n_bad == 0);
    }
}

TEST_CASE("street: noise-free ranges agree with the truth raster to within a cell")
{
    int n_hits = 0, n_hits_on_nothing = 0, n_through = 0;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        StreetConfig config = config_of(seed);
        config.range_noise_m = 0.0;
        config.n_beams = 90;
        const StreetWorld world = make_street_world(config);
        const Truth truth = street_truth(world, 0.1);
        for (const Scan &scan : simulate_scans(world, config, nullptr)) {
            for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
                const double bearing_rad = scan.theta_rad + scan.angle_min_rad +
                                           static_cast<double>(i) * scan.angle_step_rad;
                const double range_m = scan.ranges_m[i];
                const double free_m = std::min(range_m, scan.range_max_m);
                n_through += steps_through_walls(truth, {scan.x_m, scan.y_m, bearing_rad}, free_m);
                if (std::isinf(range_m)) {
                    continue;
                }
                ++n_hits;
                const double x_m = scan.x_m + range_m * std::cos(bearing_rad);
                const double y_m = scan.y_m + range_m * std::sin(bearing_rad);
                n_hits_on_nothing += occupied_around(truth, x_m, y_m) == 0 ? 1 : 0;
            }
        }
    }
    CHECK(n_hits > 10000);
    CHECK(n_hits_on_nothing == 0);
    CHECK(n_through == 0);
}

TEST_CASE("street: range noise has the stated standard deviation and moves nothing else")
{
    StreetConfig config = config_of(3);
    config.n_scans = 400;
    config.range_max_m = 1000.0; // no hit is lost beyond the maximum
    const StreetWorld world = make_street_world(config);
    const auto noisy = simulate_scans(world, config, nullptr);
    config.range_noise_m = 0.0;
    const auto clean = simulate_scans(world, config, nullptr);
    double n = 0.0, sum = 0.0, sum2 = 0.0;
    for (std::size_t k = 0; k < clean.size(); ++k) {
        CHECK(noisy[k].x_m == clean[k].x_m);
        for (std::size_t i = 0; i < clean[k].ranges_m.size(); ++i) {
            const double error_m = double{noisy[k].ranges_m[i]} - double{clean[k].ranges_m[i]};
            if (std::isfinite(error_m)) {
                n += 1.0;
                sum += error_m;
                sum2 += error_m * error_m;
            }
        }
    }
    // Four standard errors: 0.05 / sqrt(n) of the mean, 0.05 / sqrt(2 n) of the deviation.
    REQUIRE(n > 3000.0);
    CHECK(std::fabs(sum / n) < 4.0 * 0.05 / std::sqrt(n));
    CHECK(std::fabs(std::sqrt(sum2 / n) - 0.05) < 4.0 * 0.05 / std::sqrt(2.0 * n));
}

TEST_CASE("street: free space is one piece, and a believable part of the area")
{
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        CAPTURE(seed);
        const Truth truth = street_truth(make_street_world(config_of(seed)), 0.25);
        const auto n_free =
            static_cast<std::size_t>(std::count(truth.occupied.begin(), truth.occupied.end(), 0));
        const double part =
            static_cast<double>(n_free) / static_cast<double>(truth.occupied.size());
        CHECK(part > 0.30);
        CHECK(part < 0.55);
        CHECK(reached_cells(truth) == n_free);
    }
}

TEST_CASE("street: absurd settings are named, sound ones accepted")
{
    CHECK(street_config_error(StreetConfig{}).empty());
    const auto broken = [](const auto &breaking) {
        StreetConfig config;
        breaking(config);
        return street_config_error(config);
    };
    using C = StreetConfig;
    CHECK(broken([](C &c) { c.width_m = 10.0; }).find("width") == 0);
    CHECK(broken([](C &c) { c.height_m = 1e9; }).find("height") == 0);
    CHECK(broken([](C &c) { c.n_scans = 0; }).find("scans") == 0);
    CHECK(broken([](C &c) { c.n_beams = 1000000000; }).find("beams") == 0);
    CHECK(broken([](C &c) { c.fov_deg = 361.0; }).find("fov-deg") == 0);
    CHECK(broken([](C &c) { c.range_max_m = 0.0; }).find("range-max") == 0);
    CHECK(broken([](C &c) { c.range_noise_m = -0.1; }).find("range-noise") == 0);
    CHECK(broken([](C &c) { c.step_m = 0.0; }).find("step") == 0);
    CHECK(broken([](C &c) { c.step_m = NAN; }).find("step") == 0);
    CHECK(broken([](C &c) { c.truth_cell_m = 0.0; }).find("truth-cell") == 0);
}
