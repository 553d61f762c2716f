#include "tools/eval/occupancy_grid.hpp"
#include "tools/eval/protocol.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <stdexcept>

namespace
{

using namespace gpom_tools;

constexpr gpom_raster_t kRaster{-3.0, 5.0, 0.5, 20, 30}; // x -3 .. 7, y 5 .. 20
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<GridCell> cells_between(gpom_point_t from, gpom_point_t to)
{
    std::vector<GridCell> cells;
    traverse(kRaster, from, to, [&](GridCell cell) { cells.push_back(cell); });
    return cells;
}

bool has(const std::vector<GridCell> &cells, GridCell cell)
{
    return std::find(cells.begin(), cells.end(), cell) != cells.end();
}

/// The cell that a point is clearly inside of; false within 1e-6 cells of a border, or outside.
bool clear_cell(double x_m, double y_m, GridCell &cell)
{
    const double u = (x_m - kRaster.x0_m) / kRaster.cell_m;
    const double v = (y_m - kRaster.y0_m) / kRaster.cell_m;
    cell = {static_cast<std::int64_t>(std::floor(u)), static_cast<std::int64_t>(std::floor(v))};
    return std::abs(u - std::round(u)) > 1e-6 && std::abs(v - std::round(v)) > 1e-6 && u > 0.0 &&
           v > 0.0 && u < kRaster.nx && v < kRaster.ny;
}

/// Whether the segment touches the closed cell, grown by 1e-6 cells; by the slab method.
bool touches(gpom_point_t from, gpom_point_t to, GridCell cell)
{
    const double start[] = {(from.x_m - kRaster.x0_m) / kRaster.cell_m,
                            (from.y_m - kRaster.y0_m) / kRaster.cell_m};
    const double delta[] = {(to.x_m - from.x_m) / kRaster.cell_m,
                            (to.y_m - from.y_m) / kRaster.cell_m};
    const double low[] = {static_cast<double>(cell.ix) - 1e-6, static_cast<double>(cell.iy) - 1e-6};
    double t_in = 0.0, t_out = 1.0;
    for (int axis = 0; axis < 2; ++axis) {
        const double a = low[axis] - start[axis], b = a + 1.0 + 2e-6;
        if (std::abs(delta[axis]) < 1e-12) {
            t_out = a <= 0.0 && b >= 0.0 ? t_out : -1.0;
            continue;
        }
        t_in = std::max(t_in, std::min(a / delta[axis], b / delta[axis]));
        t_out = std::min(t_out, std::max(a / delta[axis], b / delta[axis]));
    }
    return t_in <= t_out;
}

void check_against_sampling(gpom_point_t from, gpom_point_t to)
{
    const std::vector<GridCell> cells = cells_between(from, to);
    constexpr int kSamples = 4000;
    for (int i = 0; i <= kSamples; ++i) {
        const double t = static_cast<double>(i) / kSamples;
        GridCell cell{};
        if (clear_cell(from.x_m + t * (to.x_m - from.x_m), from.y_m + t * (to.y_m - from.y_m),
                       cell)) {
            REQUIRE(has(cells, cell));
        }
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
        REQUIRE(touches(from, to, cells[i]));
        if (i > 0) {
            REQUIRE(std::abs(cells[i].ix - cells[i - 1].ix) +
                        std::abs(cells[i].iy - cells[i - 1].iy) ==
                    1);
        }
    }
}

GridBeam beam_at(double bearing_rad, double range_m, bool hit)
{
    return {2.0, 12.0, bearing_rad, range_m, hit, 0.2};
}

gpom_point_t along(const GridBeam &beam, double way_m, double across_m)
{
    const double c = std::cos(beam.bearing_rad), s = std::sin(beam.bearing_rad);
    return {beam.x_m + way_m * c - across_m * s, beam.y_m + way_m * s + across_m * c};
}

/// Probability of a cell that one widened beam alone has reached, or not.
double widened(const GridBeam &beam, gpom_point_t centre, double cell_m, const GridModel &model)
{
    const double dx_m = centre.x_m - beam.x_m, dy_m = centre.y_m - beam.y_m;
    const double along_m = dx_m * std::cos(beam.bearing_rad) + dy_m * std::sin(beam.bearing_rad);
    const double across_m = dy_m * std::cos(beam.bearing_rad) - dx_m * std::sin(beam.bearing_rad);
    const double way_m = std::hypot(dx_m, dy_m), half_diagonal_m = cell_m / std::sqrt(2.0);
    const double width_m = std::max(0.5 * cell_m, along_m * std::tan(beam.half_width_rad));
    const double evidence = 1.0 - across_m * across_m / (width_m * width_m);
    const bool at_arc = beam.hit && way_m >= beam.range_m - half_diagonal_m;
    const double end_m = beam.hit ? beam.range_m + half_diagonal_m : beam.range_m;
    if (evidence <= 0.0 || along_m < -0.5 * cell_m || way_m > end_m) {
        return 0.5;
    }
    const double p = at_arc ? model.p_hit : model.p_miss;
    return 1.0 / (1.0 + std::pow((1.0 - p) / p, evidence));
}

Scan scan_of(std::vector<float> ranges_m)
{
    return {0.0, 1.0, 2.0, 0.5, -0.25, 0.25, 30.0, std::move(ranges_m)};
}

} // namespace

