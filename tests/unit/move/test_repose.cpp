// A map whose poses are corrected afterwards.
#include "tests/common/keeping.hpp"
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

namespace
{

constexpr int kScans = 30;

/// Where the robot was, and where its odometry thought it was: off by more the longer it drives.
gpom_pose_t true_pose(double time_s)
{
    return {0.3 * time_s, 2.0 * std::sin(0.2 * time_s), 0.1 * time_s, nullptr};
}

gpom_pose_t drifted_pose(double time_s)
{
    const gpom_pose_t at = true_pose(time_s);
    return {1.1 * at.x_m + 0.02 * time_s, at.y_m - 0.05 * time_s, at.yaw_rad + 0.02 * time_s,
            nullptr};
}

TestScan scan_at(Random &random, const gpom_pose_t &pose, int i_time)
{
    TestScan scan;
    scan.pose = pose;
    scan.stamp_us = second(i_time);
    scan.angle_min_rad = -2.0;
    scan.angle_step_rad = 0.13;
    for (int i = 0; i < 32; ++i) {
        scan.ranges_m.push_back(random.below(8) == 0 ? kInf : random.uniform_f(0.5, 14.0));
    }
    return scan;
}

/// The same readings with drifted and with true poses.
void insert_both(TestMap &drifted, TestMap &right, std::uint64_t stream)
{
    Random random(stream);
    for (int i = 0; i < kScans; ++i) {
        TestScan scan = scan_at(random, drifted_pose(i), i);
        REQUIRE(scan.insert_into(drifted.get()) == GPOM_OK);
        scan.pose = true_pose(i);
        REQUIRE(scan.insert_into(right.get()) == GPOM_OK);
    }
}

/// Corrections at every n-th scan.
std::vector<gpom_correction_t> corrections_of(int every, int first = 0, int last = kScans - 1)
{
    std::vector<gpom_correction_t> all;
    for (int i = first; i <= last; i += every) {
        all.push_back({second(i), drifted_pose(i), true_pose(i)});
    }
    return all;
}

gpom_repose_report_t repose(TestMap &map, const std::vector<gpom_correction_t> &corrections)
{
    gpom_repose_report_t report = {};
    REQUIRE(gpom_map_repose(map.get(), corrections.data(), corrections.size(), &report) == GPOM_OK);
    return report;
}

Xy end_of(const gpom_beam_t &b)
{
    const double range_m = static_cast<double>(b.range_m);
    return {b.x_m + range_m * static_cast<double>(b.dir_x),
            b.y_m + range_m * static_cast<double>(b.dir_y)};
}

/// Greatest distance between starts or ends of the same beams of two maps [m].
double greatest_gap(const TestMap &a, const TestMap &b)
{
    const std::vector<gpom_beam_t> in_a = a.beams();
    const std::vector<gpom_beam_t> in_b = b.beams();
    REQUIRE(in_a.size() == in_b.size());
    double gap_m = 0.0;
    for (std::size_t i = 0; i < in_a.size(); ++i) {
        REQUIRE(in_a[i].id == in_b[i].id);
        CHECK(in_a[i].stamp_us == in_b[i].stamp_us);
        const Xy end_a = end_of(in_a[i]);
        const Xy end_b = end_of(in_b[i]);
        gap_m = std::max({gap_m, std::hypot(in_a[i].x_m - in_b[i].x_m, in_a[i].y_m - in_b[i].y_m),
                          std::hypot(end_a.x - end_b.x, end_a.y - end_b.y)});
    }
    return gap_m;
}

gpom_config_t keep_all_config() { return config_of(params_of(GPOM_KERNEL_MATERN12), 2048); }

/// All memory of a map.
std::vector<unsigned char> bytes_of(gpom_map_t *map, const gpom_config_t &config)
{
    const auto *const first = reinterpret_cast<const unsigned char *>(map);
    return {first, first + gpom_map_bytes(&config)};
}

} // namespace

TEST_CASE("with a correction for each scan the beams are those of a map of the right poses")
{
    GPOM_TELL_SEED();
    TestMap drifted(keep_all_config());
    TestMap right(keep_all_config());
    insert_both(drifted, right, 900);
    REQUIRE(greatest_gap(drifted, right) > 1.0);
    const gpom_repose_report_t report = repose(drifted, corrections_of(1));
    CHECK(greatest_gap(drifted, right) < 1e-5);
    CHECK(report.n_moved == gpom_map_beam_count(right.get()));
    CHECK(report.n_before + report.n_after + report.n_restored + report.n_forgotten == 0);
}

// Poses between corrections are interpolated. The drive turns, so that this is not exact.
TEST_CASE("with a correction for every fourth scan the beams are nearly right")
{
    GPOM_TELL_SEED();
    TestMap drifted(keep_all_config());
    TestMap right(keep_all_config());
    insert_both(drifted, right, 901);
    std::vector<gpom_correction_t> some = corrections_of(4);
    some.push_back(corrections_of(1).back());
    repose(drifted, some);
    CHECK(greatest_gap(drifted, right) < 0.15);
}

