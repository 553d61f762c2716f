#include "tools/eval/unchanged_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

namespace gpom_tools
{
namespace
{

enum class Says { kNothing, kFree, kOccupied };

/// What one beam says about a place that lies `along_m` along the beam and `across_m` beside it.
Says says(double range_m, double range_max_m, double along_m, double across_m)
{
    const double to_go_m = range_m - along_m;
    if (range_m < range_max_m && std::hypot(to_go_m, across_m) < kReturnsWithin_m) {
        return Says::kOccupied;
    }
    const bool is_past = along_m > 0.0 && to_go_m > kGoesOn_m;
    return is_past && std::fabs(across_m) < kPassesWithin_m ? Says::kFree : Says::kNothing;
}

/// What a scan says about a place. Only beams within kReturnsWithin_m of the place count.
Says says(const Scan &scan, gpom_point_t at)
{
    const double dx_m = at.x_m - scan.x_m, dy_m = at.y_m - scan.y_m;
    const double distance_m = std::hypot(dx_m, dy_m);
    const double n_beams = static_cast<double>(scan.ranges_m.size());
    const double middle_rad = scan.angle_min_rad + 0.5 * (n_beams - 1.0) * scan.angle_step_rad;
    const double off_rad =
        std::remainder(std::atan2(dy_m, dx_m) - scan.theta_rad - middle_rad, 2.0 * std::acos(-1.0));
    const double reach_rad = std::asin(std::min(1.0, kReturnsWithin_m / distance_m));
    const double centre = 0.5 * (n_beams - 1.0) + off_rad / scan.angle_step_rad;
    const double reach = reach_rad / std::fabs(scan.angle_step_rad);
    const double last = std::min(n_beams - 1.0, std::floor(centre + reach));
    Says all = Says::kNothing;
    for (double i = std::max(0.0, std::ceil(centre - reach)); i <= last; ++i) {
        const double range_m = static_cast<double>(scan.ranges_m[static_cast<std::size_t>(i)]);
        const double turn_rad = (i - centre) * scan.angle_step_rad;
        all = std::max(all, says(range_m, scan.range_max_m, distance_m * std::cos(turn_rad),
                                 distance_m * std::sin(turn_rad)));
    }
    return all;
}

/// True if a place that was occupied is still occupied.
bool is_unchanged(gpom_point_t at, const std::vector<Scan> &scans)
{
    int n_through = 0;
    for (auto scan = scans.rbegin(); scan != scans.rend() && n_through < kChangedScans; ++scan) {
        const Says said = says(*scan, at);
        if (said == Says::kOccupied) {
            return true;
        }
        n_through += said == Says::kFree ? 1 : 0;
    }
    return n_through < kChangedScans;
}

} // namespace

std::vector<TestPoint> unchanged_points(const std::vector<TestPoint> &points,
                                        const std::vector<Scan> &scans)
{
    std::vector<TestPoint> unchanged;
    std::copy_if(
        points.begin(), points.end(), std::back_inserter(unchanged),
        [&](const TestPoint &point) { return !point.occupied || is_unchanged(point.at, scans); });
    return unchanged;
}

} // namespace gpom_tools
