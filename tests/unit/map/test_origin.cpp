// An origin that follows the robot, and poses that are wild.
#include "tests/common/keeping.hpp"
#include "tests/common/snapshot_medium.hpp"
#include "tests/common/sweep_fixture.hpp"

using namespace reference;

namespace
{

constexpr std::uint32_t kBeamMax = 600;

gpom_config_t following_config()
{
    gpom_config_t config = keep_config(2, kBeamMax);
    config.rebase_m = 20.0f;
    return config;
}

} // namespace

// Whatever the pose of the first scan, and whether or not it has a usable reading: the first good
// scan that is taken puts the origin beside the robot, queries there are within reach, and the
// snapshot can be read.
TEST_CASE("a wild first pose leaves no origin far from the robot")
{
    const gpom_config_t config = following_config();
    const Xy robot = {500000.25, 5000000.5};
    for (const double wild_m : {1e21, 1e17, 1e8, 9.99e7, -1e8, 3e12}) {
        for (const float range_m : {kNan, 5.0f}) {
            CAPTURE(wild_m);
            TestMap map(config);
            TestScan scan;
            scan.pose.x_m = wild_m;
            scan.ranges_m = {range_m, range_m};
            scan.angle_step_rad = 0.5;
            const gpom_status_t wild = scan.insert_into(map.get());
            CHECK(wild == (std::abs(wild_m) <= 1e8 ? GPOM_OK : GPOM_ERR_ARG));
            scan.pose = {robot.x, robot.y, 0.0, nullptr};
            scan.ranges_m = {5.0f, 5.0f};
            int n_refused = 0;
            while (scan.insert_into(map.get()) != GPOM_OK && n_refused < 10) {
                ++n_refused;
            }
            CHECK(n_refused <= 9);
            gpom_point_t origin = {};
            REQUIRE(gpom_map_origin(map.get(), &origin) == GPOM_OK);
            CHECK(std::hypot(origin.x_m - robot.x, origin.y_m - robot.y) <= 20.0);
            const Answers answers = query_points(map.get(), {{robot.x + 4.9, robot.y}});
            CHECK(answers.status == GPOM_OK);
            CHECK(answers.all[0].n_hits == 2);
            Medium medium(kBeamMax);
            REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
            TestMap copy(config);
            CHECK(read_snapshot(copy.get(), medium).status == GPOM_OK);
            CHECK(scan.insert_into(map.get()) == GPOM_OK);
        }
    }
}

// A map that a wild pose began comes to where the robot is: the tenth pose out of reach in a row is
// believed if each is within reach of the one before.
TEST_CASE("the tenth pose in a row far from the map is believed")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = following_config();
    Random random(164);
    const auto scan_at = [&](double x_m) { return yard_scan(random, 0, {x_m, 5e6}); };
    for (const bool is_sweep : {false, true}) {
        TestMap map(config);
        const auto see = [&](double x_m) {
            const TestScan scan = scan_at(x_m);
            return is_sweep ? TestSweep(scan).insert_into(map.get()) : scan.insert_into(map.get());
        };
        REQUIRE(see(9e7) == GPOM_OK);
        const std::uint32_t n_wild = gpom_map_beam_count(map.get());
        for (int i = 0; i < 30; ++i) { // no ten in a row, or not near each other
            CHECK(see(i % 10 == 9 ? 9e7 : 5e5) == (i % 10 == 9 ? GPOM_OK : GPOM_ERR_REACH));
            CHECK(see(5e5 + 9e3 * i) == GPOM_ERR_REACH);
        }
        CHECK(see(9e7) == GPOM_OK);
        TestSweep one = TestSweep(scan_at(5e5));
        for (int i = 0; i < 9; ++i) {
            CHECK(see(5e5 + i) == GPOM_ERR_REACH);
            one.poses.back().x_m = 9e7; // does not count
            CHECK(one.insert_into(map.get()) == GPOM_ERR_REACH);
        }
        CHECK(map.stats().beams_forgotten == 0);
        CHECK(see(5e5 + 9) == GPOM_OK);
        CHECK(map.stats().beams_forgotten >= n_wild);
        gpom_point_t origin = {};
        REQUIRE(gpom_map_origin(map.get(), &origin) == GPOM_OK);
        CHECK(std::abs(origin.x_m - 5e5) <= 20.0);
        for (const gpom_beam_t &beam : map.beams()) {
            CHECK(std::abs(beam.x_m - 5e5) <= 20.0);
        }
    }
}
