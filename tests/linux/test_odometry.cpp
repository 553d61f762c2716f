// Dead reckoning against drives that are known exactly, and its covariance against many drives.
#include "ports/linux/pose/odometry.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>

using gpomd::Motion;
using gpomd::Odometry;
using gpomd::OdometryConfig;
using gpomd::PoseCov;
using gpomd::PoseMatch;
using gpomd::StampedPose;

namespace
{

constexpr OdometryConfig kConfig = {200000, 5000000, 0.02, 0.01, 0.05, 0.005};
constexpr std::int64_t kStep_us = 20000;

std::unique_ptr<Odometry> odometry_with(const OdometryConfig &config = kConfig)
{
    auto odometry = std::make_unique<Odometry>();
    odometry->init(config);
    return odometry;
}

std::uint64_t seed()
{
    const char *const text = std::getenv("GPOM_SEED");
    return text != nullptr ? std::strtoull(text, nullptr, 10) : 1;
}

} // namespace

// A circle: the pose after any time is known in closed form.
TEST_CASE("a pose is carried along a circle from any time to any other")
{
    const auto odometry = odometry_with();
    const double speed = 8.0, turn = 0.6;
    for (std::int64_t t_us = 0; t_us <= 4000000; t_us += kStep_us) {
        REQUIRE(odometry->push({t_us, speed, turn}));
    }
    for (const std::int64_t from_us : {0, 1, 19999, 20000, 777777}) {
        for (const std::int64_t to_us : {777777, 777778, 1000000, 3999999, 4000000}) {
            StampedPose pose = {};
            PoseCov cov = {};
            REQUIRE(odometry->carry({from_us, 100.0, -50.0, 1.0}, to_us, pose, cov) ==
                    PoseMatch::found);
            const double t_s = 1e-6 * static_cast<double>(to_us - from_us), r = speed / turn;
            CHECK(pose.stamp_us == to_us);
            CHECK(pose.yaw_rad == doctest::Approx(1.0 + turn * t_s));
            CHECK(pose.x_m ==
                  doctest::Approx(100.0 + r * (std::sin(1.0 + turn * t_s) - std::sin(1.0)))
                      .epsilon(1e-5));
            CHECK(pose.y_m ==
                  doctest::Approx(-50.0 - r * (std::cos(1.0 + turn * t_s) - std::cos(1.0)))
                      .epsilon(1e-5));
        }
    }
}

TEST_CASE("speed that grows steadily gives the way of constant acceleration")
{
    const auto odometry = odometry_with();
    for (std::int64_t t_us = 0; t_us <= 2000000; t_us += 100000) {
        REQUIRE(odometry->push({t_us, 3e-6 * static_cast<double>(t_us), 0.0}));
    }
    StampedPose pose = {};
    PoseCov cov = {};
    REQUIRE(odometry->carry({350000, 0.0, 0.0, 0.0}, 1730000, pose, cov) == PoseMatch::found);
    CHECK(pose.x_m == doctest::Approx(1.5 * (1.73 * 1.73 - 0.35 * 0.35)));
    CHECK(pose.y_m == 0.0);
}

TEST_CASE("odometry that is absent, late or too long ago carries nothing and changes nothing")
{
    const auto odometry = odometry_with();
    StampedPose pose = {};
    PoseCov cov = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::int64_t newest_us = 0;
    CHECK_FALSE(odometry->newest(newest_us));
    const auto carry = [&](std::int64_t from_us, std::int64_t to_us) {
        return odometry->carry({from_us, 0.0, 0.0, 0.0}, to_us, pose, cov);
    };
    CHECK(carry(0, 10) == PoseMatch::not_yet);
    for (std::int64_t t_us = 1000000; t_us <= 2000000; t_us += 200000) {
        REQUIRE(odometry->push({t_us, 1.0, 0.0}));
    }
    for (std::int64_t t_us = 2200001; t_us <= 9000000; t_us += 200000) { // 1 us too long
        REQUIRE(odometry->push({t_us, 1.0, 0.0}));
    }
    CHECK(odometry->newest(newest_us));
    CHECK(carry(1000000, newest_us + 1) == PoseMatch::not_yet);
    CHECK(carry(999999, 1500000) == PoseMatch::gap); // before the first
    CHECK(carry(1500000, 1499999) == PoseMatch::gap);
    CHECK(carry(1500000, 2000001) == PoseMatch::gap); // over the hole
    CHECK(carry(2100000, 2300000) == PoseMatch::gap); // from within it
    CHECK(carry(2200001, 7200002) == PoseMatch::gap); // longer than carry_us
    for (std::size_t i = 0; i < 9; ++i) {
        CHECK(cov[i] == (i % 4 == 0 ? 1.0 : 0.0));
    }
    CHECK(carry(1000000, 2000000) == PoseMatch::found);
    CHECK(carry(2200001, 7200001) == PoseMatch::found);
}

