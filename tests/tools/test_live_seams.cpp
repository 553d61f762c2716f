// gpom-live seams: what counts as a jump, against maps whose jumps are known.
#include "tools/live/seams.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace
{

using namespace gpom_tools;

/// Probability .2 on one side of each line x = k * 0.3 m and .6 on the other.
std::vector<double> stripes(const std::vector<gpom_point_t> &places)
{
    std::vector<double> p;
    for (const gpom_point_t &at : places) {
        const auto i = static_cast<long long>(std::floor(at.x_m / 0.3));
        p.push_back(i % 2 == 0 ? 0.2 : 0.6);
    }
    return p;
}

/// Rises and falls between 0 and 1 by 30 / m along x: .06 in 2 mm, at no place a jump.
std::vector<double> ramps(const std::vector<gpom_point_t> &places)
{
    std::vector<double> p;
    for (const gpom_point_t &at : places) {
        const double phase = at.x_m * 15.0;
        p.push_back(2.0 * std::abs(phase - std::floor(phase) - 0.5));
    }
    return p;
}

std::vector<gpom_point_t> scattered(std::size_t n)
{
    ProtocolRandom random(5);
    std::vector<gpom_point_t> middles;
    for (std::size_t i = 0; i < n; ++i) {
        middles.push_back({20.0 * random.uniform() - 10.0, 20.0 * random.uniform() - 10.0});
    }
    return middles;
}

TEST_CASE("every step of a map of stripes is a difference and a jump of its height")
{
    const std::size_t n_lines = 400;
    const Seams seams = seams_of(stripes, scattered(n_lines), 1);
    CHECK(seams.n_lines == n_lines);
    CHECK(seams.differences.largest == doctest::Approx(0.4));
    CHECK(seams.jumps.largest == doctest::Approx(0.4));
    for (std::size_t i = 0; i < std::size(kSeamBounds); ++i) {
        CHECK(seams.jumps.n_over[i] == seams.differences.n_over[i]);
    }
    // A line of 1 m crosses 2 / (pi 0.3) of them on average (Buffon): 849 of 400 lines; a fifth
    // more or less is seven standard deviations.
    CHECK(seams.jumps.n_over[2] > 680);
    CHECK(seams.jumps.n_over[2] < 1020);
}

TEST_CASE("a steep slope is a difference but no jump")
{
    const Seams seams = seams_of(ramps, scattered(200), 1);
    CHECK(seams.differences.n_over[1] > 1000);
    CHECK(seams.differences.largest == doctest::Approx(0.06).epsilon(0.01));
    CHECK(seams.jumps.n_over[0] == 0);
    CHECK(seams.jumps.largest == doctest::Approx(0.06 / kSeamParts).epsilon(0.01));
}

TEST_CASE("the same seed gives the same lines, another seed others")
{
    const Seams first = seams_of(stripes, scattered(50), 1);
    CHECK(seams_of(stripes, scattered(50), 1).jumps.n_over[0] == first.jumps.n_over[0]);
    CHECK(seams_of(stripes, scattered(50), 2).jumps.n_over[0] != first.jumps.n_over[0]);
}

} // namespace
