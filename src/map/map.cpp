#include "src/map/map.hpp"

#include "src/base/assert.hpp"
#include "src/map/config_check.hpp"

#include <string.h>

void gpom_config_init(gpom_config_t *config)
{
    if (config == nullptr) {
        return;
    }
    *config = gpom_config_t{};
    config->struct_bytes = sizeof(gpom_config_t);
    config->beam_max = 1024;
    config->lowres_unknown = 0.95f;
    config->walk_max = GPOM_WALK_MAX;
    gpom_params_init(&config->params);
}

namespace
{

/// Point the map's arrays at their places in its memory.
void carve_arrays(gpom_map &map, const gpom::MapLayout &layout)
{
    void *const mem = &map;
    gpom::Index &index = map.index;
    index.beams = gpom::carve<gpom::Beam>(mem, layout.beams);
    index.beam_max = map.config.beam_max;
    index.recent = gpom::carve<gpom::RecentBlock>(mem, layout.recent);
    index.n_recent_max = gpom::recent_capacity(map.config.beam_max);
    for (uint32_t i = 0; i < index.n_recent_max; ++i) {
        gpom::reset_recent(index, i);
    }
    gpom::KdTree *const trees[3] = {&index.hit_tree, &index.free_tree, &index.spare};
    for (int i_tree = 0; i_tree < 3; ++i_tree) {
        *trees[i_tree] = {index.beams, gpom::carve<gpom::Box>(mem, layout.boxes[i_tree]),
                          gpom::carve<uint32_t>(mem, layout.slots[i_tree]), 0, 0};
    }
    map.keeper.provisional = gpom::carve<gpom::Waiting>(mem, layout.provisional);
    map.keeper.provisional_max = gpom::provisional_capacity(map.config.beam_max);
}

/// Noise variances of a map. sn2_once applies only if keep_m > 0. Without keep_m, repeated returns
/// are kept as beams of their own, and the map does not know which hits were confirmed.
gpom::Noise noise_in(const gpom_config_t &config, float prior_variance)
{
    const gpom_params_t &params = config.params;
    const bool has_once = config.keep_m > 0.0f && params.sn2_once > 0.0f;
    return {params.sn2, has_once ? params.sn2_once : params.sn2,
            gpom::raised(params.sn2, prior_variance, gpom::kPastExcess), params.sn2_free};
}

} // namespace

size_t gpom_map_bytes(const gpom_config_t *config)
{
    if (config == nullptr || gpom::capacity_problem(*config) != gpom::ConfigProblem::none) {
        return 0;
    }
    return gpom::map_layout(config->beam_max, gpom::lowres_cell_count(*config)).total;
}

gpom_status_t gpom_map_init(gpom_map_t **map, const gpom_config_t *config, void *mem,
                            size_t mem_bytes)
{
    if (map == nullptr) {
        return GPOM_ERR_ARG;
    }
    *map = nullptr;
    if (config == nullptr || gpom::config_problem(*config) != gpom::ConfigProblem::none) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = gpom_params_check(&config->params, nullptr);
    if (status != GPOM_OK) {
        return status;
    }
    const gpom::MapLayout layout =
        gpom::map_layout(config->beam_max, gpom::lowres_cell_count(*config));
    if (mem == nullptr || !gpom::is_aligned(mem, 8) || mem_bytes < layout.total) {
        return GPOM_ERR_MEM;
    }
    memset(mem, 0, sizeof(gpom_map));
    gpom_map &made = *static_cast<gpom_map *>(mem);
    made.config = *config;
    made.kernel = gpom::kernel_constants(config->params);
    made.prior_variance = gpom_params_prior_variance(&config->params);
    made.prior_probability = gpom_params_prior_probability(&config->params);
    made.noise = noise_in(*config, made.prior_variance);
    made.dense_max = GPOM_POINTS_MAX;
    carve_arrays(made, layout);
    made.index.hit_part = {config->params.depth_m};
    made.index.free_part = {config->params.gap_m};
    gpom::forget_all(made.index);
    gpom::lowres_init(made.lowres, *config, gpom::carve<gpom::Cell>(mem, layout.cells));
    made.magic = gpom::kMapMagic;
    *map = &made;
    return GPOM_OK;
}

gpom_status_t gpom_map_build(gpom_map_t *map)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    gpom::start_build(map->index);
    while (gpom::is_building(map->index)) {
        gpom::build_some(map->index, UINT32_MAX);
    }
    return GPOM_OK;
}

gpom_status_t gpom_map_stats(const gpom_map_t *map, gpom_stats_t *stats)
{
    if (!gpom::is_map(map) || stats == nullptr) {
        return GPOM_ERR_ARG;
    }
    *stats = map->stats;
    return GPOM_OK;
}

uint64_t gpom_stats_evicted(const gpom_stats_t *stats)
{
    return stats == nullptr ? 0
                            : stats->beams_evicted_redundant + stats->beams_evicted_far +
                                  stats->beams_evicted_old + stats->beams_evicted_contradicted;
}

uint32_t gpom_map_beam_count(const gpom_map_t *map)
{
    return gpom::is_map(map) ? map->index.n_beams : 0;
}

uint32_t gpom_map_slot_count(const gpom_map_t *map)
{
    return gpom::is_map(map) ? map->index.n_slots : 0;
}

gpom_status_t gpom_map_beam(const gpom_map_t *map, uint32_t i_slot, gpom_beam_t *beam)
{
    if (!gpom::is_map(map) || beam == nullptr || i_slot >= map->index.n_slots) {
        return GPOM_ERR_ARG;
    }
    const gpom::Beam &kept = map->index.beams[i_slot];
    *beam = gpom_beam_t{};
    if (!is_kept(kept)) {
        return GPOM_OK;
    }
    beam->x_m = map->config.origin_x_m + static_cast<double>(kept.x_m);
    beam->y_m = map->config.origin_y_m + static_cast<double>(kept.y_m);
    beam->stamp_us = map->lowres.stamp0_us + int64_t{1000} * kept.stamp_ms;
    beam->dir_x = kept.dir_x;
    beam->dir_y = kept.dir_y;
    beam->range_m = kept.range_m;
    beam->hit_noise = gpom::noise_of(*map, kept, map->index.hit_part);
    beam->free_noise = gpom::noise_of(*map, kept, map->index.free_part);
    beam->excess = kept.excess;
    beam->id = kept.id;
    beam->scan = kept.scan;
    beam->is_hit = has_hit(kept) ? 1 : 0;
    beam->is_free = kept.has_free != 0 ? 1 : 0;
    beam->returned = kept.returned != 0 ? 1 : 0;
    beam->provisional = is_provisional(kept) ? 1 : 0;
    beam->past = is_past(kept) ? 1 : 0;
    if (!is_past(kept)) { // its counts hold a time
        beam->n_agreed = static_cast<uint8_t>(kept.agreed);
        beam->n_against = static_cast<uint8_t>(kept.hit_against);
        beam->arrived = kept.arrived != 0 ? 1 : 0;
    }
    return GPOM_OK;
}
