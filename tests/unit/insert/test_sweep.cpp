// Scans whose beams have bearings and poses of their own: each beam where it was measured, all of
// them one scan.
#include "tests/common/keeping.hpp"
#include "tests/common/sweep_fixture.hpp"

using namespace reference;

namespace
{

/// A live map whose queries take two points of a scan at most.
gpom_config_t capped_config(float keep_m)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 2048);
    config.params.scan_points_max = 2;
    config.keep_m = keep_m;
    config.clear_scans = keep_m > 0.0f ? 3 : 0;
    return config;
}

template <class Type> bool same_bytes(const std::vector<Type> &a, const std::vector<Type> &b)
{
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Type)) == 0;
}

bool same_maps(TestMap &a, TestMap &b)
{
    const gpom_stats_t stats_a = a.stats(), stats_b = b.stats();
    const std::vector<gpom_point_t> points = random_points(162, 200, 25.0);
    return std::memcmp(&stats_a, &stats_b, sizeof stats_a) == 0 &&
           same_bytes(a.beams(), b.beams()) &&
           same_bytes(query_points(a.get(), points).all, query_points(b.get(), points).all);
}

enum class Verdict { kConfirmed, kPassed, kLeftAlone, kUnclear };

/// What a sweep whose beams all have one bearing says of a hit, seen once, by live.h. Where some
/// end and others pass, it depends on the groups that they are in.
Verdict verdict_of(const TestSweep &sweep, const gpom_beam_t &post)
{
    const double keep_m = static_cast<double>(kKeep_m);
    const Beam hit = beam_of(post);
    const Xy at = {hit.origin.x + hit.range * hit.dir.x, hit.origin.y + hit.range * hit.dir.y};
    double nearest_end_m = 1e9, nearest_m = 1e9;
    for (std::size_t i = 0; i < sweep.ranges_m.size(); ++i) {
        const double yaw_rad = static_cast<double>(sweep.bearings_rad[i]);
        const double dx = std::cos(yaw_rad), dy = std::sin(yaw_rad);
        const double x = at.x - sweep.poses[i].x_m, y = at.y - sweep.poses[i].y_m;
        const double range_m = static_cast<double>(sweep.ranges_m[i]);
        nearest_end_m = std::min(nearest_end_m, std::hypot(range_m * dx - x, range_m * dy - y));
        const double along = x * dx + y * dy;
        const bool goes_on = along > 0.0 && range_m - along > 10.0 * keep_m;
        nearest_m = goes_on ? std::min(nearest_m, std::abs(x * dy - y * dx)) : nearest_m;
    }
    const bool ends = nearest_end_m < keep_m - 1e-3;
    const bool ends_not = nearest_end_m > keep_m + 1e-3;
    const bool passes = nearest_m < 0.14 * keep_m;
    const bool passes_not = nearest_m > 1.1 * keep_m;
    if (ends && passes_not) {
        return Verdict::kConfirmed;
    }
    if (ends_not && passes) {
        return Verdict::kPassed;
    }
    return ends_not && passes_not ? Verdict::kLeftAlone : Verdict::kUnclear;
}

} // namespace

// A sweep whose beams share one pose is the scan: same beams, counters and answers to the last bit,
// whatever the mount, the covariance and the rules of keeping.
TEST_CASE("a sweep from one pose is the scan, bit for bit")
{
    GPOM_TELL_SEED();
    const float cov[9] = {1e-4f, 0, 0, 0, 1e-4f, 0, 0, 0, 1e-6f};
    for (const float keep_m : {0.0f, 0.3f}) {
        Random random(160);
        TestMap scanned(capped_config(keep_m)), swept(capped_config(keep_m));
        for (int i = 0; i < 25; ++i) {
            TestScan scan = yard_scan(random, i / 3, {-10, 0});
            scan.stamp_us = 100000 * i;
            scan.angle_min_rad = 0.125 * random.below(40); // bearings that are exact in float32
            scan.angle_step_rad = 0.125;
            scan.sensor.x_m = random.uniform(-1, 1);
            scan.sensor.yaw_rad = random.uniform(-4, 4);
            scan.sensor.upside_down = i % 2 == 0 ? 1 : 0;
            scan.pose.cov = i % 3 == 0 ? cov : nullptr;
            REQUIRE(scan.insert_into(scanned.get()) == GPOM_OK);
            REQUIRE(TestSweep(scan).insert_into(swept.get()) == GPOM_OK);
        }
        CHECK(same_maps(scanned, swept));
    }
}

