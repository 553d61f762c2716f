#include "tests/common/surface_oracle.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/eval/surface.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace
{

using namespace gpom_tools;

/// Random blocks: some corners, some cells alone.
Truth random_truth(unsigned seed, int nx, int ny)
{
    std::mt19937 bits(seed);
    Truth truth{-3.0, 2.0, 0.25, nx, ny, {}};
    truth.occupied.assign(truth.index(0, ny), 0);
    for (int i = 0; i < 12; ++i) {
        const int x0 = static_cast<int>(bits() % static_cast<unsigned>(nx));
        const int y0 = static_cast<int>(bits() % static_cast<unsigned>(ny));
        const int x1 = std::min(nx, x0 + 1 + static_cast<int>(bits() % 6));
        const int y1 = std::min(ny, y0 + 1 + static_cast<int>(bits() % 6));
        for (int y = y0; y < y1; ++y) {
            for (int x = x0; x < x1; ++x) {
                truth.occupied[truth.index(x, y)] = i % 4 == 3 ? 0 : 1;
            }
        }
    }
    return truth;
}

gpom_point_t random_place(const Truth &truth, std::mt19937 &bits)
{
    const auto share = [&] { return (static_cast<double>(bits()) + 0.5) / 4294967296.0; };
    return {truth.x0_m + share() * truth.nx * truth.cell_m,
            truth.y0_m + share() * truth.ny * truth.cell_m};
}

/// A free room of 10 x 8 m with an occupied block at x 4 .. 5, y 3 .. 5.
Truth room_with_block()
{
    Truth truth{0.0, 0.0, 0.5, 20, 16, {}};
    truth.occupied.assign(truth.index(0, truth.ny), 0);
    for (int y = 6; y < 10; ++y) {
        truth.occupied[truth.index(8, y)] = truth.occupied[truth.index(9, y)] = 1;
    }
    return truth;
}

Scan scan_at(double x_m, double y_m, double theta_rad, double range_max_m)
{
    return {0.0, x_m, y_m, theta_rad, -0.5, 0.25, range_max_m, {1.0f, 1.0f, 1.0f, 1.0f, 1.0f}};
}

} // namespace

TEST_CASE("the signed distance is the least one to the cells of the other kind")
{
    std::mt19937 bits(5);
    for (unsigned seed = 0; seed < 8; ++seed) {
        const Truth truth = random_truth(seed, 30, 22);
        for (int i = 0; i < 200; ++i) {
            const gpom_point_t at = random_place(truth, bits);
            const double expected = brute_distance(truth, at);
            const double got = signed_distance(truth, at, 1.0);
            if (std::abs(expected) <= 1.0) {
                CHECK(got == doctest::Approx(expected).epsilon(1e-12));
            } else {
                CHECK(std::isinf(got));
                CHECK((got > 0.0) == (expected > 0.0));
            }
        }
    }
}

TEST_CASE("a world of one kind has no surface")
{
    const Truth truth{0.0, 0.0, 0.5, 4, 4, std::vector<std::uint8_t>(16, 1)};
    CHECK(signed_distance(truth, {1.0, 1.0}, 5.0) == std::numeric_limits<double>::infinity());
    CHECK(surface_places(truth).empty());
}

// Half a step along the normal is occupied, half a step against it free.
TEST_CASE("surface places are the sides between free and occupied cells")
{
    const Truth truth = random_truth(3, 30, 22);
    std::size_t n_sides = 0;
    for (int y = 0; y < truth.ny; ++y) {
        for (int x = 0; x < truth.nx; ++x) {
            n_sides += x > 0 && truth.at(x, y) != truth.at(x - 1, y) ? 1 : 0;
            n_sides += y > 0 && truth.at(x, y) != truth.at(x, y - 1) ? 1 : 0;
        }
    }
    const auto places = surface_places(truth);
    CHECK(places.size() == n_sides);
    for (const SurfacePlace &place : places) {
        for (const double way_m : {-0.1, 0.1}) {
            const gpom_point_t at = {place.at.x_m + way_m * place.normal_x,
                                     place.at.y_m + way_m * place.normal_y};
            CHECK(signed_distance(truth, at, 1.0) == doctest::Approx(way_m).epsilon(1e-9));
        }
    }
}

TEST_CASE("a surface is in view of a sensor that faces it, in range, with nothing between")
{
    const Truth truth = room_with_block();
    const SurfacePlace west{{4.0, 3.75}, 1.0, 0.0}, east{{5.0, 3.75}, -1.0, 0.0};
    CHECK(is_in_view(west, truth, {scan_at(1.0, 3.6, 0.0, 10.0)}));
    CHECK_FALSE(is_in_view(east, truth, {scan_at(1.0, 3.6, 0.0, 10.0)})); // behind the block
    CHECK_FALSE(is_in_view(west, truth, {scan_at(1.0, 3.6, 0.0, 2.9)}));  // out of range
    CHECK_FALSE(is_in_view(west, truth, {scan_at(1.0, 3.6, 1.0, 10.0)})); // beside the field
    CHECK(is_in_view(west, truth, {scan_at(1.0, 3.6, 6.6, 10.0)}));       // a turn further
    CHECK(is_in_view(east, truth, {scan_at(1.0, 3.6, 0.0, 10.0), scan_at(9.0, 3.6, 3.1, 10.0)}));
    CHECK_FALSE(is_in_view(west, truth, {}));
}

TEST_CASE("the band of a street is all within half a metre of its surface")
{
    const Truth truth = random_truth(2, 40, 30);
    std::size_t n_band = 0;
    for (const TestPoint &point : street_points(truth, 2000, 1)) {
        CHECK(point.in_band == (std::abs(brute_distance(truth, point.at)) <= 0.5));
        n_band += point.in_band ? 1 : 0;
    }
    CHECK(n_band > 300);
    CHECK(n_band < 1700);
}
