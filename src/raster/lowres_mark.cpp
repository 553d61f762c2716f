// Marking the cells that a change of the map can reach.
#include "src/raster/lowres.hpp"

#include <float.h>

namespace gpom
{
namespace
{

/// Relative rounding error of a strip's coordinates.
constexpr float kRounding = 1e-6f;
/// A stretch that spans fewer rows than this counts as level [cells].
constexpr float kLevel = 1e-3f;

float cells_from_corner(double origin_m, float offset_m, double corner_m, double cell_m)
{
    return static_cast<float>((origin_m - corner_m + static_cast<double>(offset_m)) / cell_m);
}

/// Mark one cell. Returns 1 if it was not marked before, else 0. No other thread writes to cells,
/// so that a plain load is enough.
[[gnu::always_inline]] inline uint32_t mark(Cell &cell)
{
    const uint32_t value = cell.value;
    if ((value & (kDirty | kOutside)) != 0) {
        return 0;
    }
    store(cell.value, value | kDirty);
    return 1;
}

/// Count the cells that were marked in a layer, and start the round over all its cells again.
void count_marks(Layer &layer, uint32_t n_marked)
{
    store(layer.n_dirty, load(layer.n_dirty) + n_marked);
    start_round(layer);
}

} // namespace

Strip strip_of(const Lowres &lowres, const Window &w, Point from, Point to, float radius_m)
{
    const double corner_x_m = w.x0_m + w.ix0 * w.cell_m;
    const double corner_y_m = w.y0_m + w.iy0 * w.cell_m;
    const float u0 = cells_from_corner(lowres.origin_x_m, from.x_m, corner_x_m, w.cell_m);
    const float v0 = cells_from_corner(lowres.origin_y_m, from.y_m, corner_y_m, w.cell_m);
    const float u1 = cells_from_corner(lowres.origin_x_m, to.x_m, corner_x_m, w.cell_m);
    const float v1 = cells_from_corner(lowres.origin_y_m, to.y_m, corner_y_m, w.cell_m);
    const float size = lane::abs(u0) + lane::abs(v0) + lane::abs(u1) + lane::abs(v1) +
                       static_cast<float>(w.nx) + static_cast<float>(w.ny);
    const float radius = radius_m / static_cast<float>(w.cell_m) + kRounding * size;
    const float du = u1 - u0;
    const float dv = v1 - v0;
    Strip strip = {lane::min(u0, u1) - radius,
                   lane::max(u0, u1) + radius,
                   lane::min(v0, v1) - radius,
                   lane::max(v0, v1) + radius,
                   0.0f,
                   0.0f,
                   FLT_MAX};
    if (lane::abs(dv) > kLevel) { // for a level stretch the box alone is narrow enough
        strip.slope = du / dv;
        strip.offset = u0 - strip.slope * v0;
        const float steepness = lane::abs(strip.slope);
        strip.half_width = radius * lane::sqrt(1.0f + steepness * steepness) +
                           kRounding * size * (1.0f + steepness);
    }
    return strip;
}

void lowres_mark_segment(Lowres &lowres, Point from, Point to, float reach_m)
{
    for (Layer &layer : lowres.layers) {
        uint32_t n_marked = 0;
        if (layer.window.nx > 0) {
            for_strip(layer, strip_of(lowres, layer.window, from, to, reach_m),
                      [&n_marked](Cell &cell) { n_marked += mark(cell); });
        }
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

void lowres_mark_box(Lowres &lowres, Point low, Point high, float reach_m)
{
    for (Layer &layer : lowres.layers) {
        const Window &w = layer.window;
        const Strip box = strip_of(lowres, w, low, high, reach_m);
        const Span columns = centres_between(box.u_min, box.u_max, w.nx);
        uint32_t n_marked = 0;
        for_cells(
            layer.cells, w, centres_between(box.v_min, box.v_max, w.ny),
            [&columns](uint32_t) { return columns; },
            [&n_marked](Cell &cell) { n_marked += mark(cell); });
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

void lowres_mark_all(Lowres &lowres)
{
    for (Layer &layer : lowres.layers) {
        uint32_t n_marked = 0;
        for (uint32_t slot = 0; slot < cell_count(layer.window); ++slot) {
            n_marked += mark(layer.cells[slot]);
        }
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

} // namespace gpom