// Every cell a point of the segment lies in is visited, every visited cell is touched, in order;
// also for segments that start, end or lie outside the raster.
TEST_CASE("grid traversal visits the cells that dense sampling finds")
{
    std::mt19937 bits(7);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(bits()) / 4294967296.0;
    };
    for (int i = 0; i < 400; ++i) {
        const double reach_m = i % 2 == 0 ? 0.0 : 8.0;
        check_against_sampling(
            {uniform(-3 - reach_m, 7 + reach_m), uniform(5 - reach_m, 20 + reach_m)},
            {uniform(-3 - reach_m, 7 + reach_m), uniform(5 - reach_m, 20 + reach_m)});
    }
}

TEST_CASE("grid traversal copes with beams along the axes, on borders and through corners")
{
    for (const double offset_m : {0.0, 0.25, 0.5}) {
        check_against_sampling({-2.0, 10.0 + offset_m}, {6.0, 10.0 + offset_m});
        check_against_sampling({6.0, 10.0 + offset_m}, {-2.0, 10.0 + offset_m});
        check_against_sampling({2.0 + offset_m, 19.0}, {2.0 + offset_m, 1.0});
        check_against_sampling({-3.0 + offset_m, 5.0}, {7.0 + offset_m, 15.0}); // diagonal
        check_against_sampling({6.0, 6.0 + offset_m}, {-3.0, 15.0 + offset_m});
    }
    CHECK(cells_between({-2.0, 10.1}, {6.0, 10.1}).size() == 17);
}

TEST_CASE("a segment of no length is its own cell, one outside is none")
{
    CHECK(cells_between({2.1, 12.1}, {2.1, 12.1}) == std::vector<GridCell>{{10, 14}});
    CHECK(cells_between({50.0, 12.1}, {50.0, 12.1}).empty());
    CHECK(cells_between({-9.0, 0.0}, {9.0, 0.0}).empty());
    CHECK(cells_between({7.0, 6.0}, {7.0, 8.0}).empty()); // the upper border is outside
}

TEST_CASE("a thin beam frees what it passes, occupies its return and nothing else")
{
    for (double bearing_rad = -3.1; bearing_rad < 3.2; bearing_rad += 0.3) {
        OccupancyGrid grid(kRaster, GridModel());
        const GridBeam beam = beam_at(bearing_rad, 3.2, true);
        grid.insert_thin(beam);
        CHECK(grid.probability({beam.x_m, beam.y_m}) == doctest::Approx(0.4));
        CHECK(grid.probability(along(beam, 2.2, 0.0)) == doctest::Approx(0.4));
        CHECK(grid.probability(along(beam, 3.2, 0.0)) == doctest::Approx(0.7));
        CHECK(grid.probability(along(beam, 4.0, 0.0)) == 0.5);
        CHECK(grid.probability(along(beam, 2.0, 1.5)) == 0.5);
    }
}