TEST_CASE("beams outside of the corrections move like the nearest correction")
{
    GPOM_TELL_SEED();
    TestMap drifted(keep_all_config());
    TestMap right(keep_all_config());
    insert_both(drifted, right, 902);
    const std::vector<gpom_beam_t> before = drifted.beams();
    const std::vector<gpom_correction_t> middle = corrections_of(1, 10, 19);
    const gpom_repose_report_t report = repose(drifted, middle);
    const std::vector<gpom_beam_t> after = drifted.beams();
    std::uint32_t n_before = 0;
    std::uint32_t n_after = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        const bool is_old = before[i].stamp_us < second(10);
        const bool is_new = before[i].stamp_us > second(19);
        n_before += is_old ? 1 : 0;
        n_after += is_new ? 1 : 0;
        if (!is_old && !is_new) {
            continue;
        }
        const gpom_correction_t &c = is_old ? middle.front() : middle.back();
        const double turn = c.to.yaw_rad - c.from.yaw_rad;
        const double x = before[i].x_m - c.from.x_m;
        const double y = before[i].y_m - c.from.y_m;
        CHECK(std::abs(c.to.x_m + std::cos(turn) * x - std::sin(turn) * y - after[i].x_m) < 1e-5);
        CHECK(std::abs(c.to.y_m + std::sin(turn) * x + std::cos(turn) * y - after[i].y_m) < 1e-5);
    }
    CHECK(report.n_before == n_before);
    CHECK(report.n_after == n_after);
}

// Angles that differ by whole turns say the same.
TEST_CASE("the shorter way is taken between two corrections that turn")
{
    TestMap map(keep_all_config());
    for (int i = 0; i < 3; ++i) {
        REQUIRE(look({0, 0}, 0.0, 5.0, i).insert_into(map.get()) == GPOM_OK);
    }
    const gpom_pose_t zero = {0, 0, 0, nullptr};
    repose(map, {{second(0), zero, {0, 0, 3.0, nullptr}},
                 {second(2), zero, {0, 0, -3.0 + 20 * kPi, nullptr}}});
    CHECK(std::abs(map.beams()[1].dir_x + 1.0f) < 1e-6f); // half way from 3 to 2 pi - 3 is pi
}

TEST_CASE("queries are exact at once, and stay so while the trees are built")
{
    GPOM_TELL_SEED();
    for (const bool is_built : {false, true}) {
        Keeping k(keep_config(2, 4096));
        Random random(903);
        for (int i = 0; i < kScans; ++i) {
            REQUIRE(scan_at(random, drifted_pose(i), i).insert_into(k.map.get()) == GPOM_OK);
        }
        if (is_built) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        repose(k.map, corrections_of(3));
        const gpom_params_t params = keep_config(2).params;
        check_answers(k, params, 904);
        std::uint64_t used = 1;
        for (int i = 0; used > 0; ++i) {
            REQUIRE(gpom_map_step(k.map.get(), 3000, nullptr, &used) == GPOM_OK);
            if (i % 8 == 0) {
                check_answers(k, params, 905 + static_cast<std::uint64_t>(i));
            }
        }
        CHECK(k.map.get()->index.hit_tree.n_items > 0);
        check_answers(k, params, 999);
    }
}

// The drifted frame had contradicted them.
TEST_CASE("past and provisional hits stand again, and counts stay")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 5.0, 0));
    k.see(look({0, 0}, 0.0, 12.0, 1));
    k.see(look({0, 0}, 0.0, 12.0, 2)); // now the first hit is past
    k.see(look({0, 0}, 0.5, 9.0, 3));
    k.see(look({0, 0}, 0.5, 9.0, 4)); // agrees
    k.see(look({0, 0}, 0.5, 4.0, 5)); // in free space: provisional
    REQUIRE(k.beam(0).past == 1);
    REQUIRE(k.n_provisional() == 1);
    const std::uint32_t n_beams = gpom_map_beam_count(k.map.get());
    const gpom_pose_t zero = {0, 0, 0, nullptr};
    const gpom_repose_report_t report =
        repose(k.map, {{second(0), zero, {1.0, 2.0, 0.0, nullptr}}});
    CHECK(report.n_restored == 2);
    CHECK(gpom_map_beam_count(k.map.get()) == n_beams);
    CHECK(k.n_provisional() == 0);
    std::uint8_t most = 0;
    for (const gpom_beam_t &b : k.map.beams()) {
        CHECK(b.past == 0);
        most = std::max(most, b.n_agreed);
    }
    CHECK(most == 1);
    CHECK(k.stands(0));
    // What really left is cleared again.
    k.see(look({1, 2}, 0.0, 12.0, 6));
    k.see(look({1, 2}, 0.0, 12.0, 7));
    CHECK(k.beam(0).past == 1);
}

