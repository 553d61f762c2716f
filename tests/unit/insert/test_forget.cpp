// Forgetting regions, jumps of the frame, and an origin that follows the robot.
#include "tests/common/keeping.hpp"
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

namespace
{

/// What is known along a beam, by distances from where it started at first.
struct Known {
    double free_from_m, free_to_m; ///< No more than `from`: nothing is free.
    bool has_hit;
};

Known known_of(const gpom_beam_t &beam, Xy start, double gap_m)
{
    const double moved_m = (beam.x_m - start.x) * static_cast<double>(beam.dir_x) +
                           (beam.y_m - start.y) * static_cast<double>(beam.dir_y);
    const double range_m = static_cast<double>(beam.range_m);
    const double free_m = beam.returned != 0 ? range_m - gap_m : range_m;
    return {moved_m, beam.is_free != 0 ? moved_m + std::max(free_m, 0.0) : moved_m,
            beam.is_hit != 0};
}

/// Where a beam runs in a disc, by distances along it; `is_clear` falls where rounding may decide.
struct Crossing {
    double enter_m, leave_m;
    bool is_clear;
};

Crossing crossing_of(const gpom_beam_t &beam, const gpom_disc_t &disc)
{
    const double dx = static_cast<double>(beam.dir_x), dy = static_cast<double>(beam.dir_y);
    const double x = disc.x_m - beam.x_m, y = disc.y_m - beam.y_m;
    const double along = x * dx + y * dy, across = x * dy - y * dx;
    const double half2 = disc.radius_m * disc.radius_m - across * across;
    const double half = half2 > 0.0 ? std::sqrt(half2) : 0.0;
    const double end_m = static_cast<double>(beam.range_m);
    bool is_clear = std::abs(half2) > 1e-3;
    for (const double edge_m : {along - half, along + half}) {
        is_clear = is_clear && std::abs(edge_m) > 1e-3 && std::abs(edge_m - end_m) > 1e-3;
    }
    return {along - half, along + half, is_clear};
}

/// Written from the words of live.h.
Known forgotten(const Known &old, const gpom_beam_t &beam, const Crossing &in)
{
    const bool is_apart = !(in.enter_m < in.leave_m) || in.leave_m <= 0.0 ||
                          in.enter_m > static_cast<double>(beam.range_m);
    if (is_apart) {
        return old;
    }
    if (old.has_hit && in.leave_m < static_cast<double>(beam.range_m)) {
        return {in.leave_m, old.free_to_m, true};
    }
    return {old.free_from_m, std::min(in.enter_m, old.free_to_m), false};
}

bool same_known(const Known &a, const Known &b)
{
    const bool is_free_a = a.free_to_m > a.free_from_m, is_free_b = b.free_to_m > b.free_from_m;
    const bool is_same = std::abs(a.free_from_m - b.free_from_m) < 1e-4 &&
                         std::abs(a.free_to_m - b.free_to_m) < 1e-4;
    return a.has_hit == b.has_hit && is_free_a == is_free_b && (!is_free_a || is_same);
}

/// A wall is seen, twelve beams wide, or what is behind it.
TestScan look_ahead(Xy at, float range_m, int i_time)
{
    TestScan s = look(at, 0.0, 1.0, i_time);
    s.angle_min_rad = -0.2;
    s.angle_step_rad = 0.04;
    s.ranges_m.assign(12, range_m);
    return s;
}

/// Hits at 5 m that are not past.
std::size_t n_standing(const Keeping &k)
{
    const std::vector<gpom_beam_t> all = k.map.beams();
    return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](const auto &b) {
        return b.is_hit == 1 && b.past == 0 && b.range_m == 5.0f;
    }));
}

} // namespace

// Of each beam remains what lies outside of the disc, as live.h says, and nothing becomes free that
// was not.
TEST_CASE("forgetting a disc leaves of each beam what lies outside")
{
    GPOM_TELL_SEED();
    Random random(470);
    std::size_t n_checked = 0, n_cut = 0;
    for (int round = 0; round < 60; ++round) {
        gpom_params_t params = params_of(GPOM_KERNEL_MATERN12);
        params.gap_m = random.uniform_f(0.0, 2.0);
        TestMap map(config_of(params));
        drive(map.get(), 471 + static_cast<std::uint64_t>(round), 3);
        const std::vector<gpom_beam_t> before = map.beams();
        const gpom_disc_t disc = {random.uniform(-8, 14), random.uniform(-8, 8),
                                  random.uniform(0.1, 8.0)};
        REQUIRE(gpom_map_forget(map.get(), &disc) == GPOM_OK);
        for (const gpom_beam_t &old : before) {
            const Crossing in = crossing_of(old, disc);
            const Xy start = {old.x_m, old.y_m};
            const double gap_m = static_cast<double>(params.gap_m);
            const Known expected = forgotten(known_of(old, start, gap_m), old, in);
            gpom_beam_t now;
            REQUIRE(gpom_map_beam(map.get(), old.id, &now) == GPOM_OK); // its slot
            if (in.is_clear) {
                ++n_checked;
                n_cut += same_known(expected, known_of(old, start, gap_m)) ? 0u : 1u;
                const Known known = known_of(now, start, gap_m);
                CHECK(same_known(known, expected));
                const bool is_cut = now.x_m != old.x_m || now.range_m != old.range_m;
                CHECK((!is_cut || now.is_free == 0 || known.free_to_m > known.free_from_m));
            }
        }
    }
    CHECK(n_checked > 4000);
    CHECK(n_cut > 500);
}

