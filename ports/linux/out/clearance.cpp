#include "ports/linux/out/clearance.hpp"

#include <algorithm>
#include <cmath>

namespace gpomd
{

namespace
{

/// A sector is unknown if it ends in unknown cells within this many cells of the robot's edge.
constexpr double kEdgeCells = 2.0;

/// Corrects for a float that may have been rounded up.
constexpr double kNotUp = 1.0 - 1e-7;

constexpr gpom_cell_t kUnknownCell = {0, 255, GPOM_UNKNOWN, 0};

/// The cells around the robot. Coordinates are in cells, from the raster's corner.
struct Window {
    const ClearanceView &view;
    double x, y; ///< The robot.

    /// A cell. Cells outside the raster are unknown.
    const gpom_cell_t &at(std::int64_t ix, std::int64_t iy) const
    {
        const bool is_inside = ix >= 0 && iy >= 0 && ix < view.raster.nx && iy < view.raster.ny;
        return is_inside ? view.cells[iy * view.raster.nx + ix] : kUnknownCell;
    }
    /// Distance to the nearest point of a cell [m].
    double distance_m(std::int64_t ix, std::int64_t iy) const
    {
        const auto beside = [](double at, std::int64_t i) {
            const auto low = static_cast<double>(i);
            return std::max({low - at, at - (low + 1.0), 0.0});
        };
        return view.raster.cell_m * std::hypot(beside(x, ix), beside(y, iy));
    }
    double centre_m(std::int64_t ix, std::int64_t iy) const
    {
        return view.raster.cell_m *
               std::hypot(static_cast<double>(ix) + 0.5 - x, static_cast<double>(iy) + 0.5 - y);
    }
    /// Bearing of a point from the robot, counter-clockwise from forward.
    double bearing_rad(double px, double py) const
    {
        return std::remainder(std::atan2(py - y, px - x) - view.yaw_rad, 2.0 * M_PI);
    }
};

std::uint8_t probability_code(const gpom_cell_t &cell)
{
    return cell.cls == GPOM_UNKNOWN ? static_cast<std::uint8_t>(GPOM_CAN_LEVEL_UNKNOWN)
                                    : gpom_can_probability_code(cell.probability);
}

std::uint8_t deviation_code(const gpom_cell_t &cell)
{
    return cell.cls == GPOM_UNKNOWN ? static_cast<std::uint8_t>(GPOM_CAN_LEVEL_UNKNOWN)
                                    : gpom_can_deviation_code(cell.variance, GPOM_CAN_LEVEL_MAX);
}

/// Copy the codes of this cell into the sector.
void say(Sector &sector, const gpom_cell_t &cell)
{
    sector.probability = probability_code(cell);
    sector.deviation = deviation_code(cell);
}

/// A cell that is not free ends every sector that it overlaps, unless a nearer cell already did.
void end_sectors(const Window &window, std::int64_t ix, std::int64_t iy, Sector *sectors,
                 std::size_t n)
{
    const double distance_m = window.distance_m(ix, iy);
    const gpom_cell_t &cell = window.at(ix, iy);
    const auto x = static_cast<double>(ix), y = static_cast<double>(iy);
    const double middle_rad = window.bearing_rad(x + 0.5, y + 0.5);
    double right_rad = 0.0, left_rad = 0.0; // bearings to the rightmost and leftmost corner
    for (const double px : {x, x + 1.0}) {
        for (const double py : {y, y + 1.0}) {
            const double aside_rad =
                std::remainder(window.bearing_rad(px, py) - middle_rad, 2.0 * M_PI);
            right_rad = std::min(right_rad, aside_rad);
            left_rad = std::max(left_rad, aside_rad);
        }
    }
    const double width_rad = 2.0 * M_PI / static_cast<double>(n);
    const bool is_about = distance_m <= 0.0; // the robot stands in the cell
    const auto first = std::llround((middle_rad + right_rad) / width_rad);
    const auto last = is_about ? first + static_cast<long long>(n) - 1
                               : std::llround((middle_rad + left_rad) / width_rad);
    const auto n_sectors = static_cast<long long>(n);
    for (long long i = first; i <= last; ++i) {
        Sector &sector = sectors[((i % n_sectors) + n_sectors) % n_sectors];
        const bool is_nearer = distance_m < sector.distance_m;
        const bool is_worse = distance_m == sector.distance_m && !sector.is_clear &&
                              probability_code(cell) > sector.probability;
        if (is_nearer || is_worse) {
            sector.distance_m = distance_m;
            sector.is_clear = false;
            say(sector, cell);
        }
    }
}

/// A free cell raises the codes of a clear sector. The sector is the one of the cell's centre.
void note_free(const Window &window, std::int64_t ix, std::int64_t iy, Sector *sectors,
               std::size_t n)
{
    const gpom_cell_t &cell = window.at(ix, iy);
    const double bearing_rad =
        window.bearing_rad(static_cast<double>(ix) + 0.5, static_cast<double>(iy) + 0.5);
    const auto n_sectors = static_cast<long long>(n);
    const long long i = std::llround(bearing_rad / (2.0 * M_PI) * static_cast<double>(n));
    Sector &sector = sectors[(i + n_sectors) % n_sectors];
    if (sector.is_clear && gpom_can_probability_code(cell.probability) >= sector.probability) {
        say(sector, cell);
    }
}

void visit_cells(const Window &window, Sector *sectors, std::size_t n)
{
    const ClearanceView &view = window.view;
    const double reach = view.range_m / view.raster.cell_m + 1.0; // in cells
    const auto first_of = [reach](double at) {
        return std::max<std::int64_t>(static_cast<std::int64_t>(std::floor(at - reach)), -1);
    };
    const auto last_of = [reach](double at, std::uint32_t count) {
        return std::min<std::int64_t>(static_cast<std::int64_t>(std::floor(at + reach)), count);
    };
    for (const bool is_for_free : {false, true}) { // first find what ends the sectors
        for (std::int64_t iy = first_of(window.y); iy <= last_of(window.y, view.raster.ny); ++iy) {
            for (std::int64_t ix = first_of(window.x); ix <= last_of(window.x, view.raster.nx);
                 ++ix) {
                const bool is_free = window.at(ix, iy).cls == GPOM_FREE;
                if (is_free != is_for_free || window.distance_m(ix, iy) >= view.range_m ||
                    window.centre_m(ix, iy) <= view.radius_m) {
                    continue;
                }
                (is_free ? note_free : end_sectors)(window, ix, iy, sectors, n);
            }
        }
    }
}

} // namespace

void find_clearance(const ClearanceView &view, Sector *sectors, std::size_t n)
{
    const Window window = {view, (view.x_m - view.raster.x0_m) / view.raster.cell_m,
                           (view.y_m - view.raster.y0_m) / view.raster.cell_m};
    const bool is_inside = window.x >= 0.0 && window.x < view.raster.nx && window.y >= 0.0 &&
                           window.y < view.raster.ny && std::isfinite(view.yaw_rad);
    for (std::size_t i = 0; i < n; ++i) {
        sectors[i] = {is_inside ? static_cast<double>(view.range_m) : 0.0, is_inside, !is_inside, 0,
                      0};
        if (!is_inside) {
            say(sectors[i], kUnknownCell);
        }
    }
    if (!is_inside) {
        return;
    }
    visit_cells(window, sectors, n);
    const double edge_m = view.radius_m + kEdgeCells * view.raster.cell_m;
    for (std::size_t i = 0; i < n; ++i) {
        sectors[i].is_unknown = !sectors[i].is_clear && sectors[i].distance_m < edge_m &&
                                sectors[i].probability == GPOM_CAN_LEVEL_UNKNOWN;
    }
}

std::uint8_t distance_code(const Sector &sector)
{
    return static_cast<std::uint8_t>(
        sector.is_unknown ? GPOM_CAN_DISTANCE_UNKNOWN
        : sector.is_clear ? GPOM_CAN_DISTANCE_CLEAR
                          : gpom_can_distance_code(static_cast<float>(sector.distance_m * kNotUp)));
}

} // namespace gpomd