TEST_CASE("a beam without return occupies nothing")
{
    OccupancyGrid thin(kRaster, GridModel()), wide(kRaster, GridModel());
    thin.insert_thin(beam_at(0.4, 4.0, false));
    wide.insert_wide(beam_at(0.4, 4.0, false));
    for (double way_m = -6.0; way_m < 6.0; way_m += 0.1) {
        const gpom_point_t point = along(beam_at(0.4, 4.0, false), way_m, 0.0);
        CHECK(thin.probability(point) <= 0.5);
        CHECK(wide.probability(point) <= 0.5);
    }
    CHECK(thin.probability(along(beam_at(0.4, 4.0, false), 3.9, 0.0)) < 0.5);
}

// Half a width of 0.2 rad is 0.6 m across at 3 m.
TEST_CASE("a widened beam covers its cone, weaker away from the axis, and no more")
{
    const gpom_raster_t fine{-3.0, 5.0, 0.1, 100, 150};
    for (double bearing_rad = -3.1; bearing_rad < 3.2; bearing_rad += 0.3) {
        OccupancyGrid grid(fine, GridModel());
        const GridBeam beam = beam_at(bearing_rad, 4.0, true);
        grid.insert_wide(beam);
        const double axis = grid.probability(along(beam, 3.0, 0.0));
        const double side = grid.probability(along(beam, 3.0, 0.4));
        CHECK(axis == doctest::Approx(0.4).epsilon(0.02));
        CHECK(side > axis);
        CHECK(side < 0.5);
        CHECK(grid.probability(along(beam, 3.0, 0.75)) == 0.5);
        CHECK(grid.probability(along(beam, 4.0, 0.0)) > 0.68);
        CHECK(grid.probability(along(beam, 3.97, 0.5)) > 0.5);
        CHECK(grid.probability(along(beam, 4.2, 0.0)) == 0.5);
        CHECK(grid.probability(along(beam, -0.3, 0.0)) == 0.5);
    }
}

// The formula of insert_wide(), for each cell of the raster.
TEST_CASE("a widened beam changes just the cells that its description names")
{
    std::mt19937 bits(3);
    const GridModel model;
    for (int i = 0; i < 60; ++i) {
        const double quarter_rad = 0.5 * std::acos(-1.0);
        const double bearing_rad =
            i < 8 ? i * quarter_rad : static_cast<double>(bits() % 6283) * 1e-3;
        GridBeam beam = beam_at(bearing_rad, 0.5 + 0.17 * (i % 40), i % 3 != 0);
        beam.half_width_rad = 0.3 * (i % 4);
        OccupancyGrid grid(kRaster, model);
        grid.insert_wide(beam);
        for (std::uint32_t n = 0; n < kRaster.nx * kRaster.ny; ++n) {
            const gpom_point_t centre = {kRaster.x0_m + (n % kRaster.nx + 0.5) * kRaster.cell_m,
                                         kRaster.y0_m + (n / kRaster.nx + 0.5) * kRaster.cell_m};
            CHECK(grid.probability(centre) ==
                  doctest::Approx(widened(beam, centre, kRaster.cell_m, model)).epsilon(1e-5));
        }
    }
}

// However far from the axis' direction the cells lie: no gap, even with no width at all.
TEST_CASE("a widened beam of no width still leaves no gap along its way")
{
    for (double bearing_rad = -3.1; bearing_rad < 3.2; bearing_rad += 0.1) {
        OccupancyGrid grid(kRaster, GridModel());
        GridBeam beam = beam_at(bearing_rad, 4.0, false);
        beam.half_width_rad = 0.0;
        grid.insert_wide(beam);
        std::size_t n_free = 0;
        for (double way_m = 0.0; way_m < 4.0; way_m += 0.02) {
            n_free += grid.probability(along(beam, way_m, 0.0)) < 0.5 ? 1 : 0;
        }
        CHECK(n_free >= 150); // of 200; cells cut at a corner have their centre off the way
    }
}

