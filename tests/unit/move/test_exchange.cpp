// Beams that leave one map and enter another.
#include "tests/common/keeping.hpp"
#include "tests/common/lowres_fixture.hpp"
#include "tests/common/snapshot_medium.hpp"

using namespace reference;

namespace
{

TestScan random_scan(Random &random, int i_time)
{
    TestScan scan = look_around({0.4 * i_time, 0.1 * i_time}, 40, 1.0f, i_time);
    for (float &range_m : scan.ranges_m) {
        range_m = random.below(6) == 0 ? kInf : random.uniform_f(0.5, 12.0);
    }
    return scan;
}

std::vector<gpom_beam_t> exported(const TestMap &map, std::size_t piece,
                                  const gpom_disc_t *disc = nullptr)
{
    std::vector<gpom_beam_t> all;
    std::vector<gpom_beam_t> beams(piece);
    gpom_export_t progress = {disc, 0, 0};
    auto *const source = const_cast<TestMap &>(map).get();
    while (progress.i_slot < gpom_map_slot_count(source)) {
        REQUIRE(gpom_map_export_beams(source, &progress, beams.data(), piece) == GPOM_OK);
        REQUIRE(progress.n <= piece);
        all.insert(all.end(), beams.begin(), beams.begin() + progress.n);
    }
    return all;
}

gpom_import_report_t imported(TestMap &map, const std::vector<gpom_beam_t> &beams,
                              const gpom_frames_t *frames = nullptr)
{
    gpom_import_report_t report = {};
    REQUIRE(gpom_map_import_beams(map.get(), beams.data(), beams.size(), frames, &report) ==
            GPOM_OK);
    CHECK(report.n_kept + report.n_known + report.n_not_useful + report.n_out_of_reach +
              report.n_damaged ==
          beams.size());
    return report;
}

/// The beams without what depends on the map: ids and the number of the scan.
std::vector<gpom_beam_t> without_numbers(std::vector<gpom_beam_t> beams)
{
    for (gpom_beam_t &beam : beams) {
        beam.id = 0;
        beam.scan = 0;
    }
    return beams;
}

bool same_beam_kept(const gpom_beam_t &a, const gpom_beam_t &b)
{
    return a.x_m == b.x_m && a.y_m == b.y_m && a.stamp_us == b.stamp_us && a.dir_x == b.dir_x &&
           a.dir_y == b.dir_y && a.range_m == b.range_m && a.excess == b.excess &&
           a.hit_noise == b.hit_noise && a.free_noise == b.free_noise && a.is_hit == b.is_hit &&
           a.is_free == b.is_free && a.returned == b.returned && a.provisional == b.provisional &&
           a.past == b.past && a.n_agreed == b.n_agreed && a.n_against == b.n_against &&
           a.arrived == b.arrived;
}

void drive(TestMap &map, std::uint64_t stream, int n_scans)
{
    Random random(stream);
    for (int i = 0; i < n_scans; ++i) {
        REQUIRE(random_scan(random, i).insert_into(map.get()) == GPOM_OK);
    }
}

} // namespace

TEST_CASE("an empty map that gets all beams of another has the same beams and answers")
{
    GPOM_TELL_SEED();
    gpom_config_t config = keep_config(2, 2048);
    config.params.sn2_once = 0.0f; // it is for live maps only
    TestMap from(config);
    drive(from, 920, 30);
    const std::vector<gpom_beam_t> beams = exported(from, 7);
    REQUIRE(beams.size() == gpom_map_beam_count(from.get()));
    gpom_config_t all = config;
    all.keep_m = 0.0f; // every beam is taken
    all.clear_scans = 0;
    TestMap into(all);
    const gpom_import_report_t report = imported(into, beams);
    CHECK(report.n_kept == beams.size());
    const std::vector<gpom_beam_t> before = without_numbers(beams);
    const std::vector<gpom_beam_t> after = without_numbers(into.beams());
    CHECK(std::equal(before.begin(), before.end(), after.begin(), after.end(), same_beam_kept));
    const std::vector<gpom_point_t> points = random_points(921, 50, 15.0);
    CHECK(same_bits(query_points(from.get(), points).all, query_points(into.get(), points).all));
    CHECK(into.stats().beams_hit + into.stats().beams_no_return == 0);
}

TEST_CASE("a disc takes the beams that start or end in it")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12), 2048));
    drive(map, 922, 20);
    const gpom_disc_t disc = {3.0, 1.0, 2.5};
    std::size_t n = 0;
    for (const gpom_beam_t &b : map.beams()) {
        const double range_m = static_cast<double>(b.range_m);
        const double x_m = b.x_m + range_m * static_cast<double>(b.dir_x);
        const double y_m = b.y_m + range_m * static_cast<double>(b.dir_y);
        n += std::hypot(b.x_m - 3.0, b.y_m - 1.0) <= 2.5 || std::hypot(x_m - 3.0, y_m - 1.0) <= 2.5;
    }
    REQUIRE(n > 0);
    CHECK(exported(map, 64, &disc).size() == n);
}

