#include "tools/eval/occupancy_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace gpom_tools
{
namespace
{

double log_odds_of(double probability) { return std::log(probability / (1.0 - probability)); }

/// Coordinate of a segment along one axis in cells, and the steps from cell to cell along this
/// axis.
struct AxisWalk {
    double start;
    double delta;
    std::int64_t n_cells;
    std::int64_t cell = 0;
    std::int64_t last = 0;
    std::int64_t step = 0;
    double t_next = 0.0; ///< Position on the segment, 0 to 1, at which the next cell begins.

    /// Cut [t_in, t_out] to the part where the coordinate is inside [0, n]. False: nothing is left.
    bool clip(double &t_in, double &t_out) const
    {
        const double n = static_cast<double>(n_cells);
        if (delta == 0.0) {
            return start >= 0.0 && start < n;
        }
        const double t_low = -start / delta;
        const double t_high = (n - start) / delta;
        t_in = std::max(t_in, std::min(t_low, t_high));
        t_out = std::min(t_out, std::max(t_low, t_high));
        return t_in <= t_out;
    }

    std::int64_t cell_at(double t) const
    {
        const auto floor_cell = static_cast<std::int64_t>(std::floor(start + t * delta));
        return std::clamp<std::int64_t>(floor_cell, 0, n_cells - 1);
    }

    void begin(double t_in, double t_out)
    {
        cell = cell_at(t_in);
        last = cell_at(t_out);
        step = last > cell ? 1 : (last < cell ? -1 : 0);
        find_next();
    }

    /// Compute the border from the cell's number, so that rounding errors do not add up.
    void find_next()
    {
        const double border = static_cast<double>(step > 0 ? cell + 1 : cell);
        t_next = cell == last ? std::numeric_limits<double>::infinity() : (border - start) / delta;
    }

    void advance()
    {
        cell += step;
        find_next();
    }
};

struct Span {
    double low_m, high_m;
};

/// The part of a row of the raster inside a convex area. Empty if the row is outside.
Span span_at(const std::array<gpom_point_t, 4> &corners, double y_m)
{
    Span span{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const gpom_point_t a = corners[i], b = corners[(i + 1) % corners.size()];
        if ((a.y_m <= y_m) != (b.y_m <= y_m)) {
            const double x_m = a.x_m + (y_m - a.y_m) / (b.y_m - a.y_m) * (b.x_m - a.x_m);
            span = {std::min(span.low_m, x_m), std::max(span.high_m, x_m)};
        }
    }
    return span;
}

} // namespace

/// A widened beam as a cone.
struct BeamCone {
    const GridBeam &beam;
    double dir_x, dir_y;
    double half_tangent; ///< Half of the cone's width per metre of its length.
    double reach_m; ///< Distance of the middle of the farthest cell: half a cell diagonal beyond a
                    ///< return.
};

namespace
{

BeamCone cone_of(const GridBeam &beam, double cell_m)
{
    return {beam, std::cos(beam.bearing_rad), std::sin(beam.bearing_rad),
            std::tan(beam.half_width_rad),
            beam.range_m + (beam.hit ? std::sqrt(0.5) * cell_m : 0.0)};
}

/// A convex area that contains the middles of all cells of the cone. The half width used is the
/// greater of half a cell and the cone's half width. It is convex along the beam, so it never
/// exceeds the straight line between its values at both ends.
std::array<gpom_point_t, 4> corners_of(const BeamCone &cone, double cell_m)
{
    const double half_m = 0.5 * cell_m;
    const auto corner = [&](double along_m, double across_m) -> gpom_point_t {
        return {cone.beam.x_m + along_m * cone.dir_x - across_m * cone.dir_y,
                cone.beam.y_m + along_m * cone.dir_y + across_m * cone.dir_x};
    };
    const double far_half_m = std::max(half_m, cone.reach_m * cone.half_tangent);
    return {corner(-half_m, -half_m), corner(-half_m, half_m), corner(cone.reach_m, far_half_m),
            corner(cone.reach_m, -far_half_m)};
}

} // namespace

std::vector<GridBeam> beams_of(const std::vector<Scan> &scans, double half_width_rad)
{
    constexpr double kHalfWidthMax = 1.4; // the area of the cone grows without bound towards pi / 2
    std::vector<GridBeam> beams;
    for (const Scan &scan : scans) {
        const double half_rad =
            half_width_rad < 0.0 ? 0.5 * std::abs(scan.angle_step_rad) : half_width_rad;
        for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
            const double range_m = double{scan.ranges_m[i]};
            if (!(range_m > 0.0)) { // refuses NaN, too
                continue;
            }
            const double bearing_rad =
                scan.theta_rad + scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad;
            beams.push_back({scan.x_m, scan.y_m, bearing_rad, std::min(range_m, scan.range_max_m),
                             range_m < scan.range_max_m, std::min(half_rad, kHalfWidthMax)});
        }
    }
    return beams;
}

