/* A user's project: is the wall occupied, and the way to it free? */
#include "wall.h"

#include <stdio.h>

static uint64_t memory[(GPOM_MAP_BYTES(64, 0) + 7) / 8];
static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(16, GPOM_LANES_MAX)];

int main(void)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.beam_max = 64;
    gpom_map_t *map;
    if (gpom_version() != GPOM_VERSION || gpom_map_init(&map, &config, memory, sizeof memory) ||
        see_wall(map)) {
        return 1;
    }
    const gpom_point_t points[] = {{5.0, 0.0}, {3.0, 0.0}};
    const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};
    gpom_answer_t answers[2];
    if (gpom_query_points(map, points, 2, answers, &scratch)) {
        return 1;
    }
    printf("wall %d, way %d\n", answers[0].cls, answers[1].cls);
    return answers[0].cls == GPOM_OCCUPIED && answers[1].cls == GPOM_FREE ? 0 : 1;
}
