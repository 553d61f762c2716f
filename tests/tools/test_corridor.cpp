// The simulated corridor: doors as wide as they say, room for the robot, ranges of the true walls.
#include "tools/sim/corridor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

using namespace gpom_tools;

namespace
{

/// Way to the nearest obstacle, each of them looked at; 0 inside one.
double obstacle_distance_m(const Corridor &corridor, double x_m, double y_m)
{
    double nearest_m = INFINITY;
    for (const Rect &rect : corridor.world.obstacles) {
        const double dx_m = std::max({rect.x0_m - x_m, 0.0, x_m - rect.x1_m});
        const double dy_m = std::max({rect.y0_m - y_m, 0.0, y_m - rect.y1_m});
        nearest_m = std::min(nearest_m, std::hypot(dx_m, dy_m));
    }
    return nearest_m;
}

} // namespace

TEST_CASE("corridor: at any depth of the wall a door is free over its width and no farther")
{
    std::set<std::pair<double, double>> places;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Corridor corridor = make_corridor(seed);
        REQUIRE(corridor.doors.size() == 3);
        places.insert({corridor.doors[0].centre.x_m, corridor.doors[0].centre.y_m});
        for (std::size_t i = 0; i < 3; ++i) {
            const Door &door = corridor.doors[i];
            CHECK(door.width_m == doctest::Approx(0.7 + 0.1 * static_cast<double>(i)));
            for (double depth_m = -0.05; depth_m < 0.06; depth_m += 0.01) {
                const double y_m = door.centre.y_m + depth_m, half_m = 0.5 * door.width_m;
                for (double x_m = -half_m + 5e-4; x_m < half_m; x_m += 1e-3) {
                    CHECK(obstacle_distance_m(corridor, door.centre.x_m + x_m, y_m) > 0.0);
                }
                for (const double x_m : {-half_m - 5e-4, half_m + 5e-4}) {
                    CHECK(obstacle_distance_m(corridor, door.centre.x_m + x_m, y_m) == 0.0);
                }
            }
        }
    }
    CHECK(places.size() > 15); // a seed moves the walls
}

TEST_CASE("corridor: a robot of 0.34 m radius drives clear of all walls and into every room")
{
    const Corridor corridor = make_corridor(3);
    REQUIRE(corridor.n_past > 0);
    for (std::size_t i = 0; i < corridor.poses.size(); ++i) {
        const StreetPose &pose = corridor.poses[i];
        CHECK(obstacle_distance_m(corridor, pose.x_m, pose.y_m) > 0.34);
        if (i < corridor.n_past) {
            CHECK(pose.y_m < corridor.wall.y0_m);
        }
    }
    for (const Door &door : corridor.doors) {
        CHECK(std::any_of(corridor.poses.begin(), corridor.poses.end(), [&](const auto &pose) {
            return std::fabs(pose.x_m - door.centre.x_m) < 0.1 && pose.y_m > door.centre.y_m + 1.0;
        }));
    }
}

TEST_CASE("corridor: a range without noise ends at the first obstacle")
{
    const Corridor corridor = make_corridor(5);
    CorridorLaser laser;
    laser.noise_m = 0.0;
    const std::vector<Scan> scans = scan_corridor(corridor, laser);
    REQUIRE(scans.size() == corridor.poses.size());
    int n_inside = 0, n_nowhere = 0, n_hits = 0;
    for (std::size_t k = 0; k < scans.size(); k += 40) {
        const Scan &scan = scans[k];
        REQUIRE(scan.ranges_m.size() == 180);
        for (std::size_t i = 0; i < scan.ranges_m.size(); i += 3) {
            const double bearing_rad =
                scan.theta_rad + scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad;
            const double c = std::cos(bearing_rad), s = std::sin(bearing_rad);
            const double range_m = double{scan.ranges_m[i]};
            const auto distance_at = [&](double way_m) {
                return obstacle_distance_m(corridor, scan.x_m + way_m * c, scan.y_m + way_m * s);
            };
            for (double way_m = 0.0; way_m < std::min(range_m - 1e-3, 10.0); way_m += 2e-3) {
                n_inside += distance_at(way_m) > 0.0 ? 0 : 1;
            }
            n_hits += std::isfinite(range_m) ? 1 : 0;
            n_nowhere += std::isfinite(range_m) && distance_at(range_m) > 1e-3 ? 1 : 0;
        }
    }
    CHECK(n_hits > 500);
    CHECK(n_inside == 0);
    CHECK(n_nowhere == 0);
}

TEST_CASE("corridor: ranges have the noise that is asked for, another seed has other noise")
{
    const Corridor corridor = make_corridor(1);
    CorridorLaser laser;
    laser.noise_m = 0.0;
    const std::vector<Scan> clean = scan_corridor(corridor, laser);
    laser.noise_m = 0.02;
    const std::vector<Scan> noisy = scan_corridor(corridor, laser);
    laser.seed = 2;
    const std::vector<Scan> other = scan_corridor(corridor, laser);
    double n = 0.0, sum2 = 0.0;
    for (std::size_t k = 0; k < clean.size(); ++k) {
        CHECK(noisy[k].ranges_m != other[k].ranges_m);
        for (std::size_t i = 0; i < clean[k].ranges_m.size(); ++i) {
            const double error_m = double{noisy[k].ranges_m[i]} - double{clean[k].ranges_m[i]};
            if (std::isfinite(error_m)) {
                n += 1.0;
                sum2 += error_m * error_m;
            }
        }
    }
    REQUIRE(n > 50000.0);
    CHECK(std::sqrt(sum2 / n) == doctest::Approx(0.02).epsilon(4.0 / std::sqrt(2.0 * n)));
}
