#include "ports/linux/pose/pose_ring.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <memory>

using gpomd::PoseMatch;
using gpomd::PoseRing;
using gpomd::StampedPose;

namespace
{

constexpr std::int64_t kGapMax_us = 100000;

PoseMatch match(const PoseRing &ring, std::int64_t stamp_us)
{
    StampedPose pose;
    return ring.at(stamp_us, kGapMax_us, pose);
}

} // namespace

// Between two poses of a straight, steadily turning drive the ring gives the drive's own pose.
TEST_CASE("the pose ring interpolates position and yaw")
{
    PoseRing ring;
    const auto drive = [](std::int64_t stamp_us) {
        const double t_s = 1e-6 * static_cast<double>(stamp_us);
        return StampedPose{stamp_us, 1.0 + 3.0 * t_s, -2.0 * t_s, 0.7 * t_s};
    };
    for (std::int64_t stamp_us = 0; stamp_us <= 1000000; stamp_us += 50000) {
        REQUIRE(ring.push(drive(stamp_us)));
    }
    for (std::int64_t stamp_us = 0; stamp_us <= 1000000; stamp_us += 12345) {
        StampedPose pose;
        REQUIRE(ring.at(stamp_us, kGapMax_us, pose) == PoseMatch::found);
        CHECK(pose.stamp_us == stamp_us);
        CHECK(pose.x_m == doctest::Approx(drive(stamp_us).x_m).epsilon(1e-12));
        CHECK(pose.y_m == doctest::Approx(drive(stamp_us).y_m).epsilon(1e-12));
        CHECK(pose.yaw_rad == doctest::Approx(drive(stamp_us).yaw_rad).epsilon(1e-12));
    }
}

// From 179 to -179 degrees the way is 2 degrees long and passes 180.
TEST_CASE("the pose ring turns the short way round")
{
    const double degree = M_PI / 180.0;
    PoseRing ring;
    REQUIRE(ring.push({0, 0.0, 0.0, 179.0 * degree}));
    REQUIRE(ring.push({100000, 0.0, 0.0, -179.0 * degree}));
    StampedPose pose;
    REQUIRE(ring.at(25000, kGapMax_us, pose) == PoseMatch::found);
    CHECK(pose.yaw_rad == doctest::Approx(179.5 * degree).epsilon(1e-12));
}

// A time without a pose on both sides is told apart by the reason.
TEST_CASE("the pose ring says why it has no pose")
{
    PoseRing ring;
    CHECK(match(ring, 0) == PoseMatch::not_yet);
    REQUIRE(ring.push({1000000, 0.0, 0.0, 0.0}));
    CHECK(match(ring, 999999) == PoseMatch::too_old);
    CHECK(match(ring, 1000000) == PoseMatch::found);
    CHECK(match(ring, 1000001) == PoseMatch::not_yet);
    REQUIRE(ring.push({1000000 + kGapMax_us + 1, 0.0, 0.0, 0.0}));
    CHECK(match(ring, 1000001) == PoseMatch::gap);
    CHECK(match(ring, 1000000 + kGapMax_us + 1) == PoseMatch::found);
}

// However many poses come, the last kPoses of them are kept, exactly.
TEST_CASE("the pose ring forgets the oldest")
{
    const auto ring = std::make_unique<PoseRing>();
    const std::int64_t n = 3 * static_cast<std::int64_t>(PoseRing::kPoses) + 7;
    for (std::int64_t i = 0; i < n; ++i) {
        REQUIRE(ring->push({1000 * i, static_cast<double>(i), 0.0, 0.0}));
    }
    const std::int64_t oldest = n - static_cast<std::int64_t>(PoseRing::kPoses);
    CHECK(match(*ring, 1000 * oldest - 1) == PoseMatch::too_old);
    for (std::int64_t i = oldest; i < n; ++i) {
        StampedPose pose;
        REQUIRE(ring->at(1000 * i, kGapMax_us, pose) == PoseMatch::found);
        CHECK(pose.x_m == static_cast<double>(i));
    }
    CHECK(match(*ring, 1000 * n) == PoseMatch::not_yet);
}

