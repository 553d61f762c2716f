/* A map by the C library alone, for comparison with the package: called by ctypes. */
#include "gpom/gpom.h"

#include <stdlib.h>

static gpom_map_t *map;
static gpom_scratch_t scratch;

/* heads: for each scan x, y, yaw [m, rad], angle_min, angle_step [rad], range_max [m].
 * Returns a status. */
int peer_map(const uint8_t *record, size_t record_bytes, const double *heads,
             const int64_t *stamps_us, const float *ranges_m, uint32_t n_scans, uint32_t n_ranges)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.beam_max = n_scans * n_ranges;
    gpom_status_t status = gpom_params_load(&config.params, record, record_bytes, NULL);
    const size_t mem_bytes = gpom_map_bytes(&config);
    if (status == GPOM_OK) {
        status = gpom_map_init(&map, &config, malloc(mem_bytes), mem_bytes);
    }
    for (uint32_t i = 0; i < n_scans && status == GPOM_OK; ++i) {
        const double *const head = heads + 6 * (size_t)i;
        const gpom_scan_t scan = {stamps_us[i], head[3], head[4], ranges_m + (size_t)i * n_ranges,
                                  n_ranges};
        const gpom_pose_t pose = {head[0], head[1], head[2], NULL};
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        sensor.range_min_m = 0.0f;
        sensor.range_max_m = (float)head[5];
        status = gpom_scan_insert(map, &scan, &sensor, &pose);
    }
    scratch.mem_bytes = gpom_scratch_bytes(map);
    scratch.mem = malloc(scratch.mem_bytes);
    return status == GPOM_OK ? (int)gpom_map_build(map) : (int)status;
}

int peer_query(const double *points, size_t n_points, gpom_answer_t *answers)
{
    return (int)gpom_query_points(map, (const gpom_point_t *)points, n_points, answers, &scratch);
}