TEST_CASE("older motions are refused until the clock must have been set back; equal ones replace")
{
    const auto odometry = odometry_with();
    REQUIRE(odometry->push({5000000, 1.0, 0.0}));
    REQUIRE(odometry->push({5100000, 1.0, 0.0}));
    REQUIRE(odometry->push({5100000, 3.0, 0.0})); // the other wheel's message, same microsecond
    StampedPose pose = {};
    PoseCov cov = {};
    REQUIRE(odometry->carry({5000000, 0.0, 0.0, 0.0}, 5100000, pose, cov) == PoseMatch::found);
    CHECK(pose.x_m == doctest::Approx(0.2));
    for (int i = 1; i <= 10; ++i) {
        CHECK(odometry->push({i * 1000, 1.0, 0.0}) == (i == 10));
    }
    std::int64_t newest_us = 0;
    CHECK(odometry->newest(newest_us));
    CHECK(newest_us == 10000);
}

TEST_CASE("motions that no vehicle makes are none")
{
    CHECK(Odometry::is_sane({0, 30.0, -1.0}));
    for (const double bad : {double{NAN}, HUGE_VAL, -HUGE_VAL, 1e3}) {
        CHECK_FALSE(Odometry::is_sane({0, bad, 0.0}));
        CHECK_FALSE(Odometry::is_sane({0, 0.0, bad}));
    }
}

// Monte Carlo: drives whose motions have just those errors end with just that covariance.
TEST_CASE("the covariance is that of many drives with such errors")
{
    const PoseCov before = {0.04, 0.01, 0.002, 0.01, 0.02, -0.001, 0.002, -0.001, 0.0009};
    constexpr int kDrives = 4000, kSteps = 100;
    constexpr double kDt_s = 1e-6 * kStep_us;
    std::mt19937_64 random(seed());
    std::normal_distribution<double> normal;
    INFO("seed ", seed());
    const auto truth = [](int i) {
        return Motion{i * kStep_us, 6.0 + 2.0 * std::sin(0.05 * i), 0.5 * std::cos(0.03 * i)};
    };
    const auto end_of = [](const Odometry &odometry, const StampedPose &from, PoseCov &cov) {
        StampedPose pose = {};
        REQUIRE(odometry.carry(from, kSteps * kStep_us, pose, cov) == PoseMatch::found);
        return pose;
    };
    const auto exact = odometry_with();
    for (int i = 0; i <= kSteps; ++i) {
        REQUIRE(exact->push(truth(i)));
    }
    PoseCov cov;
    std::copy_n(before, 9, cov);
    const StampedPose end = end_of(*exact, {0, 0.0, 0.0, 0.4}, cov);
    double sums[9] = {};
    // Cholesky factor of `before`, by hand
    const double l00 = 0.2, l10 = 0.05, l20 = 0.01, l11 = std::sqrt(0.02 - 0.0025),
                 l21 = (-0.001 - 0.0005) / l11, l22 = std::sqrt(0.0009 - 0.0001 - l21 * l21);
    for (int drive = 0; drive < kDrives; ++drive) {
        const auto odometry = odometry_with();
        const double scale = 1.0 + kConfig.speed_scale_sd * normal(random);
        const double bias = kConfig.yaw_rate_bias_sd * normal(random);
        for (int i = 0; i <= kSteps; ++i) {
            Motion motion = truth(i);
            motion.speed_mps =
                motion.speed_mps * scale + kConfig.speed_noise / std::sqrt(kDt_s) * normal(random);
            motion.yaw_rate_radps +=
                bias + kConfig.yaw_rate_noise / std::sqrt(kDt_s) * normal(random);
            REQUIRE(odometry->push(motion));
        }
        const double a = normal(random), b = normal(random), c = normal(random);
        PoseCov ignored = {};
        const StampedPose wrong = end_of(
            *odometry, {0, l00 * a, l10 * a + l11 * b, 0.4 + l20 * a + l21 * b + l22 * c}, ignored);
        const double error[3] = {wrong.x_m - end.x_m, wrong.y_m - end.y_m,
                                 wrong.yaw_rad - end.yaw_rad};
        for (std::size_t i = 0; i < 9; ++i) {
            sums[i] += error[i / 3] * error[i % 3];
        }
    }
    for (std::size_t i = 0; i < 9; ++i) {
        const double bound = std::sqrt(cov[4 * (i / 3)] * cov[4 * (i % 3)]);
        CHECK(sums[i] / kDrives == doctest::Approx(cov[i]).scale(bound).epsilon(0.1));
        CHECK(cov[i] == doctest::Approx(cov[3 * (i % 3) + i / 3]));
    }
    CHECK(cov[0] > before[0]);
    CHECK(cov[8] > before[8]);
}