TEST_CASE("evidence adds up in log odds and stops at the clamps")
{
    const GridModel model;
    OccupancyGrid grid(kRaster, model);
    const GridBeam beam = beam_at(0.0, 3.2, true);
    grid.insert_thin(beam);
    grid.insert_thin(beam);
    CHECK(grid.probability(along(beam, 3.2, 0.0)) == doctest::Approx(0.49 / (0.49 + 0.09)));
    for (int i = 0; i < 100; ++i) {
        grid.insert_thin(beam);
    }
    CHECK(grid.probability(along(beam, 3.2, 0.0)) == doctest::Approx(model.p_max));
    CHECK(grid.probability(along(beam, 1.0, 0.0)) == doctest::Approx(model.p_min));
}

TEST_CASE("nothing is known outside the raster, and beams may leave it")
{
    OccupancyGrid grid(kRaster, GridModel());
    grid.insert_thin(beam_at(1.0, 200.0, true));
    grid.insert_wide(beam_at(1.0, 200.0, true));
    CHECK(grid.probability({100.0, 100.0}) == 0.5);
    CHECK(grid.probability({kNaN, 6.0}) == 0.5);
    CHECK(grid.probability(along(beam_at(1.0, 200.0, true), 2.0, 0.0)) < 0.5);
    CHECK_THROWS_AS(OccupancyGrid({0, 0, 0.1, 100000, 100000}, GridModel()), std::runtime_error);
    CHECK_THROWS_AS(raster_over({0, 0}, {1e9, 1}, 0.01, 0.0), std::runtime_error);
}

TEST_CASE("beams are returns up to the maximum range, and bad readings are none")
{
    const auto inf = std::numeric_limits<float>::infinity();
    const auto beams = beams_of(
        {scan_of({static_cast<float>(kNaN), -1.0f, 0.0f, 4.0f, 30.0f, inf})}, kHalfSpacing);
    REQUIRE(beams.size() == 3);
    CHECK(beams[0].hit);
    CHECK(beams[0].bearing_rad == doctest::Approx(0.5 - 0.25 + 3 * 0.25));
    CHECK(beams[0].half_width_rad == doctest::Approx(0.125));
    CHECK_FALSE(beams[1].hit);
    CHECK_FALSE(beams[2].hit);
    CHECK(beams[2].range_m == 30.0);
}

// Training and held-out beams share nothing.
TEST_CASE("a log is split into beams for the map and beams to judge it")
{
    std::vector<Scan> scans(200, scan_of({0.04f, 4.0f, 5.0f, 30.0f, 6.0f, 7.0f, 8.0f}));
    const LogSplit split = split_log(scans, 0.25, 3);
    std::size_t n_training = 0, n_others = 0;
    for (std::size_t s = 0; s < scans.size(); ++s) {
        for (std::size_t i = 0; i < scans[s].ranges_m.size(); ++i) {
            const bool trains = !std::isnan(split.training[s].ranges_m[i]);
            const bool judges = !std::isnan(split.others[s].ranges_m[i]);
            const bool usable = i != 0 && i != 3;
            CHECK(trains + judges == (usable ? 1 : 0));
            n_training += trains ? 1 : 0;
            n_others += judges ? 1 : 0;
        }
    }
    CHECK(n_training > 200);
    CHECK(n_training < 300);
    REQUIRE(split.points.size() == n_others / 2 * 2);
    CHECK_THROWS_AS(split_log(scans, 0.0, 3), std::runtime_error);
    CHECK_THROWS_AS(split_log(scans, 1.0, 3), std::runtime_error);
}

