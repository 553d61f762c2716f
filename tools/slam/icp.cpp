#include "tools/slam/icp.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{

namespace
{

constexpr int kIterations = 30;

double reach_of(int iteration) { return iteration < 5 ? 1.0 : iteration < 12 ? 0.4 : 0.2; }

Eigen::Vector2d place_of(const PolarReturn &r)
{
    return {r.range_m * std::cos(r.bearing_rad), r.range_m * std::sin(r.bearing_rad)};
}

} // namespace

/// The rows of returns at a pose in the frame of the reference: each against the line through the
/// nearest point of the reference and its neighbours.
std::vector<IcpMatcher::Row> IcpMatcher::rows_of(const std::vector<PolarReturn> &returns,
                                                 const Pose &pose, double reach_m) const
{
    std::vector<Row> rows;
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(pose.yaw_rad).toRotationMatrix();
    for (const PolarReturn &r : returns) {
        const Eigen::Vector2d lever_m = turn * place_of(r);
        const Eigen::Vector2d at_m = Eigen::Vector2d(pose.x_m, pose.y_m) + lever_m;
        double best2_m2 = reach_m * reach_m;
        std::size_t best = points_m_.size();
        for (std::size_t i = 0; i < points_m_.size(); ++i) {
            const double d2_m2 = (points_m_[i] - at_m).squaredNorm();
            if (d2_m2 < best2_m2) {
                best2_m2 = d2_m2;
                best = i;
            }
        }
        if (best < points_m_.size() && !normals_[best].isZero(0.0)) {
            const Eigen::Vector2d &n = normals_[best];
            rows.push_back({{n.x(), n.y(), -n.x() * lever_m.y() + n.y() * lever_m.x()},
                            n.dot(at_m - points_m_[best])});
        }
    }
    return rows;
}

Matched IcpMatcher::match(const Scan &scan, const PredictedPose &predicted)
{
    Matched matched;
    matched.pose = predicted.pose;
    const std::vector<PolarReturn> returns = returns_of(scan, n_returns_);
    Pose pose = between_poses(reference_, predicted.pose);
    for (int i = 0; i < kIterations && !points_m_.empty(); ++i) {
        const std::vector<Row> rows = rows_of(returns, pose, reach_of(i));
        if (rows.size() < 10) {
            break;
        }
        std::vector<double> sizes;
        for (const Row &row : rows) {
            sizes.push_back(std::abs(row.error_m));
        }
        const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
        std::nth_element(sizes.begin(), middle, sizes.end());
        const double scale_m = std::max(3.0 * *middle, 0.02);
        Eigen::Matrix3d h = 1e-4 * static_cast<double>(rows.size()) * Eigen::Matrix3d::Identity();
        Eigen::Vector3d g = Eigen::Vector3d::Zero();
        for (const Row &row : rows) {
            const double ratio = row.error_m / scale_m, weight = 1.0 / (1.0 + ratio * ratio);
            h += weight * row.j * row.j.transpose();
            g += weight * row.error_m * row.j;
        }
        const Eigen::Vector3d change = -h.ldlt().solve(g);
        pose = {pose.x_m + change(0), pose.y_m + change(1), wrap(pose.yaw_rad + change(2))};
        if (i > 13 && change.norm() < 1e-4) {
            break;
        }
    }
    const Pose found = reference_ * pose;
    if (between_poses(predicted.pose, found).distance_m() < 1.0) {
        matched.pose = found;
    }
    return matched;
}

void IcpMatcher::insert(const Scan &scan, const Matched &at)
{
    points_m_.clear();
    normals_.clear();
    for (const PolarReturn &r : returns_of(scan, n_returns_)) {
        points_m_.push_back(place_of(r));
    }
    for (std::size_t i = 0; i < points_m_.size(); ++i) {
        const Eigen::Vector2d along_m =
            points_m_[std::min(i + 1, points_m_.size() - 1)] - points_m_[i == 0 ? 0 : i - 1];
        const double length_m = along_m.norm();
        const bool is_line = length_m > 1e-6 && length_m < 0.1 + 0.15 * points_m_[i].norm();
        normals_.push_back(is_line ? Eigen::Vector2d(-along_m.y(), along_m.x()) / length_m
                                   : Eigen::Vector2d(0.0, 0.0));
    }
    reference_ = at.pose;
}

} // namespace gpom_tools
