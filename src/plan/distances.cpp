#include "gpom/distances.h"

#include "src/lane/lane.hpp"
#include "src/map/map.hpp"
#include "src/plan/distance_field.hpp"
#include "src/raster/reading.hpp"

namespace gpom
{
namespace
{

bool is_field(const gpom_distances *field)
{
    return field != nullptr && field->magic == kFieldMagic;
}

/// Take over the raster's window. If it moved, every distance may have changed.
void follow(gpom_distances &field, const Window &w, const gpom_lowres_info_t &info)
{
    const bool is_same = field.window.ix0 == w.ix0 && field.window.iy0 == w.iy0;
    field.window = w;
    field.frame_epoch = info.frame_epoch;
    if (!is_same) {
        mark_field(field);
        field.compared = w.ny; // every column is swept, which compares too
    }
    if (field.compared == 0 || !is_same) {
        field.begun_sequence = info.map_sequence;
    }
}

/// Do the next piece of work if the budget is enough for any such piece. Returns the operations, or
/// 0: nothing is left, or the budget is too small.
uint64_t do_next(gpom_distances &field, const Layer &layer, uint64_t budget)
{
    const Window &w = field.window;
    if (field.compared < w.ny) {
        return budget >= w.nx ? compare_row(field, layer) : 0;
    }
    if (field.n_columns > 0) {
        return budget >= w.nx + kSweepOps * w.ny ? sweep_next_column(field, layer) : 0;
    }
    const bool may_sweep = field.n_rows > 0 && budget >= w.ny + kSweepOps * w.nx;
    return may_sweep ? sweep_next_row(field) : 0;
}

/// Work until the pass ends or the budget is used. Returns the operations.
uint64_t work(gpom_distances &field, const Layer &layer, uint64_t budget)
{
    uint64_t used = 0;
    for (uint64_t ops = 1; ops > 0;) {
        ops = do_next(field, layer, budget - used);
        used += ops;
    }
    if (field.compared == field.window.ny && field.n_columns == 0 && field.n_rows == 0) {
        field.compared = 0;
        field.map_sequence = field.begun_sequence;
    }
    return used;
}

gpom_distance_t distance_of(Nearest offset, double cell_m)
{
    if (offset.across == kNone) {
        return {__builtin_inff(), 0.0f, 0.0f};
    }
    const float dx = static_cast<float>(offset.across), dy = static_cast<float>(offset.along);
    const float cells = lane::sqrt(dx * dx + dy * dy);
    const float inverse = cells > 0.0f ? 1.0f / cells : 0.0f;
    return {cells * static_cast<float>(cell_m), -dx * inverse, -dy * inverse};
}

gpom_offsets_t offsets_of(const gpom_distances &field, uint32_t ix, uint32_t iy)
{
    const Nearest occupied = offset_at(field, kOccupied, ix, iy);
    const Nearest not_free = offset_at(field, kNotFree, ix, iy);
    return {occupied.across, occupied.along, not_free.across, not_free.along};
}

gpom_distances_info_t info_of(const gpom_distances &field)
{
    const Window &w = field.window;
    return {{w.x0_m + w.ix0 * w.cell_m, w.y0_m + w.iy0 * w.cell_m, w.cell_m, w.nx, w.ny},
            field.frame_epoch,
            field.map_sequence,
            field.n_columns + field.n_rows};
}

/// Make the field of a raster, without any target.
gpom_distances &make_field(void *mem, const Window &w)
{
    const FieldLayout layout = field_layout(w.nx, w.ny);
    gpom_distances &field = *carve<gpom_distances>(mem, 0);
    field = gpom_distances{};
    field.magic = kFieldMagic;
    field.window = w;
    field.envelope = carve<Parabola>(mem, layout.envelope);
    field.columns = carve<Changes>(mem, layout.columns);
    field.rows = carve<Changes>(mem, layout.rows);
    for (uint32_t target = 0; target < kTargets; ++target) {
        field.nearest[target] = carve<Nearest>(mem, layout.nearest[target]);
        for (size_t i = 0; i < cell_count(w); ++i) {
            field.nearest[target][i] = {kNone, kNone};
        }
    }
    mark_field(field);
    return field;
}

} // namespace
} // namespace gpom

