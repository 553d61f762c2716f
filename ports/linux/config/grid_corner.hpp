// Where MBot's grids may begin. Their corner is a float32.
#ifndef GPOM_LINUX_GRID_CORNER_HPP
#define GPOM_LINUX_GRID_CORNER_HPP

#include <cmath>
#include <cstdint>

namespace gpomd
{

/// Most cells that a grid may have before its raster, along x and along y.
constexpr std::uint32_t kGridMarginMax = 64;

/// Largest error of a corner, as a part of a cell. It is too small to matter to a reader.
constexpr double kGridCornerError = 1e-3;

/// Number of cells that a grid needs before corner_m so that float32 holds the grid's corner. At
/// UTM northings float32 holds half metres only. More than kGridMarginMax: there is no such corner
/// near.
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
