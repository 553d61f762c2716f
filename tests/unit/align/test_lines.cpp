// Lines through kept hits, and the information of a scan, beside brute force in double.
#include "src/align/lines.hpp"
#include "src/map/map.hpp"
#include "tests/common/room_fixture.hpp"

using namespace reference;

namespace
{

struct Hit {
    double d2_m2;
    Eigen::Vector2d at_m;
};

/// The kept hits nearest to a point, each looked at; those seen from the other side left out.
std::vector<Hit> nearest_hits(const TestMap &map, const Eigen::Vector2d &at_m,
                              const Eigen::Vector2d &direction, double reach_m)
{
    std::vector<Hit> hits;
    for (const gpom_beam_t &b : map.beams()) {
        const Eigen::Vector2d along(double{b.dir_x}, double{b.dir_y});
        const Eigen::Vector2d hit_m = Eigen::Vector2d(b.x_m, b.y_m) + double{b.range_m} * along;
        const double d2_m2 = (hit_m - at_m).squaredNorm();
        if (b.is_hit != 0 && b.provisional == 0 && b.past == 0 && along.dot(direction) >= -0.3 &&
            d2_m2 <= reach_m * reach_m) {
            hits.push_back({d2_m2, hit_m});
        }
    }
    std::sort(hits.begin(), hits.end(),
              [](const Hit &a, const Hit &b) { return a.d2_m2 < b.d2_m2; });
    hits.resize(std::min<std::size_t>(hits.size(), 6));
    return hits;
}

struct OracleLine {
    Eigen::Vector2d middle_m, normal;
    bool is_line, is_any;
};

OracleLine oracle_line(std::vector<Hit> hits)
{
    while (hits.size() > 2 && std::sqrt(hits.back().d2_m2) > std::sqrt(hits.front().d2_m2) + 0.25) {
        hits.pop_back();
    }
    if (hits.size() < 2) {
        return {{0, 0}, {0, 0}, false, false};
    }
    Eigen::Vector2d mean(0, 0);
    for (const Hit &hit : hits) {
        mean += hit.at_m / static_cast<double>(hits.size());
    }
    Eigen::Matrix2d cov = Eigen::Matrix2d::Zero();
    for (const Hit &hit : hits) {
        cov += (hit.at_m - mean) * (hit.at_m - mean).transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(cov);
    return {mean, axes.eigenvectors().col(0), axes.eigenvalues()(0) <= 0.15 * axes.eigenvalues()(1),
            true};
}

/// The line of a return of a scan at a pose, and its distance.
double oracle_distance(const OracleLine &line, const Eigen::Vector2d &at_m)
{
    return line.is_line ? std::abs(line.normal.dot(at_m - line.middle_m))
                        : 0.5 * (at_m - line.middle_m).norm();
}

Eigen::Vector2d place_of(const TestScan &scan, std::size_t i, const Eigen::Vector3d &pose)
{
    const double angle_rad =
        pose(2) + scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad;
    return {pose(0) + double{scan.ranges_m[i]} * std::cos(angle_rad),
            pose(1) + double{scan.ranges_m[i]} * std::sin(angle_rad)};
}

} // namespace

TEST_CASE("lines: the line near any point is that of brute force, also after small moves")
{
    GPOM_TELL_SEED();
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    int n_lines = 0, n_spots = 0;
    for (int i = 0; i < 600; ++i) {
        Eigen::Vector2d at_m(random.uniform(-0.5, 9.5), random.uniform(-0.5, 7.5));
        const double angle_rad = random.uniform(-3.1, 3.1);
        const float reach_m = random.below(2) == 0 ? 1.0f : 0.25f;
        gpom::LineSearch search = {};
        gpom::Line line = {};
        for (int k = 0; k < 4; ++k) {
            const double turned_rad = angle_rad + 0.1 * k;
            const Eigen::Vector2d direction(std::cos(turned_rad), std::sin(turned_rad));
            gpom::find_line(*map.get(), {at_m.cast<float>(), direction.cast<float>()}, reach_m,
                            search, line);
            const OracleLine expected = oracle_line(
                nearest_hits(map, at_m.cast<float>().cast<double>(), direction, double{reach_m}));
            REQUIRE((line.shape != gpom::Shape::kNone) == expected.is_any);
            if (expected.is_any) {
                CHECK((line.middle_m.cast<double>() - expected.middle_m).norm() < 1e-5);
                CHECK((line.shape == gpom::Shape::kLine) == expected.is_line);
            }
            if (expected.is_line) {
                CHECK(std::abs(line.normal.cast<double>().dot(expected.normal)) > 1.0 - 1e-3);
                ++n_lines;
            }
            n_spots += expected.is_any && !expected.is_line ? 1 : 0;
            at_m += Eigen::Vector2d(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05));
        }
    }
    CHECK(n_lines > 50);
    CHECK(n_spots > 5);
}

