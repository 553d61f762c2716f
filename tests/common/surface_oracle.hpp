// The signed distance from a surface by its definition.
#ifndef GPOM_TESTS_COMMON_SURFACE_ORACLE_HPP
#define GPOM_TESTS_COMMON_SURFACE_ORACLE_HPP

#include "gpom/query.h"
#include "tools/sim/truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

/// Over all cells: distance to the closed square of each cell of the other kind.
inline double brute_distance(const gpom_tools::Truth &truth, gpom_point_t at)
{
    const int ix = static_cast<int>(std::floor((at.x_m - truth.x0_m) / truth.cell_m));
    const int iy = static_cast<int>(std::floor((at.y_m - truth.y0_m) / truth.cell_m));
    double least = std::numeric_limits<double>::infinity();
    for (int y = 0; y < truth.ny; ++y) {
        for (int x = 0; x < truth.nx; ++x) {
            if (truth.at(x, y) != truth.at(ix, iy)) {
                const double west_m = truth.x0_m + x * truth.cell_m;
                const double south_m = truth.y0_m + y * truth.cell_m;
                const double near_x_m = std::clamp(at.x_m, west_m, west_m + truth.cell_m);
                const double near_y_m = std::clamp(at.y_m, south_m, south_m + truth.cell_m);
                least = std::min(least, std::hypot(near_x_m - at.x_m, near_y_m - at.y_m));
            }
        }
    }
    return truth.at(ix, iy) ? least : -least;
}

#endif
