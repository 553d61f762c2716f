#include "ports/linux/map/intake.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

namespace
{

constexpr std::uint32_t kBeams = 400, kSlots = 3;
constexpr std::int64_t kStart_us = 1000000000, kSweep_us = 100000, kStep_us = 5000;
constexpr double kSpeed_mps = 10.0;

std::unique_ptr<gpomd::Config> config_of_mbot()
{
    auto config = std::make_unique<gpomd::Config>();
    config->n_sensors = 1;
    gpomd::SensorConfig &sensor = config->sensors[0];
    std::strcpy(sensor.channel, "LIDAR");
    sensor.type = gpomd::ScanType::lidar;
    sensor.gap_max_us = 1000000;
    gpom_sensor_init(&sensor.sensor);
    config->pose.type = gpomd::PoseType::pose2d;
    config->pose.gap_max_us = config->pose.wait_max_us = 1000000;
    config->intake = {kBeams, kSlots - 1, 1000000, 0};
    return config;
}

/// An intake with all that it works on.
struct Fixture {
    std::unique_ptr<gpomd::Config> config = config_of_mbot();
    gpomd::Memory memory;
    gpomd::Counts counts;
    gpomd::Problems problems;
    gpomd::ScanQueue queue;
    std::unique_ptr<gpomd::Odometry> odometry = std::make_unique<gpomd::Odometry>();
    gpomd::Intake intake;

    explicit Fixture(bool has_odometry = true)
    {
        config->jump = {gpomd::JumpRule::keep, 2.0, 10.0, 4.0, 0.0, 1.0};
        REQUIRE(memory.reserve(gpomd::Intake::need(*config) +
                               gpomd::ScanQueue::need(kSlots, kBeams, true)));
        queue.init(memory, kSlots, kBeams, true);
        intake.init(*config, memory, queue, counts, problems);
        odometry->init({200000, 5000000, 0.02, 0.01, 0.05, 0.005});
        if (has_odometry) {
            intake.use_odometry(*odometry);
        }
    }

    void send_pose(std::int64_t stamp_us, float x_m)
    {
        const gpom_wire_pose2d_t pose = {stamp_us, x_m, 2.0f, 0.0f};
        std::uint8_t bytes[64];
        const std::size_t n = gpom_wire_pose2d_encode(&pose, bytes, sizeof bytes);
        intake.take_pose({bytes, n, stamp_us, 0});
    }

    void send_scan(std::int64_t stamp_us, std::vector<std::int64_t> &stamps_us)
    {
        const auto n = static_cast<std::uint32_t>(stamps_us.size());
        std::vector<float> numbers(n, 5.0f);
        gpom_wire_lidar_t scan = {};
        scan.stamp_us = stamp_us;
        scan.ranges_m = scan.bearings_rad = scan.intensities = {numbers.data(), n, n};
        scan.stamps_us = {stamps_us.data(), n, n};
        std::vector<std::uint8_t> bytes(20 + 20 * std::size_t{n});
        const std::size_t n_bytes = gpom_wire_lidar_encode(&scan, bytes.data(), bytes.size());
        REQUIRE(n_bytes == bytes.size());
        intake.take_scan("LIDAR", {bytes.data(), n_bytes, stamp_us, 0});
    }

    /// A scan of one beam.
    void send_scan(std::int64_t stamp_us)
    {
        std::vector<std::int64_t> stamps_us = {stamp_us};
        send_scan(stamp_us, stamps_us);
    }

    /// Place of the robot at a scan of one beam that is ready; its number of jumps.
    double ready_x_m(std::uint32_t &n_jumps)
    {
        std::uint32_t i_slot = 0;
        REQUIRE(queue.ready.pop(i_slot, 0));
        const double x_m = queue.slot(i_slot).pose.x_m;
        n_jumps = queue.slot(i_slot).n_jumps;
        queue.free.push(i_slot);
        return x_m;
    }
};

} // namespace

