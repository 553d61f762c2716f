/* The library in a main loop of your own: no operating system, no heap, no threads. A robot drives
 * towards a wall and stops before it. Replace what is marked "yours"; the rest is how the library
 * is used. docs/firmware.md explains each step, and builds it for a PC and for a Cortex-M4F.
 *
 * Exit code 0: the robot stopped before the wall. */
#include "gpom/gpom.h"

#include <math.h>
#include <stdbool.h>

#ifndef LANES
#define LANES GPOM_LANES_MAX /* a library for microcontrollers has one: -DLANES=1 saves memory */
#endif

/* Sizes are chosen once, at compile time. POINTS is n_hits + n_free of your hyperparameters. */
enum { BEAM_MAX = 256, N_SIDE = 24, N_RANGES = 61, POINTS = 16, PERIOD_MS = 100 };

static uint64_t map_memory[(GPOM_MAP_BYTES(BEAM_MAX, N_SIDE *N_SIDE) + 7) / 8];
static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(POINTS, LANES)];
static const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};

/* --- Yours: the sensor, the localiser, the drive ---------------------------------------------- */

static const double wall_x_m = 8.0, speed_mps = 0.5;
static const double angle_min_rad = -0.75, angle_step_rad = 0.025;
static float ranges_m[N_RANGES];
static int64_t time_us;
static double robot_x_m;
static bool is_driving = true;

static int64_t now_us(void) { return time_us; } /* yours: a timer, extended to 64 bits */

static void wait_for_scan(void) /* yours: sleep until the sensor's interrupt */
{
    time_us += 1000 * PERIOD_MS;
    robot_x_m += is_driving ? 1e-3 * PERIOD_MS * speed_mps : 0.0;
    for (int i = 0; i < N_RANGES; ++i) {
        const double bearing_rad = angle_min_rad + i * angle_step_rad;
        ranges_m[i] = (float)((wall_x_m - robot_x_m) / cos(bearing_rad));
    }
}

/* --- The library ------------------------------------------------------------------------------ */

static gpom_status_t make_map(gpom_map_t **map)
{
    gpom_config_t config;
    gpom_config_init(&config); /* documented defaults; config.params: yours, learnt */
    config.beam_max = BEAM_MAX;
    config.keep_m = 0.1f;
    config.clear_scans = 3;
    config.lowres_cell_m = 0.5;
    config.lowres_nx = config.lowres_ny = N_SIDE;
    config.lowres_rolling = 1; /* the raster follows the robot */
    return gpom_map_init(map, &config, map_memory, sizeof map_memory);
}

static gpom_status_t insert_scan(gpom_map_t *map)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = 12.0f;
    const gpom_pose_t pose = {robot_x_m, 0.0, 0.0, NULL};
    const gpom_scan_t scan = {now_us(), angle_min_rad, angle_step_rad, ranges_m, N_RANGES};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}

/* Is the next metre free for a robot of 30 cm radius? A call that fails says no. */
static bool is_way_free(const gpom_map_t *map)
{
    const gpom_point_t way[] = {{robot_x_m, 0.0}, {robot_x_m + 1.0, 0.0}};
    const gpom_path_t path = {way, 2, 0.3, 0.1, 0.5f};
    gpom_path_result_t worst;
    return gpom_path_query(map, &path, &worst, &scratch) == GPOM_OK && worst.probability < 0.5f;
}

int main(void)
{
    gpom_map_t *map;
    if (make_map(&map) != GPOM_OK) {
        return 2;
    }
    const uint64_t step_ops = GPOM_STEP_OPS_MIN(POINTS);
    for (int i_period = 0; i_period < 200 && is_driving; ++i_period) {
        uint64_t used;
        wait_for_scan();
        if (insert_scan(map) != GPOM_OK) {
            continue; /* counted in gpom_stats_t; the map is unchanged */
        }
        if (gpom_map_step(map, step_ops, &scratch, &used) != GPOM_OK) {
            return 2;
        }
        is_driving = is_way_free(map); /* yours: brake */
    }
    const double gap_m = wall_x_m - robot_x_m;
    return !is_driving && gap_m > 1.0 && gap_m < 1.7 ? 0 : 1;
}
