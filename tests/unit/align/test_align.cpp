// Alignments in simulated rooms whose poses are known.
#include "tests/common/room_fixture.hpp"
#include "tests/common/sweep_fixture.hpp"

using namespace reference;

namespace
{

gpom_pose_t moved(const gpom_pose_t &pose, double dx_m, double dy_m, double turn_rad,
                  const PriorCov &cov)
{
    return {pose.x_m + dx_m, pose.y_m + dy_m, pose.yaw_rad + turn_rad, cov.by_rows};
}

/// A corridor of 60 m along x. Its ends are out of the laser's reach.
Room corridor() { return {{{-30, 0}, {30, 0}}, {{30, 2}, {-30, 2}}}; }

/// A polygon of so many sides that it is a circle.
Room round_room(double radius_m)
{
    std::vector<Xy> corners;
    for (int i = 0; i < 720; ++i) {
        const double angle_rad = 2.0 * M_PI * i / 720;
        corners.push_back({radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad)});
    }
    return polygon(corners);
}

} // namespace

TEST_CASE("align: a scan of a known room is found to 2 cm and half a degree, without a flag")
{
    GPOM_TELL_SEED();
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    const PriorCov cov(0.4, 0.2);
    for (int i = 0; i < 40; ++i) {
        const gpom_pose_t right = {random.uniform(1, 8), random.uniform(1, 3),
                                   random.uniform(-3, 3), nullptr};
        const TestScan scan = room_scan(l_room(), right, 120, random, 0.01);
        const Alignment a(map.get(), scan,
                          moved(right, random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3),
                                random.uniform(-0.15, 0.15), cov));
        REQUIRE(a.status == GPOM_OK);
        CAPTURE(right.x_m);
        CAPTURE(right.y_m);
        CHECK(a.error(right).head<2>().norm() < 0.02);
        CHECK(std::abs(a.error(right)(2)) < 0.5 * M_PI / 180.0);
        CHECK(a.found.flags == 0);
        CHECK(a.found.n_returns == 120);
        CHECK(a.found.n_matched > 100);
    }
}

// Three degrees of freedom: 3 if the covariance is right. In this room all returns are independent,
// more than the ten that the covariance counts, so that it is wider than here needed.
TEST_CASE("align: the covariance is neither too sure of the pose nor useless")
{
    GPOM_TELL_SEED();
    Random random(seed());
    double sum = 0.0;
    const int n_maps = 20, n_scans = 10;
    for (int i = 0; i < n_maps; ++i) {
        // Each map has poses with errors of its own, as a map that was made by aligning.
        TestMap map(room_config());
        std::vector<gpom_pose_t> poses = l_poses();
        const Room room = l_room();
        for (std::size_t k = 0; k < poses.size(); ++k) {
            TestScan scan = room_scan(room, poses[k], 360, random, 0.01);
            scan.pose.x_m += random.uniform(-0.03, 0.03);
            scan.pose.y_m += random.uniform(-0.03, 0.03);
            scan.pose.yaw_rad += random.uniform(-0.005, 0.005);
            scan.stamp_us = static_cast<std::int64_t>(k) * 100000;
            REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
        }
        const PriorCov cov(0.3, 0.15);
        for (int k = 0; k < n_scans; ++k) {
            const gpom_pose_t right = {random.uniform(1, 8), random.uniform(1, 3),
                                       random.uniform(-3, 3), nullptr};
            const TestScan scan = room_scan(room, right, 180, random, 0.02);
            const Alignment a(map.get(), scan, moved(right, 0.1, -0.1, 0.05, cov));
            REQUIRE(a.status == GPOM_OK);
            const Eigen::Vector3d e = a.error(right);
            sum += e.dot(a.cov().ldlt().solve(e));
        }
    }
    CHECK(sum / (n_maps * n_scans) > 0.4);
    CHECK(sum / (n_maps * n_scans) < 6.0);
}