// Beams in any order of time: the scan is ready as soon as odometry has come up to the latest, and
// each beam has the pose of its own time.
TEST_CASE("a scan with times per beam waits for its latest beam's odometry")
{
    const auto fixture = std::make_unique<Fixture>();
    std::vector<std::int64_t> stamps_us(kBeams);
    for (std::uint32_t i = 0; i < kBeams; ++i) {
        stamps_us[i] = kStart_us + kSweep_us * i / (kBeams - 1);
    }
    std::shuffle(stamps_us.begin(), stamps_us.end(), std::mt19937(1));
    REQUIRE(fixture->odometry->push({kStart_us - kStep_us, kSpeed_mps, 0.0}));
    fixture->send_pose(kStart_us - kStep_us, 1.0f);
    fixture->send_scan(kStart_us, stamps_us);
    std::int64_t newest_us = kStart_us - kStep_us;
    while (fixture->queue.ready.size() == 0 && newest_us < kStart_us + 2 * kSweep_us) {
        newest_us += kStep_us;
        REQUIRE(fixture->odometry->push({newest_us, kSpeed_mps, 0.0}));
        fixture->intake.match_waiting();
    }
    CHECK(newest_us == kStart_us + kSweep_us);
    std::uint32_t i_slot = 0;
    REQUIRE(fixture->queue.ready.pop(i_slot, 0));
    const gpomd::ScanSlot &slot = fixture->queue.slot(i_slot);
    REQUIRE(slot.n_ranges == kBeams);
    for (std::uint32_t i = 0; i < kBeams; ++i) {
        const auto way_us = static_cast<double>(stamps_us[i] - kStart_us + kStep_us);
        CHECK(slot.poses[i].x_m == doctest::Approx(1.0 + 1e-6 * kSpeed_mps * way_us));
        CHECK(slot.poses[i].y_m == doctest::Approx(2.0));
    }
    CHECK(fixture->counts[GPOM_WIRE_SCANS_NO_POSE] == 0);
}

// Scans between two poses that a jump separates are dropped, and have a cause of their own.
TEST_CASE("no scan is placed between the poses before and after a jump of the frame")
{
    const auto fixture = std::make_unique<Fixture>(false);
    std::uint32_t n_jumps = 9;
    fixture->send_pose(kStart_us, 1.0f);
    fixture->send_scan(kStart_us + 50000);
    CHECK(fixture->queue.ready.size() == 0);
    fixture->send_pose(kStart_us + 100000, 501.0f); // wild, or a jump
    CHECK(fixture->queue.ready.size() == 0);
    CHECK(fixture->counts[GPOM_WIRE_POSES_AT_JUMP] == 1);
    fixture->send_pose(kStart_us + 200000, 502.0f);
    CHECK(fixture->queue.ready.size() == 0);
    CHECK(fixture->counts[GPOM_WIRE_SCANS_AT_JUMP] == 1);
    fixture->send_scan(kStart_us + 250000);
    fixture->send_pose(kStart_us + 300000, 503.0f);
    CHECK(fixture->ready_x_m(n_jumps) == doctest::Approx(502.5));
    CHECK(n_jumps == 1);
    CHECK(fixture->counts[GPOM_WIRE_POSES_AT_JUMP] == 1);
    CHECK(fixture->counts[GPOM_WIRE_SCANS_AT_JUMP] == 1);
    CHECK(fixture->counts[GPOM_WIRE_SCANS_NO_POSE] == 0);
    CHECK(fixture->counts[GPOM_WIRE_SCANS_TOO_OLD] == 0);
}

// A wild pose costs itself alone: scans beside it are placed by the good poses about it.
TEST_CASE("a scan beside a wild pose is interpolated between the good ones")
{
    const auto fixture = std::make_unique<Fixture>(false);
    std::uint32_t n_jumps = 9;
    fixture->send_pose(kStart_us, 1.0f);
    fixture->send_scan(kStart_us + 50000);
    fixture->send_pose(kStart_us + 100000, 501.0f);
    fixture->send_pose(kStart_us + 200000, 3.0f);
    CHECK(fixture->ready_x_m(n_jumps) == doctest::Approx(1.5));
    CHECK(n_jumps == 0);
    CHECK(fixture->counts[GPOM_WIRE_POSES_AT_JUMP] == 1);
    CHECK(fixture->counts[GPOM_WIRE_SCANS_AT_JUMP] == 0);
}

// Odometry carries on what is known: neither a wild pose, nor after a jump the pose before it.
TEST_CASE("odometry carries on from the pose before a wild one and from the one after a jump")
{
    const auto fixture = std::make_unique<Fixture>();
    std::uint32_t n_jumps = 9;
    for (std::int64_t t_us = 0; t_us <= 1000000; t_us += kStep_us) {
        REQUIRE(fixture->odometry->push({kStart_us + t_us, kSpeed_mps, 0.0}));
    }
    fixture->send_pose(kStart_us, 1.0f);
    fixture->send_pose(kStart_us + 100000, 501.0f);
    fixture->send_scan(kStart_us + 150000);
    CHECK(fixture->ready_x_m(n_jumps) == doctest::Approx(2.5));
    CHECK(n_jumps == 0);
    fixture->send_pose(kStart_us + 200000, 502.0f);
    fixture->send_scan(kStart_us + 300000);
    CHECK(fixture->ready_x_m(n_jumps) == doctest::Approx(503.0));
    CHECK(n_jumps == 1);
}