gpom_point_t end_of(const GridBeam &beam)
{
    return {beam.x_m + beam.range_m * std::cos(beam.bearing_rad),
            beam.y_m + beam.range_m * std::sin(beam.bearing_rad)};
}

void traverse(const gpom_raster_t &raster, gpom_point_t from, gpom_point_t to,
              const std::function<void(GridCell)> &visit)
{
    AxisWalk x{(from.x_m - raster.x0_m) / raster.cell_m, (to.x_m - from.x_m) / raster.cell_m,
               raster.nx};
    AxisWalk y{(from.y_m - raster.y0_m) / raster.cell_m, (to.y_m - from.y_m) / raster.cell_m,
               raster.ny};
    double t_in = 0.0, t_out = 1.0;
    if (!x.clip(t_in, t_out) || !y.clip(t_in, t_out)) {
        return;
    }
    x.begin(t_in, t_out);
    y.begin(t_in, t_out);
    visit({x.cell, y.cell});
    while (x.cell != x.last || y.cell != y.last) { // each turn is one step nearer to the last cell
        (x.t_next < y.t_next ? x : y).advance();
        visit({x.cell, y.cell});
    }
}

OccupancyGrid::OccupancyGrid(const gpom_raster_t &raster, const GridModel &model)
    : raster_(raster), log_odds_hit_(log_odds_of(model.p_hit)),
      log_odds_miss_(log_odds_of(model.p_miss)), log_odds_min_(log_odds_of(model.p_min)),
      log_odds_max_(log_odds_of(model.p_max))
{
    const std::size_t n_cells = static_cast<std::size_t>(raster.nx) * raster.ny;
    if (n_cells > kCellsMax) {
        throw std::runtime_error("an occupancy grid of " + std::to_string(n_cells) +
                                 " cells is too large; give a larger --grid-cell");
    }
    log_odds_.assign(n_cells, 0.0f);
}

bool OccupancyGrid::contains(GridCell cell) const
{
    return cell.ix >= 0 && cell.iy >= 0 && cell.ix < raster_.nx && cell.iy < raster_.ny;
}

std::size_t OccupancyGrid::index(GridCell cell) const
{
    return static_cast<std::size_t>(cell.iy) * raster_.nx + static_cast<std::size_t>(cell.ix);
}

GridCell OccupancyGrid::cell_at(gpom_point_t point) const
{
    const auto number = [&](double offset_m) -> std::int64_t {
        constexpr double kFar = 1e15; // beyond this, a double does not hold each whole number
        const double cell = std::floor(offset_m / raster_.cell_m);
        return std::isnan(cell) ? -1 : static_cast<std::int64_t>(std::clamp(cell, -kFar, kFar));
    };
    return {number(point.x_m - raster_.x0_m), number(point.y_m - raster_.y0_m)};
}

void OccupancyGrid::add(GridCell cell, double log_odds)
{
    float &value = log_odds_[index(cell)];
    value = static_cast<float>(std::clamp(value + log_odds, log_odds_min_, log_odds_max_));
}

