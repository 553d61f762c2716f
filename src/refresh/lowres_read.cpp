// Reading the low-resolution map, in the thread that changes it or in another thread.
#include "src/map/map.hpp"
#include "src/raster/reading.hpp"

namespace gpom
{
namespace
{

void copy_cells(const Layer &layer, const Window &w, gpom_cell_t *cells)
{
    const Span columns = {0, w.nx};
    for_cells(
        layer.cells, w, {0, w.ny}, [&columns](uint32_t) { return columns; },
        [&cells](const Cell &cell) { *cells++ = read_cell(cell); });
}

bool is_layer(uint32_t layer) { return layer == GPOM_LAYER_COARSE || layer == GPOM_LAYER_FOCUS; }

} // namespace
} // namespace gpom

gpom_status_t gpom_lowres_info(const gpom_map_t *map, uint32_t layer, gpom_lowres_info_t *info)
{
    if (!gpom::is_map(map) || !gpom::is_layer(layer) || info == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Lowres &lowres = map->lowres;
    for (uint32_t i = 0; i < GPOM_LOWRES_TRIES; ++i) {
        uint32_t counter;
        gpom::Window window;
        if (!gpom::begin_read(lowres, counter)) {
            continue;
        }
        *info = gpom::read_info(lowres, lowres.layers[layer], window);
        if (gpom::end_read(lowres, counter)) {
            return GPOM_OK;
        }
    }
    return GPOM_ERR_BUSY;
}

gpom_status_t gpom_lowres_copy(const gpom_map_t *map, uint32_t layer, gpom_cell_t *cells,
                               uint32_t cell_max, gpom_lowres_info_t *info)
{
    if (!gpom::is_map(map) || !gpom::is_layer(layer) || cells == nullptr || info == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Lowres &lowres = map->lowres;
    for (uint32_t i = 0; i < GPOM_LOWRES_TRIES; ++i) {
        uint32_t counter;
        gpom::Window window;
        if (!gpom::begin_read(lowres, counter)) {
            continue;
        }
        *info = gpom::read_info(lowres, lowres.layers[layer], window);
        if (!gpom::end_read(lowres, counter)) {
            continue; // the window may mix words of two windows
        }
        if (gpom::cell_count(window) > cell_max) {
            return GPOM_ERR_MEM;
        }
        gpom::copy_cells(lowres.layers[layer], window, cells);
        if (gpom::end_read(lowres, counter)) {
            return GPOM_OK;
        }
    }
    return GPOM_ERR_BUSY;
}

gpom_status_t gpom_lowres_cell(const gpom_map_t *map, uint32_t layer, uint32_t ix, uint32_t iy,
                               gpom_cell_t *cell)
{
    if (!gpom::is_map(map) || !gpom::is_layer(layer) || cell == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Layer &raster = map->lowres.layers[layer];
    const gpom::Window &w = raster.window;
    if (ix >= w.nx || iy >= w.ny) {
        return GPOM_ERR_ARG;
    }
    const uint32_t slot =
        gpom::slot_of(w, w.ix0 + static_cast<int32_t>(ix), w.iy0 + static_cast<int32_t>(iy));
    *cell = gpom::read_cell(raster.cells[slot]);
    return GPOM_OK;
}

gpom_status_t gpom_lowres_at(const gpom_map_t *map, uint32_t layer, const gpom_point_t *point,
                             gpom_cell_t *cell)
{
    if (!gpom::is_map(map) || !gpom::is_layer(layer) || point == nullptr || cell == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Layer &raster = map->lowres.layers[layer];
    const gpom::Window &w = raster.window;
    const int32_t ix = gpom::cell_number(point->x_m, w.x0_m, w.cell_m);
    const int32_t iy = gpom::cell_number(point->y_m, w.y0_m, w.cell_m);
    if (!gpom::contains(w, ix, iy)) {
        return GPOM_ERR_REACH;
    }
    *cell = gpom::read_cell(raster.cells[gpom::slot_of(w, ix, iy)]);
    return GPOM_OK;
}
