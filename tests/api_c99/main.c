/* A user's own unit test of code that uses gpom, in plain C99 on the host: a map and its scratch in
 * static memory, one scan, a few questions. Returns 0 if all is as expected. */
#include "gpom/gpom.h"

#include <math.h>
#include <stdio.h>

#define BEAM_MAX 64
#define N_POINTS 16 /* 8 + 8 neighbours, the default */
#define N_RANGES 5
#define N_CELLS 4

static uint64_t map_memory[(GPOM_MAP_BYTES(BEAM_MAX, 0) + 7) / 8];
static unsigned char scratch_memory[GPOM_SCRATCH_BYTES(N_POINTS, GPOM_LANES_MAX)];
static int n_failed;

static void expect(int is_true, const char *what)
{
    if (!is_true) {
        ++n_failed;
        fprintf(stderr, "api_c99: failed: %s\n", what);
    }
}

static gpom_map_t *make_map(void)
{
    gpom_config_t config;
    gpom_map_t *map = NULL;
    gpom_config_init(&config);
    config.beam_max = BEAM_MAX;
    expect(gpom_params_check(&config.params, NULL) == GPOM_OK, "the defaults are accepted");
    expect(gpom_map_bytes(&config) <= sizeof map_memory, "the macro is large enough");
    expect(gpom_map_init(&map, &config, map_memory, 100) == GPOM_ERR_MEM,
           "short memory is refused");
    expect(map == NULL, "and gives no map");
    expect(gpom_map_init(&map, &config, map_memory, sizeof map_memory) == GPOM_OK,
           "the map is made");
    return map;
}

/* A wall 5 m ahead, seen under five bearings; one reading is lost. */
static void insert_wall(gpom_map_t *map)
{
    static const float ranges_m[N_RANGES] = {5.10f, 5.02f, NAN, 5.02f, 5.10f};
    static const float pose_cov[9] = {1e-4f, 0, 0, 0, 1e-4f, 0, 0, 0, 1e-6f};
    const gpom_pose_t pose = {0.0, 0.0, 0.0, pose_cov};
    gpom_sensor_t sensor;
    gpom_scan_t scan = {0};
    gpom_stats_t stats;
    gpom_beam_t beam;
    gpom_sensor_init(&sensor);
    scan.stamp_us = 1000;
    scan.angle_min_rad = -0.2;
    scan.angle_step_rad = 0.1;
    scan.ranges_m = ranges_m;
    scan.n_ranges = N_RANGES;
    expect(gpom_scan_insert(map, &scan, &sensor, &pose) == GPOM_OK, "the scan is taken");
    expect(gpom_map_stats(map, &stats) == GPOM_OK, "the counters can be read");
    expect(stats.beams_hit == 4 && stats.beams_nan == 1, "four beams are kept, one is counted");
    expect(gpom_map_beam_count(map) == 4, "four beams are in the map");
    expect(gpom_map_beam(map, 3, &beam) == GPOM_OK, "a beam can be read back");
    expect(beam.range_m == ranges_m[4] && beam.stamp_us == 1000 && beam.id == 3, "as inserted");
}

static void ask(const gpom_map_t *map)
{
    const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};
    const gpom_point_t points[3] = {{2.5, 0.0}, {5.05, 0.5}, {-500.0, 0.0}};
    const gpom_raster_t raster = {0.0, -1.0, 1.0, N_CELLS, 1};
    gpom_answer_t answers[3];
    gpom_answer_t cells[N_CELLS];
    expect(gpom_scratch_bytes(map) <= sizeof scratch_memory, "the scratch is large enough");
    expect(gpom_query_points(map, points, 3, answers, &scratch) == GPOM_OK, "points are answered");
    expect(answers[0].mean < -0.5f, "before the wall it is free");
    expect(answers[1].mean > answers[0].mean + 0.5f, "at the wall it is not");
    expect(answers[1].probability > answers[0].probability, "and the probability agrees");
    expect(answers[2].cls == GPOM_UNSURE, "behind the robot nothing is known");
    expect(gpom_query_raster(map, &raster, cells, &scratch) == GPOM_OK, "a raster is answered");
    expect(cells[0].cls == GPOM_FREE, "the cell before the robot is free");
}

int main(void)
{
    gpom_map_t *const map = make_map();
    if (map == NULL) {
        return 1;
    }
    expect(gpom_version() == GPOM_VERSION, "header and library are one version");
    expect(gpom_status_str(GPOM_OK)[0] != '\0', "a status has a text");
    insert_wall(map);
    ask(map);
    expect(gpom_map_build(map) == GPOM_OK, "the map can be indexed");
    ask(map);
    expect(gpom_map_clear(map) == GPOM_OK && gpom_map_beam_count(map) == 0, "and cleared");
    return n_failed == 0 ? 0 : 1;
}