TEST_CASE("readers of the raster see a new epoch and no cell of the old frame")
{
    TestMap map(lowres_config());
    Random random(906);
    for (int i = 0; i < kScans; ++i) {
        REQUIRE(scan_at(random, drifted_pose(i), i).insert_into(map.get()) == GPOM_OK);
    }
    settle(map.get());
    const std::uint32_t epoch = raster_of(map.get()).info.frame_epoch;
    repose(map, corrections_of(1));
    const Raster cleared = raster_of(map.get());
    CHECK(cleared.info.frame_epoch == epoch + 1);
    for (const gpom_cell_t &cell : cleared.cells) {
        REQUIRE(cell.cls == GPOM_UNKNOWN);
    }
    settle(map.get());
    const Raster after = raster_of(map.get());
    const Answers answers = query_raster(map.get(), after.info.raster);
    for (std::size_t i = 0; i < after.cells.size(); ++i) {
        const gpom_cell_t expected =
            quantised(map.get()->config, answers.all[i], after.cells[i].stamp_ms);
        CHECK(same_cell(after.cells[i], expected));
    }
}

TEST_CASE("bad corrections change nothing")
{
    const gpom_config_t config = keep_all_config();
    TestMap map(config);
    TestMap right(config);
    insert_both(map, right, 907);
    const std::vector<unsigned char> before = bytes_of(map.get(), config);
    const auto refuses = [&](std::vector<gpom_correction_t> corrections, gpom_status_t status) {
        gpom_repose_report_t report;
        CHECK(gpom_map_repose(map.get(), corrections.data(), corrections.size(), &report) ==
              status);
        CHECK(bytes_of(map.get(), config) == before);
    };
    std::vector<gpom_correction_t> swapped = corrections_of(1);
    std::swap(swapped[3], swapped[4]);
    refuses(swapped, GPOM_ERR_ARG);
    std::vector<gpom_correction_t> twice = corrections_of(1);
    twice[3].stamp_us = twice[4].stamp_us;
    refuses(twice, GPOM_ERR_ARG);
    for (const double bad : {std::nan(""), 1e9, -std::numeric_limits<double>::infinity()}) {
        std::vector<gpom_correction_t> wild = corrections_of(1);
        wild[5].to.y_m = bad;
        refuses(wild, GPOM_ERR_ARG);
        wild = corrections_of(1);
        wild[5].from.yaw_rad = bad;
        refuses(wild, GPOM_ERR_ARG);
    }
    std::vector<gpom_correction_t> far = corrections_of(1);
    far.back().to.x_m = 2.0 * GPOM_REACH_M;
    refuses(far, GPOM_ERR_REACH);
    refuses({}, GPOM_ERR_ARG);
    CHECK(gpom_map_repose(map.get(), nullptr, 1, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_map_repose(nullptr, far.data(), 1, nullptr) == GPOM_ERR_ARG);
}

// Stamps at both ends of the range of 64 bits, and corrections of times without any scan.
TEST_CASE("no stamp overflows")
{
    TestMap map(keep_all_config());
    REQUIRE(look({0, 0}, 0.0, 5.0, 0).insert_into(map.get()) == GPOM_OK);
    const gpom_pose_t zero = {0, 0, 0, nullptr};
    const gpom_repose_report_t report =
        repose(map, {{INT64_MIN, zero, zero}, {INT64_MAX, zero, {8.0, 0.0, 0.0, nullptr}}});
    CHECK(report.n_moved == 1);
    const double part = (static_cast<double>(second(0)) + 0x1p63) * 0x1p-64;
    CHECK(map.beams()[0].x_m == doctest::Approx(8.0 * part));
}

// A correction whose poses are all out of reach concerns beams that the map forgot long ago; what
// it would move out of reach goes.
TEST_CASE("beams that would leave the reach are forgotten and counted")
{
    TestMap map(keep_all_config());
    REQUIRE(look({7000, 0}, 0.0, 5.0, 0).insert_into(map.get()) == GPOM_OK);
    REQUIRE(look({10, 0}, 0.0, 5.0, 1).insert_into(map.get()) == GPOM_OK);
    const double far_m = 3.0 * GPOM_REACH_M;
    const gpom_repose_report_t report =
        repose(map, {{second(0), {far_m, 0, 0, nullptr}, {far_m + 2000.0, 0, 0, nullptr}},
                     {second(1), {10, 0, 0, nullptr}, {11, 0, 0, nullptr}}});
    CHECK(report.n_forgotten == 1);
    REQUIRE(map.beams().size() == 1);
    CHECK(map.beams()[0].x_m == doctest::Approx(11.0));
    CHECK(map.stats().beams_forgotten == 1);
}

TEST_CASE("directions keep their length however often a map moves")
{
    TestMap map(keep_all_config());
    REQUIRE(look({1, 2}, 0.3, 5.0, 0).insert_into(map.get()) == GPOM_OK);
    Random random(908);
    for (int i = 0; i < 10000; ++i) {
        const gpom_pose_t from = {0, 0, random.uniform(-3.0, 3.0), nullptr};
        repose(map, {{second(0), from, {0, 0, random.uniform(-3.0, 3.0), nullptr}}});
    }
    const gpom_beam_t beam = map.beams()[0];
    CHECK(std::abs(std::hypot(beam.dir_x, beam.dir_y) - 1.0f) < 1e-6f);
}