// Each beam of a sweep is the beam of a scan of its own from its pose, noise included; only the
// count of scans and the time are those of the sweep.
TEST_CASE("every beam of a sweep starts from its own pose")
{
    GPOM_TELL_SEED();
    Random random(161);
    const float cov[9] = {0.01f, 0, 0, 0, 0.02f, 0, 0, 0, 0.001f};
    TestMap singles(capped_config(0.0f)), swept(capped_config(0.0f));
    TestSweep sweep;
    sweep.sensor.x_m = 0.7;
    sweep.sensor.y_m = -0.3;
    sweep.stamp_us = 5000000;
    for (int i = 0; i < 40; ++i) {
        TestScan single;
        single.sensor = sweep.sensor;
        single.stamp_us = sweep.stamp_us;
        single.pose = {0.3 * i, random.uniform(-1, 1), random.uniform(-3, 3),
                       i % 2 == 0 ? cov : nullptr};
        single.ranges_m = {random.below(5) == 0 ? kInf : random.uniform_f(0.5, 14.0)};
        const float bearing_rad = random.uniform_f(-3, 3);
        single.angle_min_rad = static_cast<double>(bearing_rad);
        REQUIRE(single.insert_into(singles.get()) == GPOM_OK);
        sweep.add(single.ranges_m[0], bearing_rad, single.pose);
    }
    REQUIRE(sweep.insert_into(swept.get()) == GPOM_OK);
    std::vector<gpom_beam_t> beams = singles.beams();
    for (gpom_beam_t &beam : beams) { // 40 scans with numbers of their own
        beam.scan = 0;
    }
    CHECK(same_bytes(beams, swept.beams()));
    CHECK(singles.stats().scans_inserted == 40);
    CHECK(swept.stats().scans_inserted == 1);
}

// The cap on points of one scan holds for a sweep as a whole.
TEST_CASE("no query takes more points of a sweep than of a scan")
{
    gpom_config_t config = capped_config(0.0f);
    config.params.n_hits = 8;
    TestMap map(config);
    TestSweep sweep;
    for (int i = 0; i < 30; ++i) {
        sweep.add(5.0f, 1.5f, {0.1 * i, 0.0, 0.0, nullptr});
    }
    REQUIRE(sweep.insert_into(map.get()) == GPOM_OK);
    CHECK(query_points(map.get(), {{1.5, 4.5}}).all[0].n_hits == 2);
    sweep.stamp_us = 100000;
    REQUIRE(sweep.insert_into(map.get()) == GPOM_OK);
    CHECK(query_points(map.get(), {{1.5, 4.5}}).all[0].n_hits == 4);
}

