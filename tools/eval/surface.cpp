#include "tools/eval/surface.hpp"

#include "tools/eval/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace gpom_tools
{
namespace
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kBeforeSurface = 1e-3; ///< Lines of sight end this far before a surface, so that
                                        ///< they end in the free cell [m].

/// Distance along one axis from a coordinate to a cell, both in cells. 0: the coordinate is inside
/// the cell.
double gap(double coordinate, int i_cell)
{
    return std::max({i_cell - coordinate, coordinate - (i_cell + 1.0), 0.0});
}

/// Bearing of a place from the middle of a scan's field of view [rad], within +-pi.
double off_middle_rad(const Scan &scan, double dx_m, double dy_m)
{
    const double n_steps = static_cast<double>(scan.ranges_m.size()) - 1.0;
    const double middle_rad = scan.angle_min_rad + 0.5 * n_steps * scan.angle_step_rad;
    return std::remainder(std::atan2(dy_m, dx_m) - scan.theta_rad - middle_rad, 2.0 * kPi);
}

bool is_open(const Truth &truth, gpom_point_t from, gpom_point_t to)
{
    const gpom_raster_t raster = {truth.x0_m, truth.y0_m, truth.cell_m,
                                  static_cast<std::uint32_t>(truth.nx),
                                  static_cast<std::uint32_t>(truth.ny)};
    bool open = true;
    traverse(raster, from, to, [&](GridCell cell) {
        open = open && !truth.at(static_cast<int>(cell.ix), static_cast<int>(cell.iy));
    });
    return open;
}

} // namespace

double signed_distance(const Truth &truth, gpom_point_t at, double reach_m)
{
    const double u = (at.x_m - truth.x0_m) / truth.cell_m, v = (at.y_m - truth.y0_m) / truth.cell_m;
    const int ix = std::clamp(static_cast<int>(std::floor(u)), 0, truth.nx - 1);
    const int iy = std::clamp(static_cast<int>(std::floor(v)), 0, truth.ny - 1);
    const bool occupied = truth.at(ix, iy);
    const int reach = static_cast<int>(std::min(std::ceil(reach_m / truth.cell_m), 1e6));
    double least = std::numeric_limits<double>::infinity();
    for (int y = std::max(iy - reach, 0); y <= std::min(iy + reach, truth.ny - 1); ++y) {
        for (int x = std::max(ix - reach, 0); x <= std::min(ix + reach, truth.nx - 1); ++x) {
            if (truth.at(x, y) != occupied) {
                least = std::min(least, std::hypot(gap(u, x), gap(v, y)));
            }
        }
    }
    least *= truth.cell_m;
    least = least <= reach_m ? least : std::numeric_limits<double>::infinity();
    return occupied ? least : -least;
}

std::vector<SurfacePlace> surface_places(const Truth &truth)
{
    std::vector<SurfacePlace> places;
    const auto add = [&](int ix, int iy, int step_x, int step_y) {
        const bool occupied = truth.at(ix, iy);
        if (truth.at(ix + step_x, iy + step_y) == occupied) {
            return;
        }
        const double sign = occupied ? -1.0 : 1.0;
        places.push_back({{truth.x0_m + (ix + 0.5 + 0.5 * step_x) * truth.cell_m,
                           truth.y0_m + (iy + 0.5 + 0.5 * step_y) * truth.cell_m},
                          sign * step_x,
                          sign * step_y});
    };
    for (int iy = 0; iy < truth.ny; ++iy) {
        for (int ix = 0; ix < truth.nx; ++ix) {
            if (ix + 1 < truth.nx) {
                add(ix, iy, 1, 0);
            }
            if (iy + 1 < truth.ny) {
                add(ix, iy, 0, 1);
            }
        }
    }
    return places;
}

bool is_in_view(const SurfacePlace &place, const Truth &truth, const std::vector<Scan> &scans)
{
    const gpom_point_t before = {place.at.x_m - kBeforeSurface * place.normal_x,
                                 place.at.y_m - kBeforeSurface * place.normal_y};
    return std::any_of(scans.begin(), scans.end(), [&](const Scan &scan) {
        const double dx_m = before.x_m - scan.x_m, dy_m = before.y_m - scan.y_m;
        const double n_steps = static_cast<double>(scan.ranges_m.size()) - 1.0;
        return std::hypot(dx_m, dy_m) < scan.range_max_m &&
               dx_m * place.normal_x + dy_m * place.normal_y > 0.0 &&
               std::abs(off_middle_rad(scan, dx_m, dy_m)) <=
                   0.5 * n_steps * std::abs(scan.angle_step_rad) &&
               is_open(truth, {scan.x_m, scan.y_m}, before);
    });
}

} // namespace gpom_tools