// The frames of two robots differ by a pose; far from zero it costs no precision.
TEST_CASE("beams turn with their frame")
{
    GPOM_TELL_SEED();
    const Xy corner = {500000.0, 5000000.0};
    const gpom_pose_t seen_there = {corner.x + 4.0, corner.y + 1.0, 2.5, nullptr};
    const gpom_pose_t seen_here = {-3.0, 2.0, -1.0, nullptr};
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 2048);
    TestMap right(config);
    drive(right, 923, 20);
    config.origin_x_m = corner.x;
    config.origin_y_m = corner.y;
    TestMap there(config);
    Random random(923);
    const double turn = seen_there.yaw_rad - seen_here.yaw_rad;
    for (int i = 0; i < 20; ++i) { // the same drive in the other frame
        TestScan scan = random_scan(random, i);
        const double x = scan.pose.x_m - seen_here.x_m;
        const double y = scan.pose.y_m - seen_here.y_m;
        scan.pose.x_m = seen_there.x_m + std::cos(turn) * x - std::sin(turn) * y;
        scan.pose.y_m = seen_there.y_m + std::sin(turn) * x + std::cos(turn) * y;
        scan.pose.yaw_rad += turn;
        REQUIRE(scan.insert_into(there.get()) == GPOM_OK);
    }
    config.origin_x_m = config.origin_y_m = 0.0;
    TestMap here(config);
    const gpom_frames_t frames = {seen_there, seen_here};
    imported(here, exported(there, 100), &frames);
    const std::vector<gpom_beam_t> is = here.beams();
    const std::vector<gpom_beam_t> wanted = right.beams();
    REQUIRE(is.size() == wanted.size());
    for (std::size_t i = 0; i < is.size(); ++i) {
        CHECK(std::hypot(is[i].x_m - wanted[i].x_m, is[i].y_m - wanted[i].y_m) < 1e-5);
        CHECK(std::hypot(is[i].dir_x - wanted[i].dir_x, is[i].dir_y - wanted[i].dir_y) < 1e-6f);
    }
}

TEST_CASE("a hit that five scans agreed on is not cleared by two scans of the receiver")
{
    Keeping sender(keep_config(2));
    for (int i = 0; i < 6; ++i) {
        sender.see(look({0, 0}, 0.0, 5.0, i));
    }
    for (const bool has_history : {true, false}) {
        Keeping receiver(keep_config(2));
        receiver.see(look({0, 0}, kPi, 3.0, 0));
        std::vector<gpom_beam_t> beams = exported(sender.map, 10);
        REQUIRE(beams.size() == 1);
        CHECK(beams[0].n_agreed == 5);
        beams[0].n_agreed = has_history ? beams[0].n_agreed : 0;
        CHECK(imported(receiver.map, beams).n_kept == 1);
        receiver.see(look({0, 0}, 0.0, 12.0, 10));
        receiver.see(look({0, 0}, 0.0, 12.0, 11));
        CHECK(receiver.stands(1) == has_history);
    }
}

TEST_CASE("what both saw is one hit with the counts of both")
{
    Keeping sender(keep_config(2));
    Keeping receiver(keep_config(2));
    for (int i = 0; i < 3; ++i) {
        sender.see(look({0, 0}, 0.0, 5.0, i));
        receiver.see(look({5, -4}, kPi / 2, 4.1, i));
    }
    CHECK(imported(receiver.map, exported(sender.map, 10)).n_known == 1);
    REQUIRE(receiver.map.beams().size() == 1);
    CHECK(receiver.beam(0).n_agreed == 5);
}

TEST_CASE("a full map keeps the more useful beams, and its memory")
{
    GPOM_TELL_SEED();
    TestMap sender(keep_config(2, 2048));
    drive(sender, 924, 30);
    TestMap receiver(keep_config(2, 64));
    drive(receiver, 925, 30);
    REQUIRE(gpom_map_beam_count(receiver.get()) == 64);
    const gpom_import_report_t report = imported(receiver, exported(sender, 50));
    CHECK(gpom_map_beam_count(receiver.get()) <= 64);
    CHECK(report.n_not_useful > 0);
    CHECK(report.n_kept > 0);
}