TEST_CASE("align: a corridor is named as ambiguous along it, and the prediction stays along it")
{
    Random random(seed());
    TestMap map(room_config());
    std::vector<gpom_pose_t> poses;
    for (int i = -5; i <= 5; ++i) {
        poses.push_back({2.0 * i, 1.0, 0.1 * i, nullptr});
    }
    map_room(map, corridor(), poses, random);
    const gpom_pose_t right = {0.5, 0.8, 0.2, nullptr};
    TestScan scan = room_scan(corridor(), right, 180, random, 0.01);
    scan.sensor.range_max_m = 8.0f;
    const PriorCov cov(0.1, 0.1);
    const Alignment a(map.get(), scan, moved(right, 0.1, 0.1, 0.05, cov));
    REQUIRE(a.status == GPOM_OK);
    CHECK((a.found.flags & GPOM_ALIGN_AMBIGUOUS) != 0);
    CHECK((a.found.flags & GPOM_ALIGN_AMBIGUOUS_YAW) == 0);
    CHECK(std::abs(a.found.weak_x) > 0.99f);
    CHECK(std::abs(a.error(right)(0) - 0.1) < 0.1);
    CHECK(std::abs(a.error(right)(1)) < 0.02);
    CHECK(a.cov()(0, 0) > 9.0 * a.cov()(1, 1));
}

TEST_CASE("align: a round room is named as ambiguous in yaw")
{
    Random random(seed());
    TestMap map(room_config());
    map_room(map, round_room(3.0),
             {{0, 0, 0, nullptr}, {0.5, 0, 1, nullptr}, {-0.5, 0.5, 2, nullptr}}, random, 0.0);
    const gpom_pose_t right = {0.0, 0.0, 0.0, nullptr};
    const TestScan scan = room_scan(round_room(3.0), right, 180, random, 0.0);
    const PriorCov cov(0.2, 0.2);
    const Alignment a(map.get(), scan, moved(right, 0.1, 0.0, 0.0, cov));
    REQUIRE(a.status == GPOM_OK);
    CHECK((a.found.flags & GPOM_ALIGN_AMBIGUOUS_YAW) != 0);
    CHECK(a.error(right).head<2>().norm() < 0.03);
}

TEST_CASE("align: where the map has nothing, the result is the prediction, with a flag")
{
    Random random(seed());
    TestMap map(room_config());
    const gpom_pose_t right = {2, 2, 0, nullptr};
    const TestScan scan = room_scan(l_room(), right, 90, random, 0.01);
    const PriorCov cov(0.2, 0.2);
    const gpom_pose_t predicted = moved(right, 0.1, 0.2, 0.3, cov);
    for (const bool is_empty : {true, false}) {
        if (!is_empty) { // a wall far away
            const Room far = {{{100, -10}, {100, 10}}};
            TestScan other = room_scan(far, {95, 0, 0, nullptr}, 90, random, 0.0);
            REQUIRE(other.insert_into(map.get()) == GPOM_OK);
        }
        const Alignment a(map.get(), scan, predicted);
        REQUIRE(a.status == GPOM_OK);
        CHECK(a.found.flags == GPOM_ALIGN_FEW);
        CHECK(a.found.x_m == predicted.x_m);
        CHECK(a.found.y_m == predicted.y_m);
        CHECK(a.found.yaw_rad == predicted.yaw_rad);
        CHECK(std::memcmp(a.found.cov, cov.by_rows, sizeof cov.by_rows) == 0);
    }
}

TEST_CASE("align: walls that were seen from the other side are not used")
{
    // The map knows the north side of a thin wall. A scan from the south sees its south side.
    Random random(seed());
    TestMap map(room_config());
    const Room wall = {{{-5, 0}, {5, 0}}};
    for (int i = 0; i < 5; ++i) {
        TestScan scan = room_scan(wall, {i - 2.0, 2.0, -M_PI / 2, nullptr}, 360, random, 0.0);
        scan.sensor.range_max_m = 2.3f; // no beam grazes the wall
        scan.stamp_us = i * 100000;
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    }
    const PriorCov cov(0.2, 0.2);
    TestScan south = room_scan(wall, {0, -2.0, M_PI / 2, nullptr}, 180, random, 0.0);
    south.sensor.range_max_m = 2.3f;
    const Alignment from_south(map.get(), south, {0, -2.05, M_PI / 2, cov.by_rows});
    CHECK(from_south.found.n_matched == 0);
    TestScan north = room_scan(wall, {0, 2.0, -M_PI / 2, nullptr}, 180, random, 0.0);
    north.sensor.range_max_m = 2.3f;
    const Alignment from_north(map.get(), north, {0, 2.05, -M_PI / 2, cov.by_rows});
    CHECK(from_north.found.n_matched > 25);
}

