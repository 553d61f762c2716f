#include "gpom/live.h"

#include "src/insert/forget.hpp"
#include "src/map/map.hpp"
#include "src/map/store.hpp"
#include "src/query/hot_path.hpp"
#include "src/refresh/lowres_step.hpp"

namespace gpom
{

namespace
{

uint64_t build_slice(gpom_map &map, uint64_t budget)
{
    const uint64_t n_items = budget / GPOM_INDEX_ITEM_OPS;
    const auto n = static_cast<uint32_t>(n_items < UINT32_MAX ? n_items : UINT32_MAX);
    return uint64_t{GPOM_INDEX_ITEM_OPS} * build_some(map.index, n);
}

} // namespace

} // namespace gpom

gpom_status_t gpom_map_step(gpom_map_t *map, uint64_t budget, const gpom_scratch_t *scratch,
                            uint64_t *used)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = scratch == nullptr ? GPOM_OK : gpom::check_scratch(*map, *scratch);
    if (status != GPOM_OK) {
        return status;
    }
    const bool is_dirty = scratch != nullptr && gpom::has_dirty_cells(map->lowres);
    uint64_t done = gpom::build_slice(*map, is_dirty ? budget / 2 : budget);
    if (scratch != nullptr) {
        done += gpom::lowres_step(*map, *scratch, budget - done);
        done += gpom::build_slice(*map, budget - done);
    }
    if (used != nullptr) {
        *used = done;
    }
    return GPOM_OK;
}

gpom_status_t gpom_map_clear(gpom_map_t *map)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    gpom::drop_all(*map);
    gpom::lowres_clear(map->lowres);
    return GPOM_OK;
}

gpom_status_t gpom_map_forget(gpom_map_t *map, const gpom_disc_t *disc)
{
    if (!gpom::is_map(map) || !gpom::is_disc(disc)) {
        return GPOM_ERR_ARG;
    }
    gpom::forget_disc(*map, *disc);
    return GPOM_OK;
}

gpom_status_t gpom_map_jump(gpom_map_t *map, gpom_jump_t rule, const gpom_disc_t *disc)
{
    const bool is_known = rule == GPOM_JUMP_KEEP || rule == GPOM_JUMP_CLEAR ||
                          (rule == GPOM_JUMP_FORGET && gpom::is_disc(disc));
    if (!gpom::is_map(map) || !is_known) {
        return GPOM_ERR_ARG;
    }
    const bool clears = rule == GPOM_JUMP_CLEAR;
    gpom::lowres_start_epoch(map->lowres, clears);
    if (clears) {
        gpom::drop_all(*map);
    } else if (rule == GPOM_JUMP_FORGET) {
        gpom::forget_disc(*map, *disc);
    }
    return GPOM_OK;
}
