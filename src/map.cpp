#include "src/map.hpp"

#include "src/assert.hpp"

#include <float.h>
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
    gpom_params_init(&config->params);
}

namespace
{

bool is_valid_capacity(const gpom_config_t &config)
{
    const uint64_t n_cells = gpom::lowres_cell_count(config);
    return config.beam_max >= 1 && config.beam_max <= GPOM_BEAM_MAX && n_cells <= GPOM_CELL_MAX &&
           2048 + 56 * uint64_t{config.beam_max} + 8 * n_cells <= SIZE_MAX; // on 32 bits
}

bool is_finite(double x) { return x >= -DBL_MAX && x <= DBL_MAX; }

gpom_status_t check_config(const gpom_config_t *config)
{
    if (config == nullptr || config->struct_bytes != sizeof(gpom_config_t)) {
        return GPOM_ERR_ARG;
    }
    if (!is_valid_capacity(*config)) {
        return GPOM_ERR_ARG;
    }
    if (!is_finite(config->origin_x_m) || !is_finite(config->origin_y_m)) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_lowres_config(*config)) {
        return GPOM_ERR_ARG;
    }
    return gpom_params_check(&config->params, nullptr);
}

/// Point the map's arrays at their places in its memory.
void carve_arrays(gpom_map &map, const gpom::MapLayout &layout)
{
    void *const mem = &map;
    map.beams = gpom::carve<gpom::Beam>(mem, layout.beams);
    map.hit_tree = {map.beams, gpom::carve<gpom::Box>(mem, layout.hit_boxes),
                    gpom::carve<uint32_t>(mem, layout.hit_slots), 0};
    map.free_tree = {map.beams, gpom::carve<gpom::Box>(mem, layout.free_boxes),
                     gpom::carve<uint32_t>(mem, layout.free_slots), 0};
}

} // namespace

size_t gpom_map_bytes(const gpom_config_t *config)
{
    if (config == nullptr || !is_valid_capacity(*config)) {
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
    const gpom_status_t status = check_config(config);
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
    made.hit_part = {config->params.depth_m};
    made.free_part = {config->params.gap_m};
    carve_arrays(made, layout);
    gpom::lowres_init(made.lowres, *config, gpom::carve<gpom::Cell>(mem, layout.cells));
    made.magic = gpom::kMapMagic;
    *map = &made;
    return GPOM_OK;
}

gpom_status_t gpom_map_clear(gpom_map_t *map)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    map->n_beams = 0;
    map->n_indexed = 0;
    map->hit_tree.n_items = 0;
    map->free_tree.n_items = 0;
    gpom::lowres_clear(map->lowres);
    return GPOM_OK;
}

gpom_status_t gpom_map_build(gpom_map_t *map)
{
    if (!gpom::is_map(map)) {
        return GPOM_ERR_ARG;
    }
    map->hit_tree.n_items = 0;
    for (uint32_t slot = 0; slot < map->n_beams; ++slot) {
        map->free_tree.slots[slot] = slot;
        if (map->beams[slot].is_hit != 0) {
            map->hit_tree.slots[map->hit_tree.n_items++] = slot;
        }
    }
    map->free_tree.n_items = map->n_beams;
    gpom::build_hit_tree(map->hit_tree, map->hit_part, map->build_stack);
    gpom::build_free_tree(map->free_tree, map->free_part, map->build_stack);
    map->n_indexed = map->n_beams;
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

uint32_t gpom_map_beam_count(const gpom_map_t *map) { return gpom::is_map(map) ? map->n_beams : 0; }

gpom_status_t gpom_map_beam(const gpom_map_t *map, uint32_t i_beam, gpom_beam_t *beam)
{
    if (!gpom::is_map(map) || beam == nullptr || i_beam >= map->n_beams) {
        return GPOM_ERR_ARG;
    }
    const gpom::Beam &kept = map->beams[i_beam];
    const gpom_params_t &params = map->config.params;
    *beam = gpom_beam_t{};
    beam->x_m = map->config.origin_x_m + static_cast<double>(kept.x_m);
    beam->y_m = map->config.origin_y_m + static_cast<double>(kept.y_m);
    beam->stamp_us = kept.stamp_us;
    beam->dir_x = kept.dir_x;
    beam->dir_y = kept.dir_y;
    beam->range_m = kept.range_m;
    beam->hit_noise = gpom::noise_of(params.sn2, map->prior_variance, kept.excess);
    beam->free_noise = gpom::noise_of(params.sn2_free, map->prior_variance, kept.excess);
    beam->id = kept.id;
    beam->is_hit = kept.is_hit != 0 ? 1 : 0;
    return GPOM_OK;
}