TEST_CASE("align: a scan that contradicts the map, or is far from the prediction, has a flag")
{
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    const gpom_pose_t right = {3, 2, 0, nullptr};
    const PriorCov cov(0.3, 0.2);
    // Another room: a circle of 1.3 m in what the map knows as free.
    std::vector<Xy> corners;
    for (int i = 0; i < 36; ++i) {
        corners.push_back({3 + 1.3 * std::cos(i * M_PI / 18), 2 + 1.3 * std::sin(i * M_PI / 18)});
    }
    const TestScan other = room_scan(polygon(corners), right, 120, random, 0.0);
    const Alignment wrong(map.get(), other, moved(right, 0.0, 0.0, 0.0, cov));
    REQUIRE(wrong.status == GPOM_OK);
    CHECK(wrong.found.flags != 0);
    const TestScan scan = room_scan(l_room(), right, 120, random, 0.01);
    const PriorCov sure(0.06, 0.06);
    const Alignment far(map.get(), scan, moved(right, 0.35, 0.0, 0.0, sure));
    REQUIRE(far.status == GPOM_OK);
    CHECK((far.found.flags & GPOM_ALIGN_FAR) != 0);
}

TEST_CASE("align: a sweep of equal poses gives what the scan gives")
{
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    const PriorCov cov(0.3, 0.2);
    TestScan scan = room_scan(l_room(), {3, 2, 0.5, nullptr}, 100, random, 0.01);
    scan.angle_min_rad = -3.0; // floats of the sweep's bearings are exact
    scan.angle_step_rad = 0.0625;
    scan.pose = {3.1, 1.9, 0.6, cov.by_rows};
    const Alignment a(map.get(), scan, scan.pose);
    const TestSweep sweep(scan);
    const gpom_sweep_t raw = {0, sweep.ranges_m.data(), sweep.bearings_rad.data(),
                              sweep.poses.data(), 100};
    const gpom_align_config_t config = align_config();
    const gpom_align_task_t task = {&sweep.sensor, sweep.pose, &config};
    std::vector<unsigned char> memory(GPOM_ALIGN_BYTES(config.n_returns_max));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    gpom_alignment_t found = {};
    REQUIRE(gpom_sweep_align(map.get(), &raw, &task, &found, &scratch) == GPOM_OK);
    CHECK(found.x_m == a.found.x_m);
    CHECK(found.y_m == a.found.y_m);
    CHECK(found.yaw_rad == a.found.yaw_rad);
    CHECK(std::memcmp(found.cov, a.found.cov, sizeof found.cov) == 0);
}

TEST_CASE("align: the number of searches stays below its bound, and the map is not changed")
{
    GPOM_TELL_SEED();
    Random random(seed());
    const gpom_config_t config = room_config();
    std::vector<std::uint64_t> memory((gpom_map_bytes(&config) + 7) / 8);
    gpom_map_t *map = nullptr;
    REQUIRE(gpom_map_init(&map, &config, memory.data(), 8 * memory.size()) == GPOM_OK);
    for (const gpom_pose_t &pose : l_poses()) {
        REQUIRE(room_scan(l_room(), pose, 360, random, 0.01).insert_into(map) == GPOM_OK);
    }
    const std::vector<std::uint64_t> before = memory;
    const PriorCov cov(1.0, 1.0);
    for (int i = 0; i < 30; ++i) { // scans of noise fit nowhere
        TestScan scan = room_scan(l_room(), {3, 2, 0, nullptr}, 200, random, 0.8);
        gpom_align_config_t align = align_config();
        align.n_iterations = static_cast<std::uint16_t>(1 + random.below(20));
        align.n_returns_max = static_cast<std::uint16_t>(8 + random.below(300));
        const gpom_pose_t predicted = {random.uniform(1, 8), random.uniform(1, 6),
                                       random.uniform(-3, 3), cov.by_rows};
        const Alignment a(map, scan, predicted, align);
        REQUIRE(a.status == GPOM_OK);
        CHECK(a.found.n_searches <= 14u * align.n_iterations * a.found.n_returns);
        CHECK(a.found.n_returns <= align.n_returns_max);
    }
    CHECK(memory == before);
}

