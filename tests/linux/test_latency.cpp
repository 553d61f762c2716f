#include "ports/linux/map/latency.hpp"

#include "tests/common/reference.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

using namespace gpomd;

namespace
{

/// A robot that drives about in a room of 12 m by 9 m with a pillar, and turns now and then.
struct Drive {
    double turn_radps, forward_m;

    double yaw_rad(double t_s) const
    {
        return turn_radps * (std::sin(0.7 * t_s) + 0.5 * std::sin(1.9 * t_s));
    }
    double x_m(double t_s) const { return forward_m * std::sin(0.2 * t_s); }
    double y_m(double t_s) const { return 0.5 * forward_m * std::sin(0.31 * t_s); }

    /// Distance to the first wall along a direction.
    double range_m(double t_s, double bearing_rad) const
    {
        const double direction = yaw_rad(t_s) + bearing_rad;
        const double c = std::cos(direction), s = std::sin(direction);
        const double x = x_m(t_s), y = y_m(t_s);
        const double along_x = c > 0.0 ? (7.0 - x) / c : c < 0.0 ? (-5.0 - x) / c : 1e9;
        const double along_y = s > 0.0 ? (4.0 - y) / s : s < 0.0 ? (-5.0 - y) / s : 1e9;
        const double px = 3.0 - x, py = 2.0 - y; // the pillar
        const double nearest = px * c + py * s;
        const double off2 = px * px + py * py - nearest * nearest;
        const double pillar = nearest > 0.0 && off2 < 0.25 ? nearest - std::sqrt(0.25 - off2) : 1e9;
        return std::min({along_x, along_y, pillar});
    }
};

struct Set {
    double latency_s; ///< Stamps of scans are so late.
    double scan_period_s, pose_period_s;
    std::uint32_t n_ranges; ///< Over 270 degrees.
    bool upside_down;
};

/// What is found of a drive of so many seconds. NaN: nothing.
double found(const Drive &drive, const Set &set, double span_s)
{
    const auto latency = std::make_unique<Latency>();
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.upside_down = set.upside_down ? 1 : 0;
    latency->init(sensor);
    std::mt19937_64 random(reference::seed());
    std::normal_distribution<double> noise(0.0, 0.02);
    std::vector<float> ranges_m(set.n_ranges);
    ScanSlot slot = {};
    slot.ranges_m = ranges_m.data();
    slot.n_ranges = set.n_ranges;
    slot.angle_step_rad = 1.5 * M_PI / (set.n_ranges - 1);
    slot.angle_min_rad = -0.75 * M_PI;
    double pose_s = 0.0;
    for (double t_s = 0.0; t_s < span_s; t_s += set.scan_period_s) {
        for (; pose_s <= t_s; pose_s += set.pose_period_s) {
            latency->take_pose(std::llround(1e6 * pose_s), drive.yaw_rad(pose_s));
        }
        slot.stamp_us = std::llround(1e6 * (t_s + set.latency_s));
        for (std::uint32_t i = 0; i < set.n_ranges; ++i) {
            const double bearing_rad = slot.angle_min_rad + i * slot.angle_step_rad;
            ranges_m[i] = static_cast<float>(
                drive.range_m(t_s, set.upside_down ? -bearing_rad : bearing_rad) + noise(random));
        }
        latency->take_scan(slot);
    }
    double latency_s = 0.0;
    return latency->find(latency_s) ? latency_s : reference::kNan;
}

} // namespace

// Of scans and poses at several rates, fine and coarse, upside down, of a robot that drives and
// turns: to 10 ms within a minute. The issue asks for 30 ms.
TEST_CASE("a constant latency between scans and poses is found")
{
    GPOM_TELL_SEED();
    const Drive drive = {0.5, 1.5};
    for (const double latency_s : {-0.3, 0.0, 0.1, 0.25, 0.6}) {
        for (const Set &set :
             {Set{latency_s, 0.1, 0.02, 271, false}, Set{latency_s, 0.025, 0.01, 541, true},
              Set{latency_s, 0.1, 0.1, 91, false}}) {
            CAPTURE(latency_s);
            CAPTURE(set.n_ranges);
            CHECK(found(drive, set, 60.0) == doctest::Approx(latency_s).scale(1.0).epsilon(0.01));
        }
    }
}

// Without turns, or where every direction looks alike, there is nothing to tell it by.
TEST_CASE("no latency is found where nothing tells it")
{
    GPOM_TELL_SEED();
    CHECK(std::isnan(found({0.0, 1.5}, {0.25, 0.1, 0.02, 271, false}, 60.0)));
    CHECK(std::isnan(found({0.001, 0.0}, {0.25, 0.1, 0.02, 271, false}, 60.0)));
    CHECK(std::isnan(found({0.5, 1.5}, {0.25, 0.1, 0.02, 271, false}, 2.0)));
}

// Yaw goes on over +-pi; a pose after a gap begins anew.
TEST_CASE("the yaw track has no jump at half a turn")
{
    const auto track = std::make_unique<YawTrack>();
    for (int i = 0; i < 5000; ++i) {
        track->push(10000 * i, std::remainder(0.05 * i, 2.0 * M_PI));
    }
    double early_rad = 0.0, late_rad = 0.0;
    REQUIRE(track->at(45000000, early_rad));
    REQUIRE(track->at(49995000 - 10000, late_rad));
    CHECK(late_rad - early_rad == doctest::Approx(0.05 * 498.5).epsilon(1e-9));
    CHECK(!track->at(10000, early_rad)); // no longer kept
    CHECK(!track->at(60000000, early_rad));
    track->push(60000000, 0.0);
    CHECK(!track->at(49000000, early_rad));
}
