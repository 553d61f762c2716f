#include "ports/linux/pose/frame_jump.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using gpomd::Continuity;
using gpomd::FrameJump;
using gpomd::JumpRule;
using gpomd::StampedPose;

namespace
{

constexpr double kDistance_m = 2.0, kSpeed_mps = 40.0, kTurn_rad = 0.5, kTurn_radps = 6.0;
constexpr std::int64_t kStep_us = 100000;

FrameJump frame_of(double turn_rad = kTurn_rad)
{
    FrameJump frame;
    frame.init({JumpRule::keep, kDistance_m, kSpeed_mps, turn_rad, kTurn_radps, 20.0});
    return frame;
}

} // namespace

// However a robot drives within its limits, and however the localiser errs within half of what may
// be corrected, every pose follows.
TEST_CASE("no pose of a fast drive with turns is a jump")
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(-1.0, 1.0);
    FrameJump frame = frame_of();
    StampedPose truth = {1000000, 4e5, 5e6, 0.0};
    for (int i = 0; i < 20000; ++i) {
        const double dt_s = std::pow(10.0, 1.5 * part(random) - 1.5); // 1 ms to 1 s
        const double way_m = 0.99 * kSpeed_mps * dt_s * part(random);
        truth.stamp_us += std::llround(1e6 * dt_s);
        truth.x_m += way_m * std::cos(truth.yaw_rad);
        truth.y_m += way_m * std::sin(truth.yaw_rad);
        truth.yaw_rad += 0.99 * kTurn_radps * dt_s * part(random);
        const double error_rad = M_PI * part(random);
        const double error_m = 0.49 * kDistance_m;
        const StampedPose pose = {
            truth.stamp_us, truth.x_m + error_m * std::cos(error_rad),
            truth.y_m + error_m * std::sin(error_rad),
            std::remainder(truth.yaw_rad + 0.49 * kTurn_rad * part(random), 2.0 * M_PI)};
        REQUIRE(frame.take(pose) == Continuity::follows);
    }
}

// The limits are where they are said to be, in place and in turn, for either sense of time.
TEST_CASE("a pose strays just beyond what the robot can do")
{
    for (const std::int64_t stamp_us : {kStep_us, -kStep_us}) {
        const double reach_m = kDistance_m + 0.1 * kSpeed_mps;
        const double reach_rad = kTurn_rad + 0.1 * kTurn_radps;
        const auto take = [stamp_us](double x_m, double y_m, double yaw_rad) {
            FrameJump frame = frame_of();
            REQUIRE(frame.take({0, 10.0, 20.0, 3.0}) == Continuity::follows);
            return frame.take({stamp_us, 10.0 + x_m, 20.0 + y_m, 3.0 + yaw_rad});
        };
        CHECK(take(0.0, -0.999 * reach_m, 0.0) == Continuity::follows);
        CHECK(take(0.0, -1.001 * reach_m, 0.0) == Continuity::strays);
        CHECK(take(0.71 * reach_m, 0.71 * reach_m, 0.0) == Continuity::strays);
        CHECK(take(0.0, 0.0, 0.999 * reach_rad - 2.0 * M_PI) == Continuity::follows);
        CHECK(take(0.0, 0.0, 1.001 * reach_rad) == Continuity::strays);
        CHECK(take(0.0, 0.0, -1.001 * reach_rad) == Continuity::strays);
        CHECK(take(1e300, 1e300, 0.0) == Continuity::strays);
    }
    FrameJump frame = frame_of(4.0);
    REQUIRE(frame.take({0, 0.0, 0.0, 0.0}) == Continuity::follows);
    CHECK(frame.take({1, 0.0, 0.0, M_PI}) == Continuity::follows); // turns are not looked at
}

// A jump takes two poses that agree, however wild those between are; the pose after it follows the
// new frame, and one of the old frame strays.
TEST_CASE("wild poses stray, the second of another frame jumps")
{
    FrameJump frame = frame_of();
    std::int64_t t_us = 0;
    const auto take = [&frame, &t_us](double x_m) {
        t_us += kStep_us;
        return frame.take({t_us, x_m, 0.0, 0.0});
    };
    CHECK(take(0.0) == Continuity::follows);
    CHECK(take(500.0) == Continuity::strays); // wild
    CHECK(take(1.0) == Continuity::follows);
    CHECK(take(500.0) == Continuity::strays); // the one before is forgotten
    CHECK(take(-500.0) == Continuity::strays);
    CHECK(take(900.0) == Continuity::strays);
    CHECK(take(2.0) == Continuity::follows);
    CHECK(take(700.0) == Continuity::strays);
    CHECK(take(703.0) == Continuity::jumps);
    CHECK(take(706.0) == Continuity::follows);
    CHECK(take(4.0) == Continuity::strays); // late, of the old frame
    CHECK(take(709.0) == Continuity::follows);
}

// Whatever the first pose is, poses that agree with each other get through.
TEST_CASE("a wild first pose is left behind")
{
    FrameJump frame = frame_of();
    CHECK(frame.take({0, 0.0, 0.0, 0.0}) == Continuity::follows);
    CHECK(frame.take({kStep_us, 4e5, 5e6, 1.0}) == Continuity::strays);
    CHECK(frame.take({2 * kStep_us, 4e5, 5e6, 1.0}) == Continuity::jumps);
    CHECK(frame.take({3 * kStep_us, 4e5, 5e6, 1.0}) == Continuity::follows);
}