// A drive whose wheels are 3 % too fast and whose gyro drifts: each pose teaches both.
TEST_CASE("constant errors are learnt from poses, and what is learnt makes the next way better")
{
    const auto odometry = odometry_with();
    std::mt19937_64 random(seed());
    std::normal_distribution<double> normal;
    INFO("seed ", seed());
    constexpr double kScale = 0.03, kBias = -0.015;
    const auto ideal = odometry_with();
    for (std::int64_t t_us = 0; t_us <= 60000000; t_us += kStep_us) {
        const double t_s = 1e-6 * static_cast<double>(t_us);
        const Motion truth = {t_us, 6.0 + 2.0 * std::sin(t_s), 0.3 * std::cos(0.7 * t_s)};
        REQUIRE(ideal->push(truth));
        REQUIRE(
            odometry->push({t_us, truth.speed_mps / (1.0 - kScale), truth.yaw_rate_radps + kBias}));
    }
    const float cov[9] = {4e-4f, 0, 0, 0, 4e-4f, 0, 0, 0, 1e-4f};
    StampedPose truth = {0, 0.0, 0.0, 0.0}, measured = truth, before = {};
    const auto next = [&] { // two seconds on
        PoseCov ignored = {};
        REQUIRE(ideal->carry(truth, truth.stamp_us + 2000000, truth, ignored) == PoseMatch::found);
        before = measured;
        measured = {truth.stamp_us, truth.x_m + 0.02 * normal(random),
                    truth.y_m + 0.02 * normal(random), truth.yaw_rad + 0.01 * normal(random)};
    };
    const double scale_var = odometry->errors().scale_var, bias_var = odometry->errors().bias_var;
    for (int i = 0; i < 25; ++i) {
        next();
        REQUIRE(odometry->learn(before, measured, cov));
    }
    const gpomd::OdometryErrors learnt = odometry->errors();
    CHECK(std::fabs(learnt.scale - kScale) < 4.0 * std::sqrt(learnt.scale_var));
    CHECK(std::fabs(learnt.bias_radps - kBias) < 4.0 * std::sqrt(learnt.bias_var));
    CHECK(learnt.scale_var < 0.1 * scale_var);
    CHECK(learnt.bias_var < 0.3 * bias_var);
    const StampedPose from = truth;
    next();
    StampedPose pose = {};
    PoseCov carried = {};
    REQUIRE(odometry->carry(from, truth.stamp_us, pose, carried) == PoseMatch::found);
    CHECK(std::hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m) <
          4.0 * std::sqrt(carried[0] + carried[4]));
    CHECK(carried[0] + carried[4] < 0.15 * 0.15);
}

TEST_CASE("a pose that jumps, one seen before, and one ahead of the odometry teach nothing")
{
    const auto odometry = odometry_with();
    for (std::int64_t t_us = 0; t_us <= 10000000; t_us += kStep_us) {
        REQUIRE(odometry->push({t_us, 5.0, 0.0}));
    }
    const float cov[9] = {4e-4f, 0, 0, 0, 4e-4f, 0, 0, 0, 1e-4f};
    const StampedPose start = {1000000, 0.0, 0.0, 0.0};
    CHECK(odometry->learn(start, {3000000, 10.0, 5.0, 0.0}, cov)); // 5 m aside
    CHECK(odometry->errors().scale == 0.0);
    CHECK(odometry->errors().bias_radps == 0.0);
    CHECK(odometry->learn(start, {3000000, 9.8, 0.0, 0.0}, cov)); // begins before the last ended
    CHECK(odometry->errors().scale == 0.0);
    CHECK_FALSE(odometry->learn({9000000, 0.0, 0.0, 0.0}, {10000001, 5.0, 0.0, 0.0}, cov));
    CHECK(odometry->learn({3000000, 0.0, 0.0, 0.0}, {5000000, 9.8, 0.0, 0.0}, cov));
    CHECK(odometry->errors().scale == doctest::Approx(0.02).epsilon(0.2)); // 10 m were 9.8
}
