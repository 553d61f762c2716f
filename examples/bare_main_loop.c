/* The main loop of firmware without an operating system: scans go in, the map is kept up to date in
 * slices, and the robot is told how far it is free ahead.
 *
 *     arm-none-eabi-gcc -std=c99 -mcpu=cortex-m7 -Iinclude -Ibuild/host-release/include \
 *         -c examples/bare_main_loop.c
 *
 * All memory is static: 40 KB here. Replace the four board_... functions by your drivers. */
#include "gpom/gpom.h"
#include "gpom/presets/indoor.h" /* made by `make presets`; your own: gpom-params --to header */

/* Queries that the library computes side by side: 1 on a microcontroller, at most 16 on a PC. */
#ifndef LANES
#define LANES 1
#endif

enum { BEAM_MAX = 400, CELLS = 32, RANGES = 60, NEIGHBOURS = 16 /* n_hits + n_free */ };
static const double cell_m = 0.25;
static const double ahead_max_m = 3.0;

/* One after the other: is there a new scan? Then where it was taken, when, and its ranges. */
int board_scan_read(gpom_pose_t *pose, int64_t *stamp_us, float ranges_m[RANGES]);
/* What the robot may do: drive so far ahead. */
void board_drive(double free_m);
/* Something is wrong: stop the robot and say why. */
void board_stop(const char *why);
/* Sleep until the next control period. */
void board_wait(void);

static uint64_t map_memory[(GPOM_MAP_BYTES(BEAM_MAX, CELLS *CELLS) + 7) / 8];
static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(NEIGHBOURS, LANES)];
static const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};

static gpom_status_t begin(gpom_map_t **map)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = gpom_params_indoor;
    config.beam_max = BEAM_MAX;
    config.keep_m = 0.05f;  /* a return this near to a known one is not kept again */
    config.clear_scans = 3; /* so many scans that see through a hit clear it */
    config.lowres_cell_m = cell_m;
    config.lowres_nx = CELLS;
    config.lowres_ny = CELLS;
    config.lowres_rolling = 1; /* the window follows the robot */
    return gpom_map_init(map, &config, map_memory, sizeof map_memory);
}

static gpom_status_t insert(gpom_map_t *map, const gpom_pose_t *pose, int64_t stamp_us,
                            const float *ranges_m)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = 10.0f;
    const gpom_scan_t scan = {stamp_us, -1.5, 0.05, ranges_m, RANGES}; /* us, rad, rad */
    return gpom_scan_insert(map, &scan, &sensor, pose);
}

/* How far cells are free from the robot along a direction, a unit vector. */
static double free_ahead_m(const gpom_map_t *map, const gpom_pose_t *pose, double dir_x,
                           double dir_y)
{
    double free_m = 0.0;
    for (double d_m = 0.5 * cell_m; d_m < ahead_max_m; d_m += 0.5 * cell_m) {
        const gpom_point_t point = {pose->x_m + d_m * dir_x, pose->y_m + d_m * dir_y};
        gpom_cell_t cell;
        if (gpom_lowres_at(map, GPOM_LAYER_COARSE, &point, &cell) != GPOM_OK ||
            cell.cls != GPOM_FREE) {
            break; /* unsure and unknown are not free */
        }
        free_m = d_m;
    }
    return free_m;
}

/* One control period. The budget bounds its time: count operations on your processor once. */
static gpom_status_t turn(gpom_map_t *map, gpom_pose_t *pose)
{
    static float ranges_m[RANGES];
    int64_t stamp_us = 0;
    if (board_scan_read(pose, &stamp_us, ranges_m)) {
        const gpom_status_t status = insert(map, pose, stamp_us, ranges_m);
        if (status != GPOM_OK) {
            return status;
        }
    }
    const uint64_t budget = 2 * GPOM_STEP_OPS_MIN(NEIGHBOURS);
    uint64_t used;
    return gpom_map_step(map, budget, &scratch, &used);
}

int main(void)
{
    gpom_map_t *map;
    gpom_pose_t pose = {0.0, 0.0, 0.0, NULL};
    gpom_status_t status = begin(&map);
    while (status == GPOM_OK) {
        board_drive(free_ahead_m(map, &pose, 1.0, 0.0)); /* this robot always looks along x */
        board_wait();
        status = turn(map, &pose);
    }
    board_stop(gpom_status_str(status)); /* memory too small for the map, say */
    return 1;
}