TEST_CASE("align: the covariance is that of numeric derivatives of brute-force distances")
{
    GPOM_TELL_SEED();
    Random random(seed());
    TestMap map(room_config());
    map_room(map, l_room(), l_poses(), random);
    const PriorCov prior(0.3, 0.2);
    for (int k = 0; k < 5; ++k) {
        const gpom_pose_t right = {random.uniform(2, 8), random.uniform(1, 3), 0.3 * k, nullptr};
        const TestScan scan = room_scan(l_room(), right, 100, random, 0.01);
        const Alignment a(map.get(), scan,
                          {right.x_m + 0.05, right.y_m, right.yaw_rad + 0.02, prior.by_rows});
        REQUIRE(a.found.flags == 0);
        const Eigen::Vector3d at(a.found.x_m, a.found.y_m, a.found.yaw_rad);
        std::vector<double> distances;
        std::vector<Eigen::Matrix3d> terms;
        for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
            const Eigen::Vector2d here = place_of(scan, i, at);
            const Eigen::Vector2d beam = (here - at.head<2>()).normalized();
            const OracleLine line = oracle_line(nearest_hits(map, here, beam, 0.25));
            if (!line.is_any) {
                continue;
            }
            Eigen::Matrix<double, 2, 3> by_pose;
            for (int axis = 0; axis < 3; ++axis) {
                const Eigen::Vector3d h = 1e-5 * Eigen::Vector3d::Unit(axis);
                by_pose.col(axis) = (place_of(scan, i, at + h) - place_of(scan, i, at - h)) / 2e-5;
            }
            const Eigen::Vector3d along = by_pose.transpose() * line.normal;
            distances.push_back(oracle_distance(line, here));
            terms.push_back(line.is_line ? Eigen::Matrix3d(along * along.transpose())
                                         : Eigen::Matrix3d(0.25 * by_pose.transpose() * by_pose));
        }
        std::vector<double> sorted = distances;
        std::sort(sorted.begin(), sorted.end());
        const double scale_m = std::max(2.5 * sorted[sorted.size() / 2], 0.03);
        Eigen::Matrix3d information = Eigen::Vector3d(1 / 0.09, 1 / 0.09, 1 / 0.04).asDiagonal();
        const double n = static_cast<double>(distances.size());
        const double share = 10.0 / n / std::pow(std::max(0.03, scale_m / 2.5), 2.0);
        for (std::size_t i = 0; i < distances.size(); ++i) {
            const double ratio = distances[i] / scale_m;
            information += share / (1.0 + ratio * ratio) * terms[i];
        }
        const Eigen::Matrix3d cov = information.inverse();
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) { // a few lines are those of 5 mm before
                const double scale = std::sqrt(cov(i, i) * cov(j, j));
                CHECK(std::abs(a.cov()(i, j) - cov(i, j)) < 0.1 * scale);
            }
        }
    }
}
