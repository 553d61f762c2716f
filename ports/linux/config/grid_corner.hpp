// Where MBot's grids may begin: their corner is a float32.
#ifndef GPOM_LINUX_GRID_CORNER_HPP
#define GPOM_LINUX_GRID_CORNER_HPP

#include <cmath>
#include <cstdint>

namespace gpomd
{

/// Most cells that a grid begins before its raster, along x and y each.
constexpr std::uint32_t kGridMarginMax = 64;

/// Error of a corner that no reader feels, as a part of a cell.
constexpr double kGridCornerError = 1e-3;

/// How many cells before corner_m a grid has to begin so that float32 holds its corner: at UTM
/// northings only half metres are. More than kGridMarginMax: nowhere near.
inline std::uint32_t grid_margin(double corner_m, double cell_m)
{
    std::uint32_t n = 0;
    for (; n <= kGridMarginMax; ++n) {
        const double begin_m = corner_m - n * cell_m;
        const double held_m = static_cast<double>(static_cast<float>(begin_m));
        if (std::fabs(held_m - begin_m) <= kGridCornerError * cell_m) {
            break;
        }
    }
    return n;
}

} // namespace gpomd

#endif