// A slot without a beam has nothing of the one it held.
TEST_CASE("an empty slot is all 0")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    TestScan scan = look({0, 0}, 0.0, 5.0, 0);
    scan.stamp_us = INT64_MAX; // nothing is counted from there
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    const gpom_disc_t all = {0.0, 0.0, 100.0};
    REQUIRE(gpom_map_forget(map.get(), &all) == GPOM_OK);
    gpom_beam_t slot, zero = {};
    std::memset(&slot, 0xff, sizeof slot);
    REQUIRE(gpom_map_beam(map.get(), 0, &slot) == GPOM_OK);
    CHECK(slot.stamp_us == zero.stamp_us);
    CHECK(slot.x_m == zero.x_m);
    CHECK(slot.range_m == zero.range_m);
}

// Readers beside the map never meet the new epoch with the old cells: it is one change, not two.
TEST_CASE("a jump that clears the map is one change to those who copy")
{
    for (const gpom_jump_t rule : {GPOM_JUMP_KEEP, GPOM_JUMP_CLEAR}) {
        TestMap map(lowres_config());
        drive(map.get(), 472, 3);
        settle(map.get());
        const std::uint32_t before = map.get()->lowres.counter;
        REQUIRE(gpom_map_jump(map.get(), rule, nullptr) == GPOM_OK);
        CHECK(map.get()->lowres.counter == before + 2); // odd in between
        const bool is_cleared =
            is_unknown(raster_of(map.get()).at(22, 15), map.get()->config.params);
        CHECK(is_cleared == (rule == GPOM_JUMP_CLEAR));
    }
}

// Whether the origin follows the robot or not, an obstacle that left is given up after as many
// scans; also if the first beams, before the origin moved, hit nothing.
TEST_CASE("obstacles clear alike where the origin follows the robot")
{
    for (const float rebase_m : {0.0f, 20.0f}) {
        gpom_config_t config = keep_config(3, 4096);
        config.rebase_m = rebase_m;
        Keeping k(config);
        k.see(look({0, 0}, 2.0, 40.0, 0)); // without return
        TestScan nothing = look({25, 0}, 0.0, 1.0, 1);
        nothing.ranges_m.clear();
        k.see(nothing);
        for (int i = 0; i < 3; ++i) {
            k.see(look_ahead({25, 0}, 5.0f, 2 + i));
        }
        const std::size_t n_hits = n_standing(k);
        REQUIRE(n_hits > 1);
        int n_scans = 0;
        while (n_standing(k) >= n_hits && n_scans < 20) {
            k.see(look_ahead({25, 0}, 20.0f, 5 + n_scans));
            ++n_scans;
        }
        CHECK(n_scans == 3);
    }
}

// Beams out of reach of a new origin are forgotten, and the cells they told of do not go on telling
// it.
TEST_CASE("cells follow what a new origin forgets")
{
    gpom_config_t config = lowres_config(64, 8);
    config.rebase_m = 4000.0f;
    TestMap map(config);
    TestScan scan = look_ahead({0, 0}, kInf, 0);
    scan.sensor.range_max_m = 40.0f;
    scan.angle_step_rad = 0.002;
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    settle(map.get());
    REQUIRE(raster_of(map.get()).at(30, 3).stamp_ms == 0); // of its first scan
    const std::uint8_t prior = raster_of(map.get()).at(0, 0).variance;
    for (const double x_m : {4030.0, 8031.0}) {
        scan.pose.x_m = x_m;
        scan.ranges_m.clear();
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
        settle(map.get());
    }
    CHECK(gpom_map_beam_count(map.get()) == 0);
    const Raster raster = raster_of(map.get());
    CHECK(std::all_of(raster.cells.begin(), raster.cells.end(),
                      [&](const gpom_cell_t &cell) { return cell.variance >= prior; }));
}
