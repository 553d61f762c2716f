// Evaluating dirty cells in slices, in the order that lowres.h describes.
#include "src/refresh/lowres_step.hpp"

#include "src/base/assert.hpp"
#include "src/query/workspace.hpp"

namespace gpom
{
namespace
{

/// Sources of the next cell, the most urgent first.
enum class Source : uint8_t { near, coarse, focus, all_coarse, all_focus };

constexpr Source kPrecedence[] = {Source::near, Source::coarse, Source::focus, Source::all_coarse,
                                  Source::all_focus};

constexpr uint32_t kBatchCycle = 8;

/// Cells that are evaluated together.
struct CellBatch {
    uint32_t slots[kBatchSize];
    uint32_t n;
    uint32_t is_focus; ///< Bit i: cell i belongs to the focus layer.
    uint64_t n_looks, n_looks_max;
};
static_assert(kBatchSize <= 32, "a bit each");

/// The state of one selection of cells.
struct Work {
    Lowres &lowres;
    PointBatch &points;
    CellBatch batch;

    bool has_room() const { return batch.n < kBatchSize && batch.n_looks < batch.n_looks_max; }
};

gpom_point_t centre_of(const Window &w, uint32_t slot)
{
    const int32_t column = static_cast<int32_t>(slot % w.nx);
    const int32_t row = static_cast<int32_t>(slot / w.nx);
    const int32_t ix = w.ix0 + static_cast<int32_t>(wrap_index(column - w.ix0, w.nx));
    const int32_t iy = w.iy0 + static_cast<int32_t>(wrap_index(row - w.iy0, w.ny));
    return {w.x0_m + (ix + 0.5) * w.cell_m, w.y0_m + (iy + 0.5) * w.cell_m};
}

void take(Work &work, uint32_t i_layer, uint32_t slot)
{
    CellBatch &batch = work.batch;
    Layer &layer = work.lowres.layers[i_layer];
    Cell &cell = layer.cells[slot];
    const uint32_t value = load(cell.value);
    if ((value & kDirty) != 0) {
        store(cell.value, value & ~kDirty);
        store(layer.n_dirty, load(layer.n_dirty) - 1);
    }
    work.points.points[batch.n] = centre_of(layer.window, slot);
    batch.slots[batch.n] = slot;
    batch.is_focus |= i_layer << batch.n;
    ++batch.n;
}

/// Offset from the robot's cell to a place on the spiral. A ring has four sides of 2 ring cells.
void spiral_offset(const Spiral &place, int32_t &dx, int32_t &dy)
{
    const int32_t ring = static_cast<int32_t>(place.ring);
    const int32_t side = ring > 0 ? static_cast<int32_t>(place.i) / (2 * ring) : 0;
    const int32_t along = ring > 0 ? static_cast<int32_t>(place.i) % (2 * ring) - ring : 0;
    dx = side == 0 ? along : side == 1 ? ring : side == 2 ? -along : -ring;
    dy = side == 0 ? -ring : side == 1 ? along : side == 2 ? ring : -along;
}

void advance(Spiral &place)
{
    if (++place.i >= 8 * place.ring) {
        ++place.ring;
        place.i = 0;
    }
}

/// Take dirty cells along the spiral. All cells that the spiral has passed are clean, because each
/// mark starts the spiral again.
void take_near(Work &work)
{
    Lowres &lowres = work.lowres;
    const Layer &layer = lowres.layers[GPOM_LAYER_COARSE];
    while (work.has_room() && load(layer.n_dirty) > 0 &&
           lowres.near.ring <= GPOM_LOWRES_NEAR_CELLS) {
        int32_t dx, dy;
        spiral_offset(lowres.near, dx, dy);
        advance(lowres.near);
        ++work.batch.n_looks;
        const int32_t ix = lowres.robot_ix + dx;
        const int32_t iy = lowres.robot_iy + dy;
        if (!contains(layer.window, ix, iy)) {
            continue;
        }
        const uint32_t slot = slot_of(layer.window, ix, iy);
        if ((load(layer.cells[slot].value) & kDirty) != 0) {
            take(work, GPOM_LAYER_COARSE, slot);
        }
    }
}

/// Slot of a place of the round. A round visits one tile after the other, and the slots of a tile
/// along a Z-order curve, so that successive slots are close together. False if the place is beyond
/// the raster.
bool slot_of_place(const Window &w, uint32_t place, uint32_t &slot)
{
    const uint32_t tile = place / (kTileSide * kTileSide);
    const uint32_t in_x = (place & 1) | (place >> 1 & 2);
    const uint32_t in_y = (place >> 1 & 1) | (place >> 2 & 2);
    const uint32_t column = tile % tiles_along(w.nx) * kTileSide + in_x;
    const uint32_t row = tile / tiles_along(w.nx) * kTileSide + in_y;
    slot = row * w.nx + column;
    return column < w.nx && row < w.ny;
}

uint32_t next_place(const Window &w, uint32_t &cursor)
{
    const uint32_t place = cursor < place_count(w) ? cursor : 0;
    cursor = place + 1;
    return place;
}

void take_dirty(Work &work, uint32_t i_layer)
{
    Layer &layer = work.lowres.layers[i_layer];
    while (work.has_room() && load(layer.n_dirty) > 0) {
        uint32_t slot;
        const bool is_cell =
            slot_of_place(layer.window, next_place(layer.window, layer.cursor), slot);
        ++work.batch.n_looks;
        if (is_cell && (load(layer.cells[slot].value) & kDirty) != 0) {
            take(work, i_layer, slot);
        }
    }
}

void take_any(Work &work, uint32_t i_layer)
{
    Layer &layer = work.lowres.layers[i_layer];
    while (work.has_room() && layer.n_stale > 0) {
        uint32_t slot;
        const bool is_cell =
            slot_of_place(layer.window, next_place(layer.window, layer.refresh), slot);
        ++work.batch.n_looks;
        --layer.n_stale;
        if (is_cell && (load(layer.cells[slot].value) & kOutside) == 0) {
            take(work, i_layer, slot);
        }
    }
}

void take_from(Work &work, Source source)
{
    switch (source) {
    case Source::near:
        return take_near(work);
    case Source::coarse:
        return take_dirty(work, GPOM_LAYER_COARSE);
    case Source::focus:
        return take_dirty(work, GPOM_LAYER_FOCUS);
    case Source::all_coarse:
        return take_any(work, GPOM_LAYER_COARSE);
    case Source::all_focus:
        return take_any(work, GPOM_LAYER_FOCUS);
    }
}

/// The source of dirty cells that a batch begins with.
Source first_source(uint32_t batch_number)
{
    if (batch_number % 2 == 0) {
        return Source::near;
    }
    return batch_number == kBatchCycle - 1 ? Source::focus : Source::coarse;
}

void take_batch(Work &work)
{
    take_from(work, first_source(work.lowres.batch_number));
    for (const Source source : kPrecedence) {
        take_from(work, source);
    }
}

void evaluate(gpom_map &map, const Work &work, const gpom_scratch_t &scratch)
{
    const CellBatch &batch = work.batch;
    const gpom_status_t status =
        gpom_query_points(&map, work.points.points, batch.n, work.points.answers, &scratch);
    GPOM_ASSERT(status != GPOM_ERR_ARG && status != GPOM_ERR_MEM);
    (void)status; // the flags of the answers show all other errors
    const uint32_t stamp_ms = load(map.lowres.newest_ms);
    for (uint32_t i = 0; i < batch.n; ++i) {
        Cell &cell = map.lowres.layers[batch.is_focus >> i & 1].cells[batch.slots[i]];
        const gpom_answer_t &answer = work.points.answers[i];
        map.stats.cells_cut += (answer.flags & GPOM_ANSWER_CUT) != 0 ? 1 : 0;
        store(cell.value, lowres_value(map.lowres, answer));
        store(cell.stamp_ms, stamp_ms); // after the value: see read_cell() in lowres_read.cpp
    }
}

} // namespace

uint64_t lowres_step(gpom_map &map, const gpom_scratch_t &scratch, uint64_t budget)
{
    const gpom_params_t &params = map.config.params;
    const uint64_t cell_ops = GPOM_LOWRES_CELL_OPS(params.n_hits + params.n_free);
    const uint64_t batch_ops = GPOM_LOWRES_BATCH_OPS(params.n_hits + params.n_free);
    PointBatch &points = *carve_batch(scratch.mem);
    uint64_t used = 0;
    while (budget - used >= batch_ops) {
        Work work = {map.lowres, points, {}};
        work.batch.n_looks_max = budget - used - kBatchSize * cell_ops;
        take_batch(work);
        used += work.batch.n_looks + work.batch.n * cell_ops;
        if (work.batch.n == 0) {
            break;
        }
        evaluate(map, work, scratch);
        map.lowres.batch_number = static_cast<uint8_t>((map.lowres.batch_number + 1) % kBatchCycle);
    }
    return used;
}

} // namespace gpom