// A beam of scan_of() is told by its bearing.
TEST_CASE("a log's test points reach up to the return, half of the free ones in the band")
{
    const std::vector<float> ranges_m{4.0f, 5.0f, 6.0f, 7.0f, 8.0f, 0.3f};
    const LogSplit split = split_log(std::vector<Scan>(400, scan_of(ranges_m)), 0.25, 3);
    double n_free = 0.0, n_band = 0.0, n_last = 0.0, before_expected = 0.0;
    for (const TestPoint &point : split.points) {
        const double dx_m = point.at.x_m - 1.0, dy_m = point.at.y_m - 2.0;
        const auto i =
            static_cast<std::size_t>(std::lround((std::atan2(dy_m, dx_m) - 0.25) / 0.25));
        REQUIRE(i < ranges_m.size());
        const double before_m = double{ranges_m[i]} - std::hypot(dx_m, dy_m);
        CHECK(point.in_band == (std::abs(before_m) <= kBand));
        if (point.occupied) {
            CHECK(before_m == doctest::Approx(-0.05).epsilon(1e-6));
            continue;
        }
        CHECK(before_m >= 0.05 - 1e-6);
        CHECK(before_m <= double{ranges_m[i]});
        n_free += 1.0;
        n_band += point.in_band ? 1.0 : 0.0;
        n_last += before_m < 0.275 ? 1.0 : 0.0;
        before_expected += ranges_m[i] < 1.0f ? 1.0 : 0.5 + 0.5 * 0.45 / (ranges_m[i] - 0.05f);
    }
    CHECK(n_band / n_free == doctest::Approx(before_expected / n_free).epsilon(0.05));
    CHECK(n_last / n_band > 0.45); // as many in either half of the band; the short beam has one
    CHECK(n_last / n_band < 0.75);
}

TEST_CASE("free points lie between the sensor and 5 cm before the return, however short the beam")
{
    CHECK(free_distance(4.0, false, 0.0) == 0.0);
    CHECK(free_distance(4.0, false, 1.0) == doctest::Approx(3.95));
    CHECK(free_distance(4.0, true, 0.0) == doctest::Approx(3.5));
    CHECK(free_distance(4.0, true, 1.0) == doctest::Approx(3.95));
    CHECK(free_distance(0.3, true, 0.0) == 0.0);
    CHECK(free_distance(0.3, true, 1.0) == doctest::Approx(0.25));
    CHECK(free_distance(0.04, false, 1.0) == 0.0);
}

TEST_CASE("at most n scans are taken, evenly, with the first and the last")
{
    std::vector<Scan> scans(10, scan_of({1.0f}));
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].t_s = static_cast<double>(i);
    }
    const auto taken = evenly_taken(scans, 4);
    REQUIRE(taken.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(taken[i].t_s == 3.0 * static_cast<double>(i));
    }
    CHECK(evenly_taken(scans, 600).size() == 10);
}

TEST_CASE("near a beam means near its hit, its origin or anything between")
{
    const std::vector<GridBeam> beams = {beam_at(0.7, 10.0, true)};
    CHECK(is_near(along(beams[0], 5.0, 4.99), beams, kNearBeam));
    CHECK_FALSE(is_near(along(beams[0], 5.0, 5.01), beams, kNearBeam));
    CHECK(is_near(along(beams[0], 14.99, 0.0), beams, kNearBeam));
    CHECK_FALSE(is_near(along(beams[0], 15.01, 0.0), beams, kNearBeam));
    CHECK(is_near(along(beams[0], -4.99, 0.0), beams, kNearBeam));
    CHECK_FALSE(is_near(along(beams[0], -3.6, 3.6), beams, kNearBeam));
}

TEST_CASE("street test points are cell centres with the truth's own answer")
{
    Truth truth{10.0, 20.0, 0.5, 4, 2, {1, 0, 0, 0, 0, 0, 1, 0}};
    std::size_t n_occupied = 0;
    for (const TestPoint &point : street_points(truth, 4000, 1)) {
        const double u = (point.at.x_m - 10.0) / 0.5 - 0.5, v = (point.at.y_m - 20.0) / 0.5 - 0.5;
        CHECK(u == std::round(u));
        CHECK(point.occupied == truth.at(static_cast<int>(u), static_cast<int>(v)));
        n_occupied += point.occupied ? 1 : 0;
    }
    CHECK(n_occupied > 850);
    CHECK(n_occupied < 1150);
}
