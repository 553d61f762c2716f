#include "tools/eval/octomap_rival.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/eval/strong_grid.hpp"

#include <doctest/doctest.h>
#include <octomap/octomap.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace
{

using namespace gpom_tools;

constexpr double kPi = 3.14159265358979323846;
constexpr float kNoReturn = std::numeric_limits<float>::infinity();

CellCounts random_counts(Eigen::Index n_rows, Eigen::Index n_columns, unsigned seed)
{
    std::mt19937 bits(seed);
    CellCounts counts(n_rows, n_columns);
    for (Eigen::Index i = 0; i < counts.size(); ++i) {
        counts(i / n_columns, i % n_columns) = static_cast<double>(bits() % 5);
    }
    return counts;
}

/// The definition, cell by cell, in two dimensions at once.
double convolved_at(const CellCounts &counts, Eigen::Index row, Eigen::Index column, double sigma)
{
    const auto reach = static_cast<Eigen::Index>(4.0 * sigma + 0.5);
    const auto weight = [sigma](Eigen::Index dx, Eigen::Index dy) {
        return std::exp(-0.5 * static_cast<double>(dx * dx + dy * dy) / (sigma * sigma));
    };
    double sum = 0.0, weights = 0.0;
    for (Eigen::Index dy = -reach; dy <= reach; ++dy) {
        for (Eigen::Index dx = -reach; dx <= reach; ++dx) {
            const Eigen::Index y = row + dy, x = column + dx;
            const bool inside = y >= 0 && x >= 0 && y < counts.rows() && x < counts.cols();
            weights += weight(dx, dy);
            sum += inside ? weight(dx, dy) * counts(y, x) : 0.0;
        }
    }
    return sum / weights;
}

double uniform(std::mt19937 &bits) { return static_cast<double>(bits()) / 4294967296.0; }

std::vector<LogisticSample> logistic_samples(const Logistic &truth, std::size_t n)
{
    std::mt19937 bits(7);
    std::vector<LogisticSample> samples;
    for (std::size_t i = 0; i < n; ++i) {
        const std::array<double, 2> x{4.0 * uniform(bits) - 2.0, 6.0 * uniform(bits) - 3.0};
        samples.push_back({x, uniform(bits) < truth.probability(x)});
    }
    return samples;
}

/// Beams from the origin to a round wall at 5 m.
std::vector<GridBeam> round_room(int n_beams)
{
    std::vector<GridBeam> beams;
    for (int i = 0; i < n_beams; ++i) {
        beams.push_back({0.0, 0.0, 2.0 * kPi * i / n_beams, 5.0, true, 0.0});
    }
    return beams;
}

gpom_point_t polar(double way_m, double bearing_rad)
{
    return {way_m * std::cos(bearing_rad), way_m * std::sin(bearing_rad)};
}

Scan scan_of(std::vector<float> ranges_m)
{
    return {0.0, 0.05, 0.05, 0.0, 0.0, 0.7, 8.0, std::move(ranges_m)};
}

} // namespace

// Two passes along the axes are the two-dimensional convolution, for reaches within and beyond
// the raster.
TEST_CASE("the blur is a convolution with zeros outside")
{
    for (const double sigma : {0.13, 0.8, 1.7, 9.0}) {
        const CellCounts counts = random_counts(17, 23, 3);
        const CellCounts smooth = blurred(counts, sigma);
        for (const Eigen::Index row : {0, 1, 8, 16}) {
            for (const Eigen::Index column : {0, 5, 11, 22}) {
                CHECK(smooth(row, column) ==
                      doctest::Approx(convolved_at(counts, row, column, sigma)).epsilon(1e-12));
            }
        }
    }
}

TEST_CASE("a blur of less than an eighth of a cell changes nothing")
{
    const CellCounts counts = random_counts(5, 4, 1);
    CHECK((blurred(counts, 0.12) == counts).all());
}

TEST_CASE("scaling recovers the logistic function that made the data")
{
    const Logistic truth{0.4, {1.5, -0.6}};
    const Logistic model = fit_logistic(logistic_samples(truth, 40000));
    CHECK(model.bias == doctest::Approx(truth.bias).epsilon(0.1));
    CHECK(model.weights[0] == doctest::Approx(truth.weights[0]).epsilon(0.05));
    CHECK(model.weights[1] == doctest::Approx(truth.weights[1]).epsilon(0.05));
}

// At the maximum the residuals are orthogonal to every feature, up to the weak prior.
TEST_CASE("scaling stops at the greatest likelihood")
{
    const auto samples = logistic_samples({-1.0, {0.5, 2.0}}, 500);
    const Logistic model = fit_logistic(samples);
    double by_bias = 0.0, by_w0 = 1e-3 * model.weights[0], by_w1 = 1e-3 * model.weights[1];
    for (const LogisticSample &s : samples) {
        const double residual = model.probability(s.x) - (s.occupied ? 1.0 : 0.0);
        by_bias += residual;
        by_w0 += residual * s.x[0];
        by_w1 += residual * s.x[1];
    }
    CHECK(std::abs(by_bias) < 1e-6);
    CHECK(std::abs(by_w0) < 1e-6);
    CHECK(std::abs(by_w1) < 1e-6);
}

