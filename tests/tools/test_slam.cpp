// gpom-slam: known errors of a way, scans matched by their ranges, all matchers in a room.
#include "tools/slam/errors.hpp"
#include "tools/slam/gpom_matcher.hpp"
#include "tools/slam/hector.hpp"
#include "tools/slam/icp.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

using namespace gpom_tools;

namespace
{

/// A way of n scans along an arc; corrected poses are right.
std::vector<DrivenScan> arc(std::size_t n)
{
    std::vector<DrivenScan> log(n);
    for (std::size_t i = 0; i < n; ++i) {
        const double angle_rad = 0.05 * static_cast<double>(i);
        log[i].scan.t_s = static_cast<double>(i);
        log[i].corrected =
            Pose{10.0 * std::sin(angle_rad), 10.0 - 10.0 * std::cos(angle_rad), angle_rad};
    }
    return log;
}

std::vector<Visited> moved_way(const std::vector<DrivenScan> &log, const Pose &move)
{
    std::vector<Visited> way;
    for (std::size_t i = 0; i < log.size(); ++i) {
        way.push_back({i, move * *log[i].corrected});
    }
    return way;
}

/// A scan of a rectangular room of 8 m x 6 m around (0, 0) with a niche, by brute force.
Scan room_scan(const Pose &at)
{
    Scan scan = {0.0, at.x_m, at.y_m, at.yaw_rad, -M_PI, M_PI / 90.0, 30.0, {}};
    for (int i = 0; i < 180; ++i) {
        const double angle_rad = at.yaw_rad + scan.angle_min_rad + i * scan.angle_step_rad;
        double d_m = 0.0;
        for (double x = at.x_m, y = at.y_m;
             std::abs(y) < 3.0 && (std::abs(x) < 4.0 || (x > 0.0 && x < 5.0 && y > 0.0 && y < 1.5));
             x = at.x_m + d_m * std::cos(angle_rad), y = at.y_m + d_m * std::sin(angle_rad)) {
            d_m += 0.002;
        }
        scan.ranges_m.push_back(static_cast<float>(d_m));
    }
    return scan;
}

} // namespace

TEST_CASE("slam: a rigid motion of the whole way is no error")
{
    const std::vector<DrivenScan> log = arc(60);
    const std::vector<Visited> way = moved_way(log, {7.0, -3.0, 2.0});
    CHECK(absolute_rms_m(log, way) < 1e-9);
    CHECK(relative_error(log, way, 1.0).place_m < 1e-9);
    CHECK(relative_error(log, way, 10.0).yaw_rad < 1e-9);
    const std::vector<Relation> relations = {
        {3.0, 9.0, between_poses(*log[3].corrected, *log[9].corrected)},
        {3.0, 999.0, {}}}; // nobody was there
    CHECK(relation_error(relations, log, way).n == 1);
    CHECK(relation_error(relations, log, way).place_m < 1e-9);
}

TEST_CASE("slam: a known error of one pose has the size that the metrics say")
{
    const std::vector<DrivenScan> log = arc(60);
    std::vector<Visited> way = moved_way(log, {});
    way[30].pose.x_m += 0.6; // alone: the best rigid motion hardly moves
    CHECK(absolute_rms_m(log, way) == doctest::Approx(0.6 / std::sqrt(60.0)).epsilon(0.05));
    const std::vector<Relation> relations = {
        {10.0, 30.0, between_poses(*log[10].corrected, *log[30].corrected)},
        {10.0, 31.0, between_poses(*log[10].corrected, *log[31].corrected)}};
    const RelationError error = relation_error(relations, log, way);
    CHECK(error.place_m == doctest::Approx(0.3));
    CHECK(error.place_sd_m == doctest::Approx(0.3));
}

TEST_CASE("slam: each matcher finds a pose in a room that it has seen, and a wrong one is repaired")
{
    GpomMatcherOptions options;
    gpom_align_config_init(&options.align);
    gpom_params_t params;
    gpom_params_init(&params);
    std::vector<std::unique_ptr<Matcher>> matchers;
    matchers.push_back(
        std::make_unique<GpomMatcher>(live_config(params, LiveConfig{}, {0.0, 0.0}), options));
    matchers.push_back(std::make_unique<HectorMatcher>(Pose{}, 20.0, HectorOptions{}));
    matchers.push_back(std::make_unique<IcpMatcher>(180));
    const Pose right = {0.6, 0.4, 0.25};
    const Scan scan = room_scan(right);
    for (const std::unique_ptr<Matcher> &matcher : matchers) {
        for (int i = 0; i < 10; ++i) {
            Matched at;
            at.pose = {0.05 * i, 0.03 * i, 0.02 * i};
            matcher->insert(room_scan(at.pose), at);
        }
        const Pose start = right * Pose{0.1, -0.1, 0.05};
        const Matched found = matcher->match(scan, {start, 0.1, 0.05});
        const Pose error = between_poses(right, found.pose);
        CHECK(error.distance_m() < 0.04);
        CHECK(std::abs(error.yaw_rad) < 0.015);
    }
}

TEST_CASE("slam: scans of the corrected log are found by their ranges, in order")
{
    const std::string raw_path = "test_slam_raw.csv", corrected_path = "test_slam_corrected.csv";
    std::vector<Scan> raw;
    for (int i = 0; i < 6; ++i) {
        const float range_m = i == 3 ? 1.0f : 1.0f + 0.1f * static_cast<float>(i); // 3 is like 0
        raw.push_back({1.0 * i, 0.1 * i, 0.0, 0.0, 0.0, 0.1, 30.0, {range_m, 2.0f, 3.0f}});
    }
    std::vector<Scan> corrected = {raw[0], raw[3], raw[5]};
    for (Scan &scan : corrected) {
        scan.y_m = 100.0 + scan.x_m;
    }
    write_scans_csv(raw_path, raw, "raw");
    write_scans_csv(corrected_path, corrected, "corrected");
    const std::vector<DrivenScan> log = read_raw_log(raw_path, corrected_path, ReadOptions{});
    REQUIRE(log.size() == 6);
    for (std::size_t i = 0; i < 6; ++i) {
        const bool is_corrected = i == 0 || i == 3 || i == 5;
        REQUIRE(log[i].corrected.has_value() == is_corrected);
        CHECK((!is_corrected || log[i].corrected->y_m == 100.0 + raw[i].x_m));
    }
    write_scans_csv(corrected_path, {raw[0]}, "one alone");
    CHECK_THROWS_AS(read_raw_log(raw_path, corrected_path, ReadOptions{}), FileError);
    std::remove(raw_path.c_str());
    std::remove(corrected_path.c_str());
}