gpom_status_t gpom_distances_init(gpom_distances_t **field, const gpom_map_t *map, void *mem,
                                  size_t mem_bytes)
{
    if (field == nullptr) {
        return GPOM_ERR_ARG;
    }
    *field = nullptr;
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    const gpom::Window &w = map->lowres.layers[GPOM_LAYER_COARSE].window;
    if (w.nx == 0 || w.nx > GPOM_DISTANCES_SIDE_MAX || w.ny > GPOM_DISTANCES_SIDE_MAX) {
        return GPOM_ERR_ARG;
    }
    if (mem == nullptr || !gpom::is_aligned(mem, 8) ||
        mem_bytes < gpom::field_layout(w.nx, w.ny).total) {
        return GPOM_ERR_MEM;
    }
    *field = &gpom::make_field(mem, w);
    return GPOM_OK;
}

gpom_status_t gpom_distances_step(gpom_distances_t *field, const gpom_map_t *map, uint64_t budget,
                                  uint64_t *used)
{
    if (!gpom::is_field(field) || !gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    const gpom::Lowres &lowres = map->lowres;
    const gpom::Layer &layer = lowres.layers[GPOM_LAYER_COARSE];
    for (uint32_t i = 0; i < GPOM_LOWRES_TRIES; ++i) {
        uint32_t counter;
        gpom::Window window;
        if (!gpom::begin_read(lowres, counter)) {
            continue;
        }
        const gpom_lowres_info_t info = gpom::read_info(lowres, layer, window);
        if (!gpom::end_read(lowres, counter)) {
            continue;
        }
        if (window.nx != field->window.nx || window.ny != field->window.ny) {
            return GPOM_ERR_ARG;
        }
        gpom::follow(*field, window, info);
        const uint64_t done = gpom::work(*field, layer, budget);
        if (!gpom::end_read(lowres, counter)) {
            gpom::mark_field(*field); // the raster moved meanwhile
        }
        if (used != nullptr) {
            *used = done;
        }
        return GPOM_OK;
    }
    return GPOM_ERR_BUSY;
}

gpom_status_t gpom_distances_info(const gpom_distances_t *field, gpom_distances_info_t *info)
{
    if (!gpom::is_field(field) || info == nullptr) {
        return GPOM_ERR_ARG;
    }
    *info = gpom::info_of(*field);
    return GPOM_OK;
}

gpom_status_t gpom_distances_cell(const gpom_distances_t *field, uint32_t ix, uint32_t iy,
                                  gpom_offsets_t *offsets)
{
    if (!gpom::is_field(field) || offsets == nullptr || ix >= field->window.nx ||
        iy >= field->window.ny) {
        return GPOM_ERR_ARG;
    }
    *offsets = gpom::offsets_of(*field, ix, iy);
    return GPOM_OK;
}

gpom_status_t gpom_distances_at(const gpom_distances_t *field, const gpom_point_t *point,
                                gpom_distance_t *occupied, gpom_distance_t *not_free)
{
    if (!gpom::is_field(field) || point == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Window &w = field->window;
    const int32_t ix = gpom::cell_number(point->x_m, w.x0_m, w.cell_m);
    const int32_t iy = gpom::cell_number(point->y_m, w.y0_m, w.cell_m);
    if (!gpom::contains(w, ix, iy)) {
        return GPOM_ERR_REACH;
    }
    const auto kx = static_cast<uint32_t>(ix - w.ix0), ky = static_cast<uint32_t>(iy - w.iy0);
    if (occupied != nullptr) {
        *occupied = gpom::distance_of(gpom::offset_at(*field, gpom::kOccupied, kx, ky), w.cell_m);
    }
    if (not_free != nullptr) {
        *not_free = gpom::distance_of(gpom::offset_at(*field, gpom::kNotFree, kx, ky), w.cell_m);
    }
    return GPOM_OK;
}

gpom_status_t gpom_distances_copy(const gpom_distances_t *field, gpom_offsets_t *offsets,
                                  uint32_t cell_max, gpom_distances_info_t *info)
{
    if (!gpom::is_field(field) || offsets == nullptr || info == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Window &w = field->window;
    *info = gpom::info_of(*field);
    if (gpom::cell_count(w) > cell_max) {
        return GPOM_ERR_MEM;
    }
    for (uint32_t iy = 0; iy < w.ny; ++iy) {
        for (uint32_t ix = 0; ix < w.nx; ++ix) {
            *offsets++ = gpom::offsets_of(*field, ix, iy);
        }
    }
    return GPOM_OK;
}
