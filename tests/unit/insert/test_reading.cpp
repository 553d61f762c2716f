// What a reading of a sensor means: a hit, free space, nothing; and which counter tells it.
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

gpom_config_t map_config(std::uint32_t beam_max = 256)
{
    return config_of(params_of(GPOM_KERNEL_MATERN12), beam_max);
}

/// A scan of one range at bearing 0.
TestScan single(float range_m)
{
    TestScan s;
    s.ranges_m = {range_m};
    return s;
}

/// Insert into an empty map and expect one counter of beams to move, by one. Returns its beams.
std::vector<gpom_beam_t> counted(const TestScan &s, std::uint64_t gpom_stats_t::*counter)
{
    TestMap map(map_config());
    REQUIRE(s.insert_into(map.get()) == GPOM_OK);
    gpom_stats_t expected = {};
    expected.scans_inserted = 1;
    ++(expected.*counter);
    const gpom_stats_t stats = map.stats();
    CHECK(std::memcmp(&stats, &expected, sizeof stats) == 0);
    CHECK(gpom_map_beam_count(map.get()) == expected.beams_hit + expected.beams_no_return);
    return map.beams();
}

} // namespace

// Every kind of reading goes where the header says and moves exactly its own counter.
TEST_CASE("every kind of bad reading has its counter")
{
    using Counter = std::uint64_t gpom_stats_t::*;
    const struct {
        float range_m;
        Counter counter;
    } table[] = {{kNan, &gpom_stats_t::beams_nan},
                 {-kNan, &gpom_stats_t::beams_nan},
                 {0.0f, &gpom_stats_t::beams_not_positive},
                 {-0.0f, &gpom_stats_t::beams_not_positive},
                 {-1.0f, &gpom_stats_t::beams_not_positive},
                 {-kInf, &gpom_stats_t::beams_not_positive},
                 {-1e-45f, &gpom_stats_t::beams_not_positive},
                 {1e-45f, &gpom_stats_t::beams_too_near},
                 {step_float(0.5f, -1), &gpom_stats_t::beams_too_near},
                 {0.5f, &gpom_stats_t::beams_hit},
                 {7.0f, &gpom_stats_t::beams_hit},
                 {step_float(20.0f, -1), &gpom_stats_t::beams_hit},
                 {20.0f, &gpom_stats_t::beams_no_return},
                 {1e30f, &gpom_stats_t::beams_no_return},
                 {kInf, &gpom_stats_t::beams_no_return}};
    for (const auto &row : table) {
        CAPTURE(row.range_m);
        TestScan s = single(row.range_m);
        s.sensor.range_min_m = 0.5f;
        s.sensor.range_max_m = 20.0f;
        counted(s, row.counter);
    }
}

// Drivers that cannot say "no return" send 0, or something less than the minimum.
TEST_CASE("readings of 0 and too near ones are no return where the sensor says so")
{
    const struct {
        float range_m;
        bool is_zero, is_too_near; ///< No return.
        std::uint64_t gpom_stats_t::*counter;
    } table[] = {{0.0f, false, true, &gpom_stats_t::beams_not_positive},
                 {0.0f, true, false, &gpom_stats_t::beams_no_return},
                 {-0.0f, true, false, &gpom_stats_t::beams_no_return},
                 {-1.0f, true, true, &gpom_stats_t::beams_not_positive},
                 {-kInf, true, true, &gpom_stats_t::beams_not_positive},
                 {kNan, true, true, &gpom_stats_t::beams_nan},
                 {1e-30f, true, false, &gpom_stats_t::beams_too_near},
                 {1e-30f, false, true, &gpom_stats_t::beams_no_return},
                 {step_float(0.5f, -1), true, false, &gpom_stats_t::beams_too_near},
                 {step_float(0.5f, -1), true, true, &gpom_stats_t::beams_no_return},
                 {0.5f, true, true, &gpom_stats_t::beams_hit}};
    for (const auto &row : table) {
        CAPTURE(row.range_m);
        TestScan s = single(row.range_m);
        s.sensor.range_min_m = 0.5f;
        s.sensor.range_max_m = 12.0f;
        s.sensor.zero_is_no_return = row.is_zero ? 1 : 0;
        s.sensor.too_near_is_no_return = row.is_too_near ? 1 : 0;
        const std::vector<gpom_beam_t> beams = counted(s, row.counter);
        if (row.counter == &gpom_stats_t::beams_no_return) {
            REQUIRE(beams.size() == 1);
            CHECK(beams[0].is_hit == 0);
            CHECK(beams[0].is_free == 1);
            CHECK(beams[0].range_m == 12.0f);
        }
    }
}

TEST_CASE("a mask counts before no return, and readings of millimetres are no hit by default")
{
    TestScan s = single(0.0f);
    const gpom_mask_t all = {-3.2f, 3.2f};
    s.sensor.masks = &all;
    s.sensor.n_masks = 1;
    s.sensor.zero_is_no_return = 1;
    counted(s, &gpom_stats_t::beams_masked);
    counted(single(0.007f), &gpom_stats_t::beams_too_near);
    counted(single(0.02f), &gpom_stats_t::beams_hit);
}

// Any bits are allowed as ranges: each is counted exactly once and nothing else happens.
TEST_CASE("ranges of any bits are each counted once")
{
    GPOM_TELL_SEED();
    Random random(102);
    TestMap map(map_config(3000));
    TestScan s;
    s.sensor.range_min_m = 0.2f;
    s.sensor.zero_is_no_return = 1;
    s.sensor.too_near_is_no_return = 1;
    for (int i = 0; i < 5000; ++i) {
        const auto bits = static_cast<std::uint32_t>(random.bits());
        float range_m;
        std::memcpy(&range_m, &bits, sizeof range_m);
        s.ranges_m.push_back(range_m);
    }
    REQUIRE(s.insert_into(map.get()) == GPOM_OK);
    const gpom_stats_t n = map.stats();
    CHECK(n.beams_hit + n.beams_no_return + n.beams_nan + n.beams_not_positive + n.beams_too_near +
              n.beams_masked + n.beams_redundant ==
          5000);
    const std::uint64_t n_in = n.beams_hit + n.beams_no_return;
    CHECK(gpom_map_beam_count(map.get()) == n_in - gpom_stats_evicted(&n));
}
