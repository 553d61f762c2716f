#include "tests/common/surface_oracle.hpp"
#include "tools/eval/occupancy_grid.hpp"
#include "tools/eval/profile.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

namespace
{

using namespace gpom_tools;

/// Beams with returns, each from a place of its own, ten metres apart.
std::vector<GridBeam> beams_apart(std::size_t n, double range_m)
{
    std::vector<GridBeam> beams;
    for (std::size_t i = 0; i < n; ++i) {
        beams.push_back(
            {10.0 * static_cast<double>(i), 1.0, 0.5 * std::acos(-1.0), range_m, true, 0.0});
    }
    return beams;
}

/// What a map says that knows the offset alone.
Profile profile_by(const std::function<double(double)> &probability)
{
    std::vector<ProfilePlace> places;
    std::vector<double> probabilities;
    for (std::size_t i = 0; i < kProfileOffsets.size(); ++i) {
        for (int copy = 0; copy < 3; ++copy) {
            places.push_back({{0.0, 0.0}, i});
            probabilities.push_back(probability(kProfileOffsets[i]));
        }
    }
    return profile_of(places, probabilities);
}

/// Occupied beyond x = 6 but for a free alley at y 4 .. 5.
Truth wall_with_alley()
{
    Truth truth{0.0, 0.0, 0.25, 40, 40, {}};
    for (int y = 0; y < truth.ny; ++y) {
        for (int x = 0; x < truth.nx; ++x) {
            truth.occupied.push_back(x >= 24 && (y < 16 || y >= 20) ? 1 : 0);
        }
    }
    return truth;
}

} // namespace

TEST_CASE("a profile's places lie at the offsets along their beams")
{
    const auto places = profile_along(beams_apart(50, 4.0), 0);
    REQUIRE(places.size() == 50 * kProfileOffsets.size());
    std::set<long> beams;
    for (const ProfilePlace &place : places) {
        CHECK(place.at.y_m - 1.0 - 4.0 == doctest::Approx(kProfileOffsets[place.i_offset]));
        CHECK(place.at.x_m == doctest::Approx(10.0 * std::round(place.at.x_m / 10.0)));
        beams.insert(std::lround(place.at.x_m / 10.0));
    }
    CHECK(beams.size() == 50);
}

TEST_CASE("a place before the sensor is left out, and beams without a return")
{
    auto beams = beams_apart(20, 0.3);
    beams[0].hit = false;
    std::vector<std::size_t> counts(kProfileOffsets.size(), 0);
    for (const ProfilePlace &place : profile_along(beams, 0)) {
        CHECK(place.at.y_m > 1.0);
        ++counts[place.i_offset];
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
        CHECK(counts[i] == (kProfileOffsets[i] > -0.3 ? 19 : 0));
    }
}

TEST_CASE("of many returns a profile takes 3000, each once, chosen by the seed")
{
    const auto beams = beams_apart(3500, 4.0);
    const auto beams_of_seed = [&](std::uint64_t seed) {
        std::set<long> chosen;
        for (const ProfilePlace &place : profile_along(beams, seed)) {
            chosen.insert(std::lround(place.at.x_m / 10.0));
        }
        return chosen;
    };
    CHECK(beams_of_seed(0).size() == 3000);
    CHECK(beams_of_seed(0) == beams_of_seed(0));
    CHECK(beams_of_seed(0) != beams_of_seed(1));
}

TEST_CASE("a profile has means, shares and the crossing of one half")
{
    // 0.2 up to -0.1 m, then 3 a metre: 0.5 at 0 would be on an offset, so shifted by 0.02 m.
    const Profile profile = profile_by(
        [](double offset_m) { return std::clamp(0.5 + 3.0 * (offset_m - 0.02), 0.2, 0.8); });
    REQUIRE(profile.rows.size() == kProfileOffsets.size());
    for (const ProfileRow &row : profile.rows) {
        const double p = std::clamp(0.5 + 3.0 * (row.offset_m - 0.02), 0.2, 0.8);
        CHECK(row.n_places == 3);
        CHECK(row.mean_probability == doctest::Approx(p));
        CHECK(row.share_free == (p <= 0.3 ? 1.0 : 0.0));
        CHECK(row.share_occupied == (p >= 0.7 ? 1.0 : 0.0));
    }
    REQUIRE(profile.crossing_m);
    CHECK(*profile.crossing_m == doctest::Approx(0.02));
}