// After a jump no time before its first pose has one, and the ring says why until that pose is
// forgotten; a pose taken back is as if it had never come.
TEST_CASE("the pose ring begins anew with another frame")
{
    const auto ring = std::make_unique<PoseRing>();
    REQUIRE(ring->push({1000000, 1.0, 0.0, 0.0}));
    REQUIRE(ring->push({1050000, 500.0, 0.0, 0.0}));
    ring->drop_newest();
    CHECK(match(*ring, 1050000) == PoseMatch::not_yet);
    StampedPose pose;
    REQUIRE(ring->push({1040000, 1.4, 0.0, 0.0}));
    REQUIRE(ring->at(1020000, kGapMax_us, pose) == PoseMatch::found);
    CHECK(pose.x_m == doctest::Approx(1.2));
    ring->begin_frame();
    CHECK(match(*ring, 1020000) == PoseMatch::not_yet);
    REQUIRE(ring->push({1060000, 500.0, 0.0, 0.0}));
    CHECK(match(*ring, 1060000) == PoseMatch::found);
    CHECK(match(*ring, 1059999) == PoseMatch::jumped);
    for (std::size_t i = 1; i < PoseRing::kPoses; ++i) {
        REQUIRE(ring->push({1060000 + 1000 * static_cast<std::int64_t>(i), 500.0, 0.0, 0.0}));
    }
    CHECK(match(*ring, 1059999) == PoseMatch::jumped);
    REQUIRE(ring->push({9000000, 500.0, 0.0, 0.0}));
    CHECK(match(*ring, 1059999) == PoseMatch::too_old);
}

// A ring that begins anew since time was set back has not jumped.
TEST_CASE("a clock that was set back is no jump of the frame")
{
    PoseRing ring;
    ring.begin_frame();
    REQUIRE(ring.push({5000000, 1.0, 0.0, 0.0}));
    for (std::int64_t i = 1; i <= PoseRing::kSetBack; ++i) {
        ring.push({1000000 + i, 1.0, 0.0, 0.0});
    }
    CHECK(match(ring, 1000000 + PoseRing::kSetBack) == PoseMatch::found);
    CHECK(match(ring, 0) == PoseMatch::too_old);
}

// Poses that are not finite, or not newer, change nothing; a sender whose clock was set back is
// followed after kSetBack poses in order.
TEST_CASE("the pose ring refuses bad poses and follows a clock that was set back")
{
    PoseRing ring;
    REQUIRE(ring.push({5000000, 1.0, 0.0, 0.0}));
    for (const double bad : {NAN, INFINITY, -INFINITY}) {
        CHECK_FALSE(ring.push({6000000, bad, 0.0, 0.0}));
        CHECK_FALSE(ring.push({6000000, 0.0, bad, 0.0}));
        CHECK_FALSE(ring.push({6000000, 0.0, 0.0, bad}));
    }
    for (std::uint32_t i = 0; i < 3 * PoseRing::kSetBack; ++i) { // never in order
        CHECK_FALSE(ring.push({1000000 - 1000 * static_cast<std::int64_t>(i), 2.0, 0.0, 0.0}));
    }
    CHECK(match(ring, 5000000) == PoseMatch::found);
    for (std::uint32_t i = 1; i < PoseRing::kSetBack; ++i) {
        CHECK_FALSE(ring.push({900000 + 1000 * static_cast<std::int64_t>(i), 2.0, 0.0, 0.0}));
    }
    const std::int64_t accepted_us = 900000 + 1000 * std::int64_t{PoseRing::kSetBack};
    CHECK(ring.push({accepted_us, 2.0, 0.0, 0.0}));
    CHECK(match(ring, accepted_us) == PoseMatch::found);
    CHECK(match(ring, 5000000) == PoseMatch::not_yet);
}