// One bad beam pose, bearing or place refuses the whole sweep, by cause, and changes nothing else.
TEST_CASE("a sweep with one bad beam is refused whole")
{
    const auto check = [](const TestSweep &sweep, gpom_status_t status,
                          std::uint64_t gpom_stats_t::*counter) {
        TestMap map(capped_config(0.3f));
        gpom_stats_t expected = map.stats();
        if (counter != nullptr) {
            ++(expected.*counter);
        }
        CHECK(sweep.insert_into(map.get()) == status);
        const gpom_stats_t stats = map.stats();
        CHECK(std::memcmp(&stats, &expected, sizeof stats) == 0);
        CHECK(gpom_map_beam_count(map.get()) == 0);
    };
    TestSweep good;
    for (int i = 0; i < 20; ++i) {
        good.add(5.0f, 0.1f * static_cast<float>(i), {0.1 * i, 0.0, 0.0, nullptr});
    }
    for (const std::size_t i : {std::size_t{0}, std::size_t{19}}) {
        TestSweep bad = good;
        bad.poses[i].yaw_rad = static_cast<double>(kNan);
        check(bad, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
        bad = good;
        bad.poses[i].x_m = GPOM_REACH_M + 1.0;
        check(bad, GPOM_ERR_REACH, &gpom_stats_t::scans_out_of_reach);
        bad = good;
        bad.bearings_rad[i] = kNan;
        check(bad, GPOM_ERR_ARG, nullptr);
    }
    TestSweep bad = good;
    bad.pose.x_m = static_cast<double>(kInf); // the robot's own, which no beam uses
    check(bad, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
}

// Where the origin follows the robot a wild pose is refused like anywhere else, and costs nothing
// that is kept; a vehicle that travels is followed, an empty map goes wherever its first scan is.
TEST_CASE("a wild pose erases nothing where the origin follows the robot")
{
    GPOM_TELL_SEED();
    gpom_config_t config = capped_config(0.3f);
    config.rebase_m = 100.0f;
    TestMap map(config);
    Random random(163);
    const auto scan_at = [&](double x_m) { return yard_scan(random, 0, {x_m, -40.0}); };
    for (double x_m = 400e3; x_m < 430e3; x_m += 5000.0) {
        REQUIRE(scan_at(x_m).insert_into(map.get()) == GPOM_OK);
    }
    const auto beams = map.beams();
    REQUIRE(beams.size() >= 20);
    gpom_point_t origin = {}, after = {};
    REQUIRE(gpom_map_origin(map.get(), &origin) == GPOM_OK);
    CHECK(std::abs(origin.x_m - 425e3) <= 100.0);
    gpom_stats_t expected = map.stats();
    const auto check = [&](const auto &offered) {
        CHECK(offered.insert_into(map.get()) == GPOM_ERR_REACH);
        ++expected.scans_out_of_reach;
        const gpom_stats_t stats = map.stats();
        CHECK(std::memcmp(&stats, &expected, sizeof stats) == 0);
        CHECK(same_bytes(map.beams(), beams));
        REQUIRE(gpom_map_origin(map.get(), &after) == GPOM_OK);
        CHECK(std::memcmp(&after, &origin, sizeof after) == 0);
    };
    for (const double wild_x_m : {1e6, -9e7, 434e3, 416e3}) {
        check(scan_at(wild_x_m));
        check(TestSweep(scan_at(wild_x_m)));
        TestSweep one = TestSweep(scan_at(425.2e3));
        one.poses.back().x_m = wild_x_m;
        check(one);
    }
    REQUIRE(gpom_map_jump(map.get(), GPOM_JUMP_CLEAR, nullptr) == GPOM_OK);
    CHECK(scan_at(1e6).insert_into(map.get()) == GPOM_OK);
}

// Null pointers and counts out of range are refused; a sweep without beams needs no arrays.
TEST_CASE("a sweep without its arrays is refused")
{
    TestMap map(capped_config(0.0f));
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    const gpom_pose_t pose = {0.0, 0.0, 0.0, nullptr};
    const float number = 1.0f;
    const gpom_sweep_t good = {0, &number, &number, &pose, 1};
    const auto insert = [&](const gpom_sweep_t &sweep) {
        return gpom_sweep_insert(map.get(), &sweep, &sensor, &pose);
    };
    CHECK(insert(good) == GPOM_OK);
    CHECK(insert({0, nullptr, nullptr, nullptr, 0}) == GPOM_OK);
    CHECK(insert({0, nullptr, &number, &pose, 1}) == GPOM_ERR_ARG);
    CHECK(insert({0, &number, nullptr, &pose, 1}) == GPOM_ERR_ARG);
    CHECK(insert({0, &number, &number, nullptr, 1}) == GPOM_ERR_ARG);
    CHECK(insert({0, &number, &number, &pose, GPOM_RANGES_MAX + 1}) == GPOM_ERR_ARG);
    CHECK(gpom_sweep_insert(nullptr, &good, &sensor, &pose) == GPOM_ERR_ARG);
    CHECK(gpom_sweep_insert(map.get(), nullptr, &sensor, &pose) == GPOM_ERR_ARG);
    CHECK(gpom_sweep_insert(map.get(), &good, nullptr, &pose) == GPOM_ERR_ARG);
    CHECK(gpom_sweep_insert(map.get(), &good, &sensor, nullptr) == GPOM_ERR_ARG);
}

// A sensor that moves between its beams is not taken to stand still: a kept hit is confirmed by the
// beams that end at it, cleared by those that pass it, and left alone by others.
TEST_CASE("beams of a sweep witness from where they start")
{
    GPOM_TELL_SEED();
    Random random(165);
    int n_of[4] = {};
    for (int round = 0; round < 150; ++round) {
        Keeping k(keep_config(2));
        for (int i = 0; i < 12; ++i) { // posts, each seen once
            k.see(look({10.0, random.uniform(-9, 9)}, random.uniform(-0.3, 0.3), 3.0, i));
        }
        const std::vector<gpom_beam_t> posts = k.map.beams();
        TestSweep sweep;
        const double step_m = random.uniform(-1, 1), first_m = random.uniform(-6, 6);
        const double bearing_rad = random.uniform(-0.3, 0.3);
        for (int i = 0; i < 40; ++i) {
            sweep.add(random.below(2) == 0 ? 13.2f : 25.0f, static_cast<float>(bearing_rad),
                      {0.0, first_m + step_m * i, 0.0, nullptr});
        }
        for (int i_time = 20; i_time < 22; ++i_time) {
            sweep.stamp_us = second(i_time);
            REQUIRE(sweep.insert_into(k.map.get()) == GPOM_OK);
        }
        for (const gpom_beam_t &post : posts) {
            if (post.is_hit == 0 || post.provisional == 1 || post.n_agreed > 0) {
                continue;
            }
            const Verdict verdict = verdict_of(sweep, post);
            ++n_of[static_cast<int>(verdict)];
            const gpom_beam_t now = k.beam(post.id);
            CHECK((verdict != Verdict::kConfirmed || now.n_agreed == 2));
            CHECK((verdict != Verdict::kPassed || now.past == 1));
            CHECK((verdict != Verdict::kLeftAlone || (now.n_agreed == 0 && now.past == 0)));
        }
    }
    CHECK(*std::min_element(n_of, n_of + 3) > 5);
}