TEST_CASE("align: a bad argument is refused, and the result is not written")
{
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    const PriorCov cov(0.3, 0.2);
    const TestScan good = room_scan(l_room(), {3, 2, 0, nullptr}, 60, random, 0.01);
    const gpom_pose_t pose = {3, 2, 0, cov.by_rows};
    const auto status_of = [&](const gpom_pose_t &predicted, const gpom_align_config_t &config) {
        return Alignment(map.get(), good, predicted, config).status;
    };
    CHECK(status_of(pose, align_config()) == GPOM_OK);
    CHECK(status_of({3, 2, 0, nullptr}, align_config()) == GPOM_ERR_ARG);
    CHECK(status_of({NAN, 2, 0, cov.by_rows}, align_config()) == GPOM_ERR_ARG);
    CHECK(status_of({9000, 2, 0, cov.by_rows}, align_config()) == GPOM_ERR_REACH);
    const auto refused = [&](auto change) {
        gpom_align_config_t config = align_config();
        change(config);
        gpom_align_config_t room = align_config(); // enough scratch
        room.n_returns_max = GPOM_ALIGN_RETURNS_MAX;
        std::vector<unsigned char> memory(GPOM_ALIGN_BYTES(room.n_returns_max));
        const gpom_scratch_t scratch = {memory.data(), memory.size()};
        const gpom_align_task_t task = {&good.sensor, pose, &config};
        gpom_alignment_t found;
        std::memset(&found, 0x5a, sizeof found);
        const gpom_alignment_t before = found;
        const gpom_scan_t raw = good.scan();
        CHECK(gpom_scan_align(map.get(), &raw, &task, &found, &scratch) == GPOM_ERR_ARG);
        CHECK(std::memcmp(&found, &before, sizeof found) == 0);
    };
    refused([](gpom_align_config_t &c) { c.struct_bytes = 0; });
    refused([](gpom_align_config_t &c) { c.n_returns_max = 7; });
    refused([](gpom_align_config_t &c) { c.n_returns_max = GPOM_ALIGN_RETURNS_MAX + 1; });
    refused([](gpom_align_config_t &c) { c.n_iterations = 0; });
    refused([](gpom_align_config_t &c) { c.n_iterations = GPOM_ALIGN_ITERATIONS_MAX + 1; });
    refused([](gpom_align_config_t &c) { c.n_independent = 0; });
    refused([](gpom_align_config_t &c) { c.return_sd_m = NAN; });
    refused([](gpom_align_config_t &c) { c.residual_good_m = 0.0f; });
    refused([](gpom_align_config_t &c) { c.residual_max_m = NAN; });
    refused([](gpom_align_config_t &c) { c.heading_step_rad = -0.1f; });
    refused([](gpom_align_config_t &c) { c.ambiguous_sd_m = 0.0f; });
    refused([](gpom_align_config_t &c) { c.ambiguous_sd_rad = NAN; });
    refused([](gpom_align_config_t &c) { c.matched_share_min = 1.5f; });
    const gpom_align_config_t config = align_config();
    const gpom_align_task_t task = {&good.sensor, pose, &config};
    std::vector<unsigned char> memory(GPOM_ALIGN_BYTES(config.n_returns_max));
    const gpom_scratch_t small = {memory.data(), memory.size() - 1};
    const gpom_scan_t raw = good.scan();
    gpom_alignment_t found;
    CHECK(gpom_scan_align(map.get(), &raw, &task, &found, &small) == GPOM_ERR_MEM);
    CHECK(gpom_scan_align(nullptr, &raw, &task, &found, &small) == GPOM_ERR_ARG);
    CHECK(gpom_scan_align(map.get(), &raw, nullptr, &found, &small) == GPOM_ERR_ARG);
    CHECK(gpom_scan_align(map.get(), &raw, &task, nullptr, &small) == GPOM_ERR_ARG);
}
