// Beams that begin late in crowded space (live.h, gpom_map_begin_late()).
#include "gpom/live.h"
#include "tests/common/keeping.hpp"

using namespace reference;

namespace
{

constexpr double kLate_m = 0.25;

/// A free segment in double precision.
struct Free {
    Xy at, dir;
    double length_m;
};

Free free_of(const gpom_beam_t &b, double gap_m)
{
    const double length_m = static_cast<double>(b.range_m) - (b.returned == 1 ? gap_m : 0.0);
    return {{b.x_m, b.y_m}, {static_cast<double>(b.dir_x), static_cast<double>(b.dir_y)}, length_m};
}

/// True if a segment passes a place nearer than reach_m, with the foot of the perpendicular on it.
/// `slack` > 0 makes the test more generous, `slack` < 0 stricter.
bool passes(const Free &s, Xy at, double reach_m, double slack)
{
    const double x = at.x - s.at.x, y = at.y - s.at.y;
    const double along = x * s.dir.x + y * s.dir.y;
    const double across = std::abs(x * s.dir.y - y * s.dir.x);
    return across < reach_m + slack && along > -slack && along < s.length_m + slack;
}

/// How much of a free segment is kept, from the rule in live.h.
double length_kept(const Free &own, const std::vector<Free> &others, double least_m, double slack)
{
    for (int i = 0; (i + 1) * kLate_m <= own.length_m; ++i) {
        const double back = own.length_m - (i + 0.5) * kLate_m;
        const Xy centre = {own.at.x + back * own.dir.x, own.at.y + back * own.dir.y};
        const auto n = std::count_if(others.begin(), others.end(), [&](const Free &s) {
            return passes(s, centre, 0.5 * kLate_m, slack);
        });
        if (n >= 2) {
            return std::min(own.length_m, std::max(i * kLate_m, least_m));
        }
    }
    return own.length_m;
}

TestScan random_look(Random &random, int i)
{
    const double range_m = i % 5 == 0 ? static_cast<double>(kInf) : random.uniform(0.3, 9.0);
    return look({random.uniform(-5, 5), random.uniform(-5, 5)}, random.uniform(-4, 4), range_m, i);
}

} // namespace

// Sensor, direction and range of each beam are known, and so are the beams before it: the rule says
// in double precision where the beam begins. Beams for which a micrometre decides are left out.
TEST_CASE("a beam begins late where two kept free segments pass its way")
{
    GPOM_TELL_SEED();
    Random random(1901);
    const gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 400);
    Keeping k(config);
    REQUIRE(gpom_map_begin_late(k.map.get(), static_cast<float>(kLate_m)) == GPOM_OK);
    const auto gap_m = static_cast<double>(config.params.gap_m);
    int n_late = 0, n_told = 0;
    for (int i = 0; i < 300; ++i) {
        std::vector<Free> others;
        for (const gpom_beam_t &b : k.map.beams()) {
            others.push_back(free_of(b, gap_m));
        }
        if (i == 150) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        const TestScan scan = random_look(random, i);
        REQUIRE(k.see(scan).beams_known == 0);
        const gpom_beam_t b = k.beam(static_cast<std::uint32_t>(i));
        const bool returned = b.returned == 1;
        const double range_m =
            static_cast<double>(returned ? scan.ranges_m[0] : scan.sensor.range_max_m);
        const Xy dir = {std::cos(scan.pose.yaw_rad), std::sin(scan.pose.yaw_rad)};
        const Free own = {{scan.pose.x_m, scan.pose.y_m}, dir, range_m - (returned ? gap_m : 0.0)};
        const double strict = length_kept(own, others, 12.0 * kLate_m, -1e-4);
        const double lax = length_kept(own, others, 12.0 * kLate_m, 1e-4);
        const auto far = static_cast<double>(b.range_m);
        CHECK(b.x_m + far * dir.x == doctest::Approx(own.at.x + range_m * dir.x).epsilon(1e-5));
        CHECK(b.y_m + far * dir.y == doctest::Approx(own.at.y + range_m * dir.y).epsilon(1e-5));
        if (strict == lax) {
            const double start_m = own.length_m - strict;
            CHECK(far == doctest::Approx(range_m - start_m).epsilon(1e-5));
            CHECK(std::hypot(b.x_m - own.at.x, b.y_m - own.at.y) ==
                  doctest::Approx(start_m).epsilon(1e-4));
            ++n_told;
            n_late += start_m > 0.0 ? 1 : 0;
        }
    }
    CHECK(n_told > 250);
    CHECK(n_late > 50);
}

// Two beams cross the way of a third 0.3 m before its end. What is just before a hit stays whatever
// crowds there, and a hit nearer than 2 keep_m to where its beam begins would refuse no beams.
TEST_CASE("a late start keeps the last 12 cells and the last 2 keep_m of a free segment")
{
    for (const float late_m : {0.01f, 0.05f, 0.1f, 0.2f}) {
        const gpom_config_t config = keep_config(3);
        Keeping k(config);
        REQUIRE(gpom_map_begin_late(k.map.get(), late_m) == GPOM_OK);
        k.see(look({4.6957, -3.0}, 0.5 * kPi, 6.0, 0));
        k.see(look({4.6962, 2.9}, -0.5 * kPi, 6.1, 1));
        k.see(look({0.0, 0.0}, 0.0, 5.0, 2));
        const gpom_beam_t b = k.beam(2);
        const float least_m = std::max(2.0f * kKeep_m, 12.0f * late_m);
        CHECK(b.range_m == doctest::Approx(least_m + config.params.gap_m).epsilon(1e-5));
        CHECK(b.x_m + static_cast<double>(b.range_m) == doctest::Approx(5.0));
    }
}

TEST_CASE("beams begin at the sensor once late starts are turned off")
{
    const gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 100);
    Keeping k(config);
    REQUIRE(gpom_map_begin_late(k.map.get(), 0.1f) == GPOM_OK);
    for (int i = 0; i < 20; ++i) {
        k.see(look({0.0, 0.0}, 0.0, 8.0, i));
    }
    CHECK(k.beam(19).range_m < 2.0f);
    REQUIRE(gpom_map_begin_late(k.map.get(), 0.0f) == GPOM_OK);
    k.see(look({0.0, 0.0}, 0.0, 8.0, 20));
    CHECK(k.beam(20).range_m == 8.0f);
    CHECK(k.beam(20).x_m == 0.0);
}

TEST_CASE("late starts refuse a cell that is no length")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12), 100));
    for (const float bad : {-1.0f, 1e-4f, 2e3f, kInf, std::nanf("")}) {
        CHECK(gpom_map_begin_late(map.get(), bad) == GPOM_ERR_ARG);
    }
    CHECK(gpom_map_begin_late(nullptr, 0.1f) == GPOM_ERR_ARG);
}
