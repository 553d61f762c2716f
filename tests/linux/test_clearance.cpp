// Clearance against rays: no ray from the robot meets anything that is not free before it.
#include "ports/linux/out/clearance.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

using gpomd::ClearanceView;
using gpomd::Sector;

namespace
{

constexpr std::uint32_t kSide = 60;

struct Field {
    std::vector<gpom_cell_t> cells{kSide * kSide, gpom_cell_t{3000, 20, GPOM_FREE, 1}};
    ClearanceView view = {nullptr, {-7.5, 2.5, 0.25, kSide, kSide}, 0.1, 9.9, 0.7, 6.0f, 0.4f};

    gpom_cell_t &at(double x_m, double y_m)
    {
        const auto ix = static_cast<std::size_t>((x_m - view.raster.x0_m) / view.raster.cell_m);
        const auto iy = static_cast<std::size_t>((y_m - view.raster.y0_m) / view.raster.cell_m);
        return cells[iy * kSide + ix];
    }
    /// A cell so far away in a direction from forward.
    gpom_cell_t &beside(double distance_m, double bearing_rad)
    {
        return at(view.x_m + distance_m * std::cos(view.yaw_rad + bearing_rad),
                  view.y_m + distance_m * std::sin(view.yaw_rad + bearing_rad));
    }
    std::vector<Sector> sectors(std::size_t n)
    {
        view.cells = cells.data();
        std::vector<Sector> found(n);
        gpomd::find_clearance(view, found.data(), n);
        return found;
    }
};

constexpr gpom_cell_t kOccupied = {60000, 30, GPOM_OCCUPIED, 1};
constexpr gpom_cell_t kUnsure = {33000, 200, GPOM_UNSURE, 1};
constexpr gpom_cell_t kUnknown = {33000, 255, GPOM_UNKNOWN, 0};

std::uint64_t seed()
{
    const char *const text = std::getenv("GPOM_SEED");
    return text != nullptr ? std::strtoull(text, nullptr, 10) : 1;
}

} // namespace

// Rays in fine steps; the robot's own place does not count.
TEST_CASE("along every ray of a sector all is free up to its distance, and not by far no further")
{
    std::mt19937_64 random(seed());
    INFO("seed ", seed());
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int trial = 0; trial < 20; ++trial) {
        Field field;
        field.view.x_m += uniform(random);
        field.view.y_m += uniform(random);
        field.view.yaw_rad = 7.0 * uniform(random) - 3.5;
        for (gpom_cell_t &cell : field.cells) {
            const double u = uniform(random);
            cell = u < 0.004 ? kOccupied : u < 0.006 ? kUnsure : u < 0.008 ? kUnknown : cell;
        }
        const std::size_t n = trial % 2 == 0 ? 15 : 28;
        const std::vector<Sector> sectors = field.sectors(n);
        std::vector<double> nearest(n, 6.0); // within 3 degrees of it: cells reach in by corners
        for (int ray = 0; ray < 3600; ++ray) {
            const double bearing = 2.0 * M_PI * ray / 3600.0;
            const auto i = static_cast<std::size_t>(std::lround(bearing / 2.0 / M_PI * double(n)));
            for (double d = 0.01; d < 6.0; d += 0.02) {
                const gpom_cell_t &cell = field.beside(d, bearing);
                const std::size_t index = static_cast<std::size_t>(&cell - field.cells.data());
                const double cx = field.view.raster.x0_m + 0.25 * (double(index % kSide) + 0.5);
                const double cy = field.view.raster.y0_m + 0.25 * (double(index / kSide) + 0.5);
                const double own = std::hypot(cx - field.view.x_m, cy - field.view.y_m);
                if (cell.cls != GPOM_FREE && own > 0.4) {
                    CHECK(sectors[i % n].distance_m <= d);
                    CHECK_FALSE(sectors[i % n].is_clear);
                    for (std::size_t j = 0; j < n; ++j) {
                        const double aside = std::remainder(
                            bearing - 2.0 * M_PI * double(j) / double(n), 2.0 * M_PI);
                        if (std::fabs(aside) < M_PI / double(n) + 0.05) {
                            nearest[j] = std::fmin(nearest[j], d);
                        }
                    }
                    break;
                }
            }
        }
        for (std::size_t i = 0; i < n; ++i) {
            CHECK(sectors[i].distance_m > nearest[i] - 0.36 - 1e-9); // a cell's diagonal
        }
    }
}

TEST_CASE("sector 0 is about forward, and they run counter-clockwise")
{
    for (const std::size_t n : {15u, 28u}) {
        for (std::size_t i = 0; i < n; ++i) {
            Field field;
            field.beside(4.0, 2.0 * M_PI * double(i) / double(n)) = kOccupied;
            const std::vector<Sector> sectors = field.sectors(n);
            for (std::size_t j = 0; j < n; ++j) {
                CHECK(sectors[j].is_clear == (j != i));
            }
            CHECK(sectors[i].distance_m == doctest::Approx(4.0).epsilon(0.08));
            CHECK(sectors[i].probability == 13);
            CHECK(gpomd::distance_code(sectors[i]) <= 40);
            CHECK(gpomd::distance_code(sectors[(i + 1) % n]) == GPOM_CAN_DISTANCE_CLEAR);
            CHECK(sectors[(i + 1) % n].probability == 1); // 3000 / 65535, rounded up
        }
    }
}

TEST_CASE("unknown is said where nothing is known, and ends a sector where something is")
{
    Field field;
    for (gpom_cell_t &cell : field.cells) {
        cell = kUnknown;
    }
    for (const Sector &sector : field.sectors(15)) {
        CHECK(gpomd::distance_code(sector) == GPOM_CAN_DISTANCE_UNKNOWN);
        CHECK(sector.probability == GPOM_CAN_LEVEL_UNKNOWN);
    }
    Field wall;
    wall.beside(3.0, 0.0) = kUnknown;
    const std::vector<Sector> sectors = wall.sectors(15);
    CHECK_FALSE(sectors[0].is_unknown);
    CHECK(sectors[0].probability == GPOM_CAN_LEVEL_UNKNOWN);
    CHECK(gpomd::distance_code(sectors[0]) <= 30);
    CHECK(gpomd::distance_code(sectors[0]) >= 26);
}

TEST_CASE("outside of the raster all is unknown, and so is a robot that is there or nowhere")
{
    Field field;
    field.view.x_m = field.view.raster.x0_m + 1.0;
    const std::vector<Sector> edge = field.sectors(15);
    double least = 100.0;
    for (const Sector &sector : edge) {
        least = std::fmin(least, sector.distance_m);
    }
    CHECK(least == doctest::Approx(1.0));
    for (const double x_m : {-7.6, 7.6, double(NAN)}) {
        field.view.x_m = x_m;
        for (const Sector &sector : field.sectors(15)) {
            CHECK(gpomd::distance_code(sector) == GPOM_CAN_DISTANCE_UNKNOWN);
        }
    }
    field.view.x_m = 0.0;
    field.view.yaw_rad = NAN;
    CHECK(gpomd::distance_code(field.sectors(15)[0]) == GPOM_CAN_DISTANCE_UNKNOWN);
}