void OccupancyGrid::insert_thin(const GridBeam &beam)
{
    const gpom_point_t end = end_of(beam);
    const GridCell end_cell = cell_at(end);
    traverse(raster_, {beam.x_m, beam.y_m}, end, [&](GridCell cell) {
        if (!(beam.hit && cell == end_cell)) {
            add(cell, log_odds_miss_);
        }
    });
    if (beam.hit && contains(end_cell)) {
        add(end_cell, log_odds_hit_);
    }
}

void OccupancyGrid::add_wide(GridCell cell, const BeamCone &cone)
{
    const GridBeam &beam = cone.beam;
    const double cell_m = raster_.cell_m;
    const double dx_m = raster_.x0_m + (static_cast<double>(cell.ix) + 0.5) * cell_m - beam.x_m;
    const double dy_m = raster_.y0_m + (static_cast<double>(cell.iy) + 0.5) * cell_m - beam.y_m;
    const double along_m = cone.dir_x * dx_m + cone.dir_y * dy_m;
    const double across_m = std::abs(cone.dir_x * dy_m - cone.dir_y * dx_m);
    const double distance_m = std::sqrt(dx_m * dx_m + dy_m * dy_m);
    if (along_m < -0.5 * cell_m || distance_m > cone.reach_m) {
        return;
    }
    const double half_width_m = std::max(0.5 * cell_m, std::max(along_m, 0.0) * cone.half_tangent);
    // Near the axis about equal to the ratio of the angles.
    const double share = across_m / half_width_m;
    if (share < 1.0) {
        const bool at_arc = beam.hit && distance_m >= 2.0 * beam.range_m - cone.reach_m;
        add(cell, (1.0 - share * share) * (at_arc ? log_odds_hit_ : log_odds_miss_));
    }
}

void OccupancyGrid::insert_wide(const GridBeam &beam)
{
    const BeamCone cone = cone_of(beam, raster_.cell_m);
    const std::array<gpom_point_t, 4> corners = corners_of(cone, raster_.cell_m);
    const auto [low, high] =
        std::minmax_element(corners.begin(), corners.end(),
                            [](gpom_point_t a, gpom_point_t b) { return a.y_m < b.y_m; });
    const std::int64_t last_row = std::min(cell_at(*high).iy, std::int64_t{raster_.ny} - 1);
    for (std::int64_t iy = std::max<std::int64_t>(cell_at(*low).iy, 0); iy <= last_row; ++iy) {
        const double y_m = raster_.y0_m + (static_cast<double>(iy) + 0.5) * raster_.cell_m;
        const Span span = span_at(corners, y_m);
        const std::int64_t last =
            std::min(cell_at({span.high_m, y_m}).ix + 1, std::int64_t{raster_.nx} - 1);
        for (std::int64_t ix = std::max<std::int64_t>(cell_at({span.low_m, y_m}).ix - 1, 0);
             ix <= last; ++ix) {
            add_wide({ix, iy}, cone);
        }
    }
}

double OccupancyGrid::probability(gpom_point_t point) const
{
    const GridCell cell = cell_at(point);
    return contains(cell) ? 1.0 / (1.0 + std::exp(-double{log_odds_[index(cell)]})) : 0.5;
}

gpom_raster_t raster_over(gpom_point_t low, gpom_point_t high, double cell_m, double margin_m)
{
    const auto count = [&](double from_m, double to_m) {
        const double n = std::ceil((to_m - from_m + 2.0 * margin_m) / cell_m - 1e-9);
        if (!(n < 1e6)) {
            throw std::runtime_error("cells of " + std::to_string(cell_m) +
                                     " m are too small for " + std::to_string(to_m - from_m) +
                                     " m");
        }
        return static_cast<std::uint32_t>(std::max(n, 1.0));
    };
    return {low.x_m - margin_m, low.y_m - margin_m, cell_m, count(low.x_m, high.x_m),
            count(low.y_m, high.y_m)};
}

} // namespace gpom_tools
