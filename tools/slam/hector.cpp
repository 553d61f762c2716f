#include "tools/slam/hector.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{

namespace
{

double probability(float log_odds) { return 1.0 - 1.0 / (1.0 + std::exp(double{log_odds})); }

double log_odds_of(double p) { return std::log(p / (1.0 - p)); }

} // namespace

HectorMatcher::HectorMatcher(Pose middle, double side_m, const HectorOptions &options)
    : options_(options), x0_m_(middle.x_m - side_m / 2), y0_m_(middle.y_m - side_m / 2)
{
    for (int i = 0; i < options.n_levels; ++i) {
        const double cell_m = options.cell_m * (1 << i);
        const int n_side = static_cast<int>(side_m / cell_m) + 2;
        const auto n_cells = static_cast<std::size_t>(n_side) * static_cast<std::size_t>(n_side);
        grids_.push_back(
            {cell_m, n_side, std::vector<float>(n_cells, 0.0f), std::vector<int>(n_cells, 0)});
    }
}

/// The occupancy and its gradient, bilinear between the centres of cells (their eq. 4 to 6).
HectorMatcher::Sample HectorMatcher::sample(const Grid &grid, double x_m, double y_m) const
{
    const double u = (x_m - x0_m_) / grid.cell_m - 0.5, v = (y_m - y0_m_) / grid.cell_m - 0.5;
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
    if (i < 0 || j < 0 || i + 1 >= grid.n_side || j + 1 >= grid.n_side) {
        return {0.0, 0.0, 0.0, false};
    }
    const double a = u - i, b = v - j;
    const auto n_side = static_cast<std::size_t>(grid.n_side);
    const float *const low =
        &grid.log_odds[static_cast<std::size_t>(j) * n_side + static_cast<std::size_t>(i)];
    const double p00 = probability(low[0]), p10 = probability(low[1]);
    const double p01 = probability(low[n_side]), p11 = probability(low[n_side + 1]);
    return {(1 - b) * ((1 - a) * p00 + a * p10) + b * ((1 - a) * p01 + a * p11),
            ((1 - b) * (p10 - p00) + b * (p11 - p01)) / grid.cell_m,
            ((1 - a) * (p01 - p00) + a * (p11 - p10)) / grid.cell_m, true};
}

/// One Gauss-Newton step (their eq. 8 to 13). False if the normal equations are singular.
bool HectorMatcher::step(const Grid &grid, const std::vector<PolarReturn> &returns,
                         Matched &matched) const
{
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const PolarReturn &r : returns) {
        const double angle_rad = matched.pose.yaw_rad + r.bearing_rad;
        const double x_m = r.range_m * std::cos(angle_rad), y_m = r.range_m * std::sin(angle_rad);
        const Sample s = sample(grid, matched.pose.x_m + x_m, matched.pose.y_m + y_m);
        if (s.is_inside) {
            const Eigen::Vector3d j(s.by_x, s.by_y, -s.by_x * y_m + s.by_y * x_m);
            h += j * j.transpose();
            g += j * (1.0 - s.p);
        }
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(h);
    if (!lu.isInvertible()) {
        return false;
    }
    const Eigen::Vector3d change = lu.solve(g);
    const double turn_rad = std::clamp(change(2), -0.2, 0.2); // as their implementation does
    matched.pose.x_m += change(0);
    matched.pose.y_m += change(1);
    matched.pose.yaw_rad = wrap(matched.pose.yaw_rad + turn_rad);
    return true;
}

Matched HectorMatcher::match(const Scan &scan, const PredictedPose &predicted)
{
    Matched matched;
    matched.pose = predicted.pose;
    if (n_inserted_ == 0) {
        return matched;
    }
    const std::vector<PolarReturn> returns = returns_of(scan, options_.n_returns);
    for (std::size_t level = grids_.size(); level-- > 0;) {
        const int n_steps = level == 0 ? 10 : 6;
        for (int i = 0; i < n_steps && step(grids_[level], returns, matched); ++i) {
        }
    }
    const double way_m = between_poses(predicted.pose, matched.pose).distance_m();
    if (!(way_m <= 1.5)) { // it left its basin
        matched.pose = predicted.pose;
    }
    return matched;
}

void HectorMatcher::mark(Grid &grid, double x_m, double y_m, bool is_occupied)
{
    const int i = static_cast<int>(std::floor((x_m - x0_m_) / grid.cell_m));
    const int j = static_cast<int>(std::floor((y_m - y0_m_) / grid.cell_m));
    if (i < 0 || j < 0 || i >= grid.n_side || j >= grid.n_side) {
        return;
    }
    const std::size_t cell = static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.n_side) +
                             static_cast<std::size_t>(i);
    const int free_mark = 2 * n_inserted_, occupied_mark = free_mark + 1;
    if (grid.marked[cell] >= (is_occupied ? occupied_mark : free_mark)) {
        return; // a scan changes a cell once; occupied wins
    }
    const double free_change = log_odds_of(options_.p_free);
    double change = is_occupied ? log_odds_of(options_.p_occupied) : free_change;
    if (is_occupied && grid.marked[cell] == free_mark) {
        change -= free_change;
    }
    grid.marked[cell] = is_occupied ? occupied_mark : free_mark;
    grid.log_odds[cell] =
        std::clamp(grid.log_odds[cell] + static_cast<float>(change), -50.0f, 50.0f);
}

void HectorMatcher::insert(const Scan &scan, const Matched &at)
{
    ++n_inserted_;
    const std::vector<PolarReturn> returns = returns_of(scan, scan.ranges_m.size());
    for (Grid &grid : grids_) {
        for (const bool is_occupied : {false, true}) {
            for (const PolarReturn &r : returns) {
                const double c = std::cos(at.pose.yaw_rad + r.bearing_rad);
                const double s = std::sin(at.pose.yaw_rad + r.bearing_rad);
                const double from_m = is_occupied ? r.range_m : 0.0;
                const double to_m = is_occupied ? r.range_m : r.range_m - grid.cell_m;
                for (double d_m = from_m; d_m <= to_m; d_m += 0.5 * grid.cell_m) {
                    mark(grid, at.pose.x_m + d_m * c, at.pose.y_m + d_m * s, is_occupied);
                }
            }
        }
    }
}

} // namespace gpom_tools
