// The focus layer: a finer raster around a path of interest.
#include "src/map/map.hpp"

namespace gpom
{
namespace
{

/// The side of a focus cell is doubled at most this many times. From 1e-3 m on, the side is then
/// far longer than any reach.
constexpr int kDoublingsMax = 64;
constexpr uint32_t kSideMax = UINT16_MAX;
constexpr int32_t kNumberMax = 999999999; // less than the limit of cell_number()

/// The rectangle that holds the band, in the map frame.
struct Bounds {
    double x_min_m, y_min_m, x_max_m, y_max_m;
};

bool is_in_reach(const Lowres &lowres, const gpom_point_t &point)
{
    const double dx_m = point.x_m - lowres.origin_x_m;
    const double dy_m = point.y_m - lowres.origin_y_m;
    return dx_m * dx_m + dy_m * dy_m <= GPOM_REACH_M * GPOM_REACH_M; // NaN fails
}

bool are_in_reach(const Lowres &lowres, const gpom_point_t *points, size_t n_points)
{
    for (size_t i = 0; i < n_points; ++i) {
        if (!is_in_reach(lowres, points[i])) {
            return false;
        }
    }
    return true;
}

Bounds bounds_of(const gpom_point_t *points, size_t n_points, double half_width_m)
{
    Bounds b = {points[0].x_m, points[0].y_m, points[0].x_m, points[0].y_m};
    for (size_t i = 1; i < n_points; ++i) {
        b.x_min_m = points[i].x_m < b.x_min_m ? points[i].x_m : b.x_min_m;
        b.y_min_m = points[i].y_m < b.y_min_m ? points[i].y_m : b.y_min_m;
        b.x_max_m = points[i].x_m > b.x_max_m ? points[i].x_m : b.x_max_m;
        b.y_max_m = points[i].y_m > b.y_max_m ? points[i].y_m : b.y_max_m;
    }
    return {b.x_min_m - half_width_m, b.y_min_m - half_width_m, b.x_max_m + half_width_m,
            b.y_max_m + half_width_m};
}

bool is_number(int32_t i) { return i >= -kNumberMax && i <= kNumberMax; }

/// Set w to the cells of side cell_m that touch a rectangle. False if there are too many cells, or
/// if cell numbers would be too large.
bool fit(Window &w, const Bounds &b, double cell_m, uint32_t cell_max)
{
    const int32_t ix0 = cell_number(b.x_min_m, 0.0, cell_m);
    const int32_t iy0 = cell_number(b.y_min_m, 0.0, cell_m);
    const int32_t ix1 = cell_number(b.x_max_m, 0.0, cell_m);
    const int32_t iy1 = cell_number(b.y_max_m, 0.0, cell_m);
    if (!is_number(ix0) || !is_number(iy0) || !is_number(ix1) || !is_number(iy1)) {
        return false;
    }
    const uint32_t nx = static_cast<uint32_t>(ix1 - ix0) + 1;
    const uint32_t ny = static_cast<uint32_t>(iy1 - iy0) + 1;
    if (nx > kSideMax || ny > kSideMax || nx * ny > cell_max) {
        return false;
    }
    w = {0.0, 0.0, cell_m, ix0, iy0, nx, ny};
    return true;
}

bool fit_smallest(Window &w, const Bounds &b, double cell_m, uint32_t cell_max)
{
    for (int i = 0; i < kDoublingsMax; ++i) {
        if (fit(w, b, cell_m, cell_max)) {
            return true;
        }
        cell_m *= 2.0;
    }
    return false;
}

Point relative(const Lowres &lowres, const gpom_point_t &point)
{
    return {static_cast<float>(point.x_m - lowres.origin_x_m),
            static_cast<float>(point.y_m - lowres.origin_y_m)};
}

/// Make the cells within half_width_m of one stretch part of the band. They become dirty.
void admit_stretch(Lowres &lowres, const gpom_point_t &from, const gpom_point_t &to,
                   float half_width_m)
{
    Layer &layer = lowres.layers[GPOM_LAYER_FOCUS];
    const Strip strip =
        strip_of(lowres, layer.window, relative(lowres, from), relative(lowres, to), half_width_m);
    uint32_t n_dirty = load(layer.n_dirty);
    for_strip(layer, strip, [&n_dirty](Cell &cell) {
        const uint32_t value = load(cell.value);
        if ((value & kOutside) != 0) {
            store(cell.value, (value & ~kOutside) | kDirty);
            ++n_dirty;
        }
    });
    store(layer.n_dirty, n_dirty);
}

/// Replace the window of the focus layer. All its cells are outside of the band at first.
void begin_focus(Lowres &lowres, const Window &window)
{
    Layer &layer = lowres.layers[GPOM_LAYER_FOCUS];
    layer.window = window;
    layer.cursor = 0;
    layer.refresh = 0;
    layer.n_stale = 0;
    for (uint32_t slot = 0; slot < cell_count(window); ++slot) {
        store(layer.cells[slot].value, lowres.unknown_value | kOutside);
        store(layer.cells[slot].stamp_ms, 0);
    }
    store(layer.n_dirty, 0);
}

} // namespace
} // namespace gpom

gpom_status_t gpom_lowres_focus(gpom_map_t *map, const gpom_point_t *points, size_t n_points,
                                double half_width_m, double cell_m)
{
    if (!gpom::is_map(map) || (n_points > 0 && points == nullptr)) {
        return GPOM_ERR_ARG;
    }
    const bool are_sizes =
        half_width_m >= 0.0 && half_width_m <= GPOM_REACH_M && cell_m >= 1e-3 && cell_m <= 1e6;
    if (n_points > 0 && !are_sizes) {
        return GPOM_ERR_ARG;
    }
    gpom::Lowres &lowres = map->lowres;
    if (!gpom::are_in_reach(lowres, points, n_points)) {
        return GPOM_ERR_REACH;
    }
    gpom::Window window = {0.0, 0.0, 1.0, 0, 0, 0, 0};
    const uint32_t cell_max = lowres.layers[GPOM_LAYER_FOCUS].cell_max;
    if (n_points > 0) {
        const gpom::Bounds bounds = gpom::bounds_of(points, n_points, half_width_m);
        if (!gpom::fit_smallest(window, bounds, cell_m, cell_max)) {
            return GPOM_ERR_MEM;
        }
    }
    gpom::begin_change(lowres);
    gpom::begin_focus(lowres, window);
    for (size_t i = 0; i < n_points; ++i) { // the first stretch has no length
        const gpom_point_t &from = points[i > 0 ? i - 1 : 0];
        gpom::admit_stretch(lowres, from, points[i], static_cast<float>(half_width_m));
    }
    gpom::end_change(lowres);
    return GPOM_OK;
}