TEST_CASE("damaged beams are counted, and the map stays whole")
{
    GPOM_TELL_SEED();
    TestMap sender(config_of(params_of(GPOM_KERNEL_MATERN12), 2048));
    drive(sender, 926, 5);
    const std::vector<gpom_beam_t> good = exported(sender, 500);
    Random random(927);
    std::vector<gpom_beam_t> bad;
    for (gpom_beam_t beam : good) { // any bits, in any byte of what a beam says of itself
        auto *const bytes = reinterpret_cast<unsigned char *>(&beam);
        for (int i = 0; i < 4; ++i) {
            bytes[random.below(sizeof beam)] = static_cast<unsigned char>(random.below(256));
        }
        bad.push_back(beam);
    }
    gpom_beam_t far = good[0];
    far.x_m = 2.0 * GPOM_REACH_M;
    bad.push_back(far);
    gpom_beam_t nan = good[0];
    nan.dir_y = kNan;
    bad.push_back(nan);
    Keeping receiver(keep_config(2, 2048));
    const gpom_import_report_t report = imported(receiver.map, bad);
    CHECK(report.n_damaged > 0);
    CHECK(report.n_out_of_reach > 0);
    check_answers(receiver, keep_config(2).params, 928);
    for (const gpom_beam_t &beam : receiver.map.beams()) {
        CHECK(std::isfinite(beam.x_m + beam.y_m));
        CHECK(std::abs(std::hypot(beam.dir_x, beam.dir_y) - 1.0f) < 1e-5f);
    }
    const gpom_pose_t pose = {0, 0, 0, nullptr};
    const gpom_pose_t wild = {0, std::nan(""), 0, nullptr};
    gpom_map_t *const map = receiver.map.get();
    const gpom_frames_t to_wild = {pose, wild};
    const gpom_frames_t from_wild = {wild, pose};
    CHECK(gpom_map_import_beams(map, good.data(), 1, &to_wild, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_map_import_beams(map, good.data(), 1, &from_wild, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_map_import_beams(map, nullptr, 1, nullptr, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_map_import_beams(map, nullptr, 0, nullptr, nullptr) == GPOM_OK);
    CHECK(gpom_map_export_beams(map, nullptr, bad.data(), 1) == GPOM_ERR_ARG);
    gpom_export_t progress = {nullptr, 0, 0};
    CHECK(gpom_map_export_beams(map, &progress, bad.data(), 0) == GPOM_ERR_ARG);
}

// Stamps of the other robot may be older than all of this one: they are kept, so that corrected
// poses still move those beams, and nothing of this map becomes younger or older.
TEST_CASE("older stamps are kept")
{
    TestMap sender(keep_config(2));
    REQUIRE(look({0, 0}, 0.0, 5.0, -100).insert_into(sender.get()) == GPOM_OK);
    TestMap receiver(keep_config(2));
    REQUIRE(look({0, 0}, 1.0, 5.0, 7).insert_into(receiver.get()) == GPOM_OK);
    REQUIRE(look({0, 0}, 2.0, 5.0, 9).insert_into(receiver.get()) == GPOM_OK);
    imported(receiver, exported(sender, 1));
    std::vector<std::int64_t> stamps;
    for (const gpom_beam_t &beam : receiver.beams()) {
        stamps.push_back(beam.stamp_us);
    }
    CHECK(stamps == std::vector<std::int64_t>{second(7), second(9), second(-100)});
    CHECK(receiver.get()->keeper.stamp_ms == 109000);
}

TEST_CASE("a map that got all its beams from another one outlives a loss of power")
{
    const gpom_config_t config = keep_config(2, 2048);
    TestMap sender(config);
    drive(sender, 929, 10);
    TestMap receiver(config);
    imported(receiver, exported(sender, 100));
    Medium medium(2048);
    REQUIRE(write_snapshot(receiver.get(), medium).status == GPOM_OK);
    TestMap copy(config);
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    const std::vector<gpom_beam_t> before = receiver.beams();
    const std::vector<gpom_beam_t> after = copy.beams();
    CHECK(std::equal(before.begin(), before.end(), after.begin(), after.end(), same_beam_kept));
}

TEST_CASE("cells near imported beams are evaluated anew")
{
    gpom_config_t config = lowres_config();
    config.keep_m = kKeep_m;
    config.clear_scans = 2;
    TestMap map(config);
    drive(map, 930, 5);
    settle(map.get());
    TestMap sender(keep_config(2, 2048));
    drive(sender, 931, 10);
    imported(map, exported(sender, 100));
    settle(map.get());
    const Raster raster = raster_of(map.get());
    const Answers answers = query_raster(map.get(), raster.info.raster);
    for (std::size_t i = 0; i < raster.cells.size(); ++i) {
        CHECK(same_cell(raster.cells[i],
                        quantised(config, answers.all[i], raster.cells[i].stamp_ms)));
    }
}