TEST_CASE("scaling stays finite where a line parts the classes, and needs both")
{
    std::vector<LogisticSample> samples;
    for (int i = 1; i <= 20; ++i) {
        samples.push_back({{static_cast<double>(i), 1.0}, true});
        samples.push_back({{static_cast<double>(-i), 1.0}, false});
    }
    const Logistic model = fit_logistic(samples);
    CHECK(std::isfinite(model.bias));
    CHECK(model.probability({5.0, 1.0}) > 0.99);
    CHECK(model.probability({-5.0, 1.0}) < 0.01);
    CHECK_THROWS_AS(fit_logistic({{{1.0, 2.0}, true}}), std::runtime_error);
    CHECK_THROWS_AS(fit_logistic({}), std::runtime_error);
}

TEST_CASE("the strong grid knows a round room, in any direction")
{
    const StrongGrid grid(round_room(400), raster_over({-5, -5}, {5, 5}, 0.2, 2.0), {0.1, 0.2});
    CHECK(grid.left_out_nll() < 0.1);
    for (int i = 0; i < 30; ++i) {
        const double bearing_rad = 0.2 + 0.21 * i;
        CHECK(grid.probability(polar(5.05, bearing_rad)) > 0.8);
        CHECK(grid.probability(polar(4.0, bearing_rad)) < 0.02);
        CHECK(grid.probability(polar(1.0, bearing_rad)) < 0.02);
    }
    const double outside = grid.probability({1e6, 0.0});
    CHECK(outside > 0.0);
    CHECK(outside < 1.0);
}

// It learns up to 5 cm before returns: in cells of 5 cm it is sure of both sides of a surface.
TEST_CASE("the strong grid is as sharp as its cells")
{
    const StrongGrid grid(round_room(4000), raster_over({-5, -5}, {5, 5}, 0.05, 2.0),
                          {0.025, 0.05});
    for (int i = 0; i < 30; ++i) {
        const double bearing_rad = 0.2 + 0.21 * i;
        CHECK(grid.probability(polar(4.85, bearing_rad)) < 0.3);
        CHECK(grid.probability(polar(5.05, bearing_rad)) > 0.7);
    }
}

// A blur of 5 m would drown the wall: the beams left out must vote against it.
TEST_CASE("the strong grid takes the blur that suits the beams left out")
{
    const gpom_raster_t raster = raster_over({-5, -5}, {5, 5}, 0.2, 2.0);
    const StrongGrid both(round_room(400), raster, {5.0, 0.2});
    const StrongGrid coarse(round_room(400), raster, {5.0});
    CHECK(both.sigma_m() == 0.2);
    CHECK(both.left_out_nll() < coarse.left_out_nll());
    CHECK_THROWS_AS(StrongGrid({}, raster, {0.2}), std::runtime_error);
}

// The scan has one return at 3 m: octomap's own ray into a tree of its own must agree everywhere.
TEST_CASE("a return in OctoMap is what OctoMap's own ray makes of it")
{
    OctomapRival map(0.1, {0.0, 0.0});
    map.insert(scan_of({3.0f}));
    octomap::OcTree tree(0.1);
    tree.insertRay({0.05f, 0.05f, 0.0f}, {3.05f, 0.05f, 0.0f});
    for (double x_m = -0.35; x_m < 4.0; x_m += 0.1) {
        for (const double y_m : {-0.05, 0.05, 0.15}) {
            const auto *const leaf =
                tree.search(octomap::point3d(static_cast<float>(x_m), static_cast<float>(y_m), 0));
            CHECK(map.probability({x_m, y_m}) == (leaf != nullptr ? leaf->getOccupancy() : 0.5));
        }
    }
    CHECK(map.probability({3.06, 0.05}) == doctest::Approx(0.7));
    CHECK(map.probability({1.5, 0.05}) == doctest::Approx(0.4));
    CHECK(map.probability({3.35, 0.05}) == 0.5);
}

TEST_CASE("a beam without return is free up to the usable range and ends in nothing")
{
    for (const float range_m : {kNoReturn, 9.0f}) {
        OctomapRival map(0.1, {20.0, -10.0});
        map.insert(scan_of({range_m, std::nanf("")}));
        CHECK(map.probability({7.75, 0.05}) == doctest::Approx(0.4));
        for (double x_m = 0.1; x_m < 12.0; x_m += 0.05) {
            CHECK(map.probability({x_m, 0.05}) <= 0.5);
            CHECK((x_m < 8.2 || map.probability({x_m, 0.05}) == 0.5));
        }
    }
}