TEST_CASE("what never rises to one half, or is there from the start, has no crossing")
{
    CHECK_FALSE(profile_by([](double) { return 0.49; }).crossing_m);
    CHECK_FALSE(profile_by([](double) { return 0.51; }).crossing_m);
    CHECK_FALSE(profile_by([](double offset_m) { return offset_m < 0.0 ? 0.6 : 0.4; }).crossing_m);
    CHECK_FALSE(profile_of({}, {}).crossing_m);
    // It falls again behind the surface: the first rise counts.
    const Profile peak = profile_by([](double offset_m) {
        return offset_m < -0.01 ? 0.4 : offset_m < 0.07 ? 0.6 : 0.1;
    });
    REQUIRE(peak.crossing_m);
    CHECK(*peak.crossing_m == doctest::Approx(-0.025));
}

TEST_CASE("an offset without a place is left out and bridged")
{
    const Profile profile = profile_of({{{0, 0}, 0}, {{0, 0}, 6}}, {0.0, 1.0});
    REQUIRE(profile.rows.size() == 2);
    CHECK(profile.rows[0].offset_m == -1.0);
    CHECK(profile.rows[1].offset_m == 0.0);
    CHECK(*profile.crossing_m == doctest::Approx(-0.5));
}

// One return in a cell is 0.7 by OctoMap's constants, but not to the last bit.
TEST_CASE("the bounds of free and occupied belong to them")
{
    OccupancyGrid grid({0.0, 0.0, 0.5, 10, 10}, {0.7, 0.3, 0.01, 0.99});
    grid.insert_thin({0.25, 0.25, 0.0, 3.0, true, 0.0});
    const Profile profile =
        profile_of({{{0, 0}, 0}, {{0, 0}, 9}},
                   {grid.probability({1.25, 0.25}), grid.probability({3.25, 0.25})});
    CHECK(profile.rows[0].share_free == 1.0);
    CHECK(profile.rows[1].share_occupied == 1.0);
}

// The robot beside the alley sees the wall's face and the alley's far side, not its near one.
TEST_CASE("a street's profile goes by the signed distance from surfaces in view")
{
    const Truth truth = wall_with_alley();
    const Scan scan{0.0, 2.0, 2.0, 0.0, -1.4, 0.1, 20.0, std::vector<float>(29, 4.0f)};
    std::vector<std::size_t> faces(kProfileOffsets.size(), 0), sides = faces;
    for (const ProfilePlace &place : profile_across(truth, {scan}, 3)) {
        const double offset_m = kProfileOffsets[place.i_offset];
        CHECK(brute_distance(truth, place.at) == doctest::Approx(offset_m).epsilon(1e-9));
        const bool at_face = std::abs(place.at.x_m - 6.0 - offset_m) < 1e-9;
        CHECK((at_face || std::abs(place.at.y_m - 5.0 - offset_m) < 1e-9));
        ++(at_face ? faces : sides)[place.i_offset];
    }
    CHECK(faces[6] == 36); // sides of 0.25 m, all in view
    CHECK(faces[0] == 36);
    CHECK(faces[9] < 36); // places near the corners are nearer to the alley
    CHECK(faces[9] > 32);
    CHECK(sides[6] == 8); // up to x = 8, by the line of sight past the corner at (6, 4)
    CHECK(sides[0] == 0); // the alley is 1 m wide: in its middle no place is 1 m off a surface
    CHECK(profile_across(truth, {}, 3).empty());
}
