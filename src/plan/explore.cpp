#include "gpom/path.h"

#include "src/base/arena.hpp"
#include "src/map/map.hpp"

#include <string.h>

namespace gpom
{
namespace
{

/// A breadth-first search over the coarse layer. Cells are numbered iy * nx + ix, counted from the
/// window's corner.
struct Flood {
    const Layer &layer;
    uint32_t *queue;  ///< Free cells and the start, in the order in which they were reached.
    uint8_t *reached; ///< One bit per cell.
    uint32_t n_queued;
};

uint32_t value_at(const Layer &layer, uint32_t i_cell)
{
    const Window &w = layer.window;
    const int32_t ix = w.ix0 + static_cast<int32_t>(i_cell % w.nx);
    const int32_t iy = w.iy0 + static_cast<int32_t>(i_cell / w.nx);
    return load(layer.cells[slot_of(w, ix, iy)].value);
}

/// Mark a cell as reached. True if it was not reached before.
bool reach(Flood &flood, uint32_t i_cell)
{
    const uint8_t bit = static_cast<uint8_t>(1u << i_cell % 8);
    uint8_t &bits = flood.reached[i_cell / 8];
    if ((bits & bit) != 0) {
        return false;
    }
    bits = static_cast<uint8_t>(bits | bit);
    return true;
}

/// True if goal a comes before goal b: by greater variance, then fewer steps, then lower index.
bool is_better(const Window &w, const gpom_goal_t &a, const gpom_goal_t &b)
{
    if (a.variance != b.variance) {
        return a.variance > b.variance;
    }
    if (a.n_steps != b.n_steps) {
        return a.n_steps < b.n_steps;
    }
    return uint64_t{a.iy} * w.nx + a.ix < uint64_t{b.iy} * w.nx + b.ix;
}

/// Insert a goal into the sorted list. If the list is full, the worst goal is left out.
void rank(gpom_goals_t &list, const Window &w, const gpom_goal_t &goal)
{
    if (list.n_goals == list.n_goals_max) {
        if (!is_better(w, goal, list.goals[list.n_goals - 1])) {
            return;
        }
        --list.n_goals;
    }
    uint32_t i = list.n_goals++;
    while (i > 0 && is_better(w, goal, list.goals[i - 1])) {
        list.goals[i] = list.goals[i - 1];
        --i;
    }
    list.goals[i] = goal;
}

/// Reach a neighbour that is n_steps from the start. It is a goal unless it is occupied. If it is
/// free, the search goes on from it.
void visit(Flood &flood, gpom_goals_t &list, uint32_t i_cell, uint32_t n_steps)
{
    if (!reach(flood, i_cell)) {
        return;
    }
    const uint32_t value = value_at(flood.layer, i_cell);
    const uint32_t cls = class_of_value(value);
    if (cls == GPOM_OCCUPIED) {
        return;
    }
    const Window &w = flood.layer.window;
    rank(list, w,
         {i_cell % w.nx, i_cell / w.nx, n_steps, static_cast<uint8_t>(value >> 16 & 0xff),
          static_cast<uint8_t>(cls)});
    if (cls == GPOM_FREE) {
        flood.queue[flood.n_queued++] = i_cell;
    }
}

void visit_neighbours(Flood &flood, gpom_goals_t &list, uint32_t i_cell, uint32_t n_steps)
{
    const Window &w = flood.layer.window;
    const uint32_t ix = i_cell % w.nx;
    const uint32_t iy = i_cell / w.nx;
    if (ix > 0) {
        visit(flood, list, i_cell - 1, n_steps);
    }
    if (ix + 1 < w.nx) {
        visit(flood, list, i_cell + 1, n_steps);
    }
    if (iy > 0) {
        visit(flood, list, i_cell - w.nx, n_steps);
    }
    if (iy + 1 < w.ny) {
        visit(flood, list, i_cell + w.nx, n_steps);
    }
}

void flood_from(Flood &flood, gpom_goals_t &list, uint32_t start)
{
    (void)reach(flood, start);
    flood.queue[flood.n_queued++] = start;
    uint32_t next = 0;
    for (uint32_t n_steps = 1; next < flood.n_queued; ++n_steps) {
        const uint32_t wave_end = flood.n_queued; // cells queued by now are n_steps - 1 away
        for (; next < wave_end; ++next) {
            visit_neighbours(flood, list, flood.queue[next], n_steps);
        }
    }
}

} // namespace
} // namespace gpom

gpom_status_t gpom_explore(const gpom_map_t *map, const gpom_point_t *from, gpom_goals_t *goals,
                           const gpom_scratch_t *scratch)
{
    if (goals == nullptr) {
        return GPOM_ERR_ARG;
    }
    goals->n_goals = 0;
    if (!gpom::is_map(map) || from == nullptr || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Layer &layer = map->lowres.layers[GPOM_LAYER_COARSE];
    const gpom::Window &w = layer.window;
    if (goals->goals == nullptr || goals->n_goals_max == 0 || w.nx == 0) {
        return GPOM_ERR_ARG;
    }
    if (scratch->mem == nullptr || scratch->mem_bytes < GPOM_EXPLORE_BYTES(w.nx, w.ny)) {
        return GPOM_ERR_MEM;
    }
    const int32_t ix = gpom::cell_number(from->x_m, w.x0_m, w.cell_m);
    const int32_t iy = gpom::cell_number(from->y_m, w.y0_m, w.cell_m);
    if (!gpom::contains(w, ix, iy)) {
        return GPOM_ERR_REACH;
    }
    const size_t n_cells = gpom::cell_count(w);
    const uintptr_t start =
        gpom::align_up(reinterpret_cast<uintptr_t>(scratch->mem), sizeof(uint32_t));
    void *const mem = reinterpret_cast<void *>(start);
    gpom::Flood flood = {layer, gpom::carve<uint32_t>(mem, 0),
                         gpom::carve<uint8_t>(mem, n_cells * sizeof(uint32_t)), 0};
    memset(flood.reached, 0, n_cells / 8 + 1);
    const uint32_t kx = static_cast<uint32_t>(ix - w.ix0);
    const uint32_t ky = static_cast<uint32_t>(iy - w.iy0);
    gpom::flood_from(flood, *goals, ky * w.nx + kx);
    return GPOM_OK;
}
