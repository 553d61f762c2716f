/* The image that measures what calls cost on a Cortex-M. icount_plugin.c counts the instructions of
 * its intervals.
 *
 * The scans of a street go into a live map with a low-resolution map of 32 x 32 cells. After each
 * scan all work on the map is done. Then points are queried, with 8 + 8 and with 16 + 16
 * neighbours, with the street preset and with the default hyperparameters. Last, a scan is aligned
 * in a room. Each interval prints "count NAME UNITS".
 */
#include "gpom/presets/street.h"
#include "ports/cortex_m/device_limits.h"
#include "ports/cortex_m/semihosting.h"
#include "ports/mavlink/messages.h"
#include "street.h"

enum {
    MANY = 16,         /* neighbours of each kind */
    POINTS = 100,      /* of a query */
    ALIGN_RANGES = 180 /* of a scan that is aligned */
};

static uint64_t map_memory[(GPOM_MAP_BYTES(DEVICE_BEAM_MAX, DEVICE_NX *DEVICE_NY) + 7) / 8];
/* For queries and for the alignment, which needs more. */
static uint8_t scratch_memory[GPOM_ALIGN_BYTES(ALIGN_RANGES)];
_Static_assert(sizeof scratch_memory >= GPOM_SCRATCH_BYTES(2 * MANY, 1), "scratch is too small");
static const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};
static gpom_answer_t answers[POINTS];

static void print_count(const char *name, uint32_t n)
{
    semihosting_write("count ");
    semihosting_write(name);
    semihosting_write(" ");
    semihosting_write_u32(n);
    semihosting_write("\n");
}

static void require(gpom_status_t status)
{
    if (status != GPOM_OK) {
        semihosting_write("stopped: ");
        semihosting_write(gpom_status_str(status));
        semihosting_write("\n");
        semihosting_exit(1);
    }
}

static gpom_map_t *make_map(const gpom_params_t *params, uint16_t n_each)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.beam_max = DEVICE_BEAM_MAX;
    config.params = *params;
    config.params.n_hits = config.params.n_free = n_each;
    config.keep_m = 0.1f;
    config.clear_scans = 3;
    config.lowres_nx = DEVICE_NX;
    config.lowres_ny = DEVICE_NY;
    config.lowres_cell_m = DEVICE_CELL_M;
    config.lowres_x0_m = DEVICE_X0_M;
    config.lowres_y0_m = DEVICE_Y0_M;
    gpom_map_t *map;
    require(gpom_map_init(&map, &config, map_memory, sizeof map_memory));
    return map;
}

static void insert_scan(gpom_map_t *map, int i_scan, const char *name)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = street_range_max_m;
    const double *const at = street_poses[i_scan];
    const gpom_pose_t pose = {at[0], at[1], at[2], NULL};
    const gpom_scan_t scan = {2000000 * (int64_t)i_scan, street_angle_min_rad,
                              street_angle_step_rad, street_ranges_m[i_scan], STREET_RANGES};
    gpom_count_begin();
    const gpom_status_t status = gpom_scan_insert(map, &scan, &sensor, &pose);
    gpom_count_end();
    print_count(name, 1);
    require(status);
}

/* Do all work that is left, in slices of the least budget. */
static void step(gpom_map_t *map, uint32_t n_points)
{
    uint64_t n_used;
    do {
        gpom_count_begin();
        const gpom_status_t status =
            gpom_map_step(map, GPOM_STEP_OPS_MIN(n_points), &scratch, &n_used);
        gpom_count_end();
        print_count("step", 1);
        require(status);
    } while (n_used > 0);
}

static uint32_t dirty_cells(const gpom_map_t *map)
{
    gpom_lowres_info_t info;
    require(gpom_lowres_info(map, GPOM_LAYER_COARSE, &info));
    return info.n_dirty;
}

/* Measure the round over all cells that follows a change. Before it, trees are built and dirty
 * cells are evaluated, so that only the round is measured. */
static void refresh(gpom_map_t *map, uint32_t n_points, const char *name)
{
    uint64_t n_used;
    require(gpom_map_build(map));
    while (dirty_cells(map) > 0) {
        require(gpom_map_step(map, GPOM_LOWRES_BATCH_OPS(n_points), &scratch, &n_used));
    }
    gpom_count_begin();
    gpom_status_t status;
    do {
        status = gpom_map_step(map, GPOM_LOWRES_BATCH_OPS(n_points), &scratch, &n_used);
    } while (status == GPOM_OK && n_used > 0);
    gpom_count_end();
    print_count(name, DEVICE_NX * DEVICE_NY);
    require(status);
}

static void query(const gpom_map_t *map, const char *name)
{
    gpom_count_begin();
    const gpom_status_t status = gpom_query_points(map, street_points, POINTS, answers, &scratch);
    gpom_count_end();
    print_count(name, POINTS);
    require(status);
}

/* What an autopilot is sent: sectors about the last pose, and the message of them. */
static void send_distances(const gpom_map_t *map)
{
    static gpom_sector_t sectors[GPOM_MAVLINK_SECTORS_MAX];
    static gpom_mavlink_obstacles_t obstacles;
    static uint8_t bytes[GPOM_MAVLINK_BYTES];
    gpom_mavlink_sender_t sender = {1, GPOM_MAVLINK_COMPONENT_ID, 0};
    const double *const at = street_poses[STREET_SCANS - 1];
    const gpom_lookout_t lookout = {at[0], at[1], at[2], DEVICE_MAVLINK_RANGE_M, 0.5f};
    gpom_count_begin();
    const gpom_status_t status =
        gpom_sectors(map, &lookout, sectors, GPOM_MAVLINK_SECTORS_MAX, NULL);
    gpom_count_end();
    print_count("mavlink_sectors", GPOM_MAVLINK_SECTORS_MAX);
    require(status);
    gpom_count_begin();
    gpom_mavlink_obstacles_init(&obstacles, GPOM_MAVLINK_SECTORS_MAX, DEVICE_MAVLINK_RANGE_M);
    gpom_mavlink_set_sectors(&obstacles, sectors);
    const size_t n_bytes = gpom_mavlink_obstacle_distance(&sender, &obstacles, bytes);
    gpom_count_end();
    print_count("mavlink_message", (uint32_t)n_bytes);
}

/* Range in a room of 8 m x 6 m around (0, 0), along a unit direction. */
static float room_range_m(double x_m, double y_m, double c, double s)
{
    const double along_x_m = c > 0.0 ? (4.0 - x_m) / c : c < 0.0 ? (-4.0 - x_m) / c : 1e9;
    const double along_y_m = s > 0.0 ? (3.0 - y_m) / s : s < 0.0 ? (-3.0 - y_m) / s : 1e9;
    return (float)(along_x_m < along_y_m ? along_x_m : along_y_m);
}

/* A full turn of ALIGN_RANGES from a pose with yaw 0. */
static gpom_scan_t room_scan(double x_m, double y_m)
{
    static float ranges_m[ALIGN_RANGES];
    const double step_rad = 6.283185307179586 / ALIGN_RANGES;
    double c = 1.0, s = 0.0; /* turned by one step each time; sine and cosine of 2 degrees */
    for (int i = 0; i < ALIGN_RANGES; ++i) {
        ranges_m[i] = room_range_m(x_m, y_m, c, s);
        const double c_next = c * 0.99939082701909573 - s * 0.034899496702500972;
        s = s * 0.99939082701909573 + c * 0.034899496702500972;
        c = c_next;
    }
    return (gpom_scan_t){0, 0.0, step_rad, ranges_m, ALIGN_RANGES};
}

/* Align a scan in a map of two scans of a room, from a pose that is off by 0.2 m and 6 degrees. */
static void align_in_room(void)
{
    gpom_map_t *const map = make_map(&gpom_params_street, 8);
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    for (int i = 0; i < 2; ++i) {
        const gpom_pose_t pose = {i, 0.5 * i, 0.0, NULL};
        const gpom_scan_t scan = room_scan(pose.x_m, pose.y_m);
        require(gpom_scan_insert(map, &scan, &sensor, &pose));
    }
    require(gpom_map_build(map));
    static const float cov[9] = {0.04f, 0, 0, 0, 0.04f, 0, 0, 0, 0.01f};
    gpom_align_config_t config;
    gpom_align_config_init(&config);
    const gpom_align_task_t task = {&sensor, {0.7, 0.1, 0.1, cov}, &config};
    const gpom_scan_t scan = room_scan(0.5, 0.2);
    gpom_alignment_t alignment;
    gpom_count_begin();
    const gpom_status_t status = gpom_scan_align(map, &scan, &task, &alignment, &scratch);
    gpom_count_end();
    print_count("align", 1);
    require(status);
    require(alignment.flags == 0 ? GPOM_OK : GPOM_ERR_REACH);
}

/* Make a map of the whole street, index it at once, and query it. */
static gpom_map_t *query_street(const gpom_params_t *params, uint16_t n_each, const char *name)
{
    gpom_map_t *const map = make_map(params, n_each);
    for (int i = 0; i < STREET_SCANS; ++i) {
        insert_scan(map, i, "insert_at_once");
    }
    gpom_count_begin();
    const gpom_status_t status = gpom_map_build(map);
    gpom_count_end();
    print_count("build", gpom_map_beam_count(map));
    require(status);
    query(map, name);
    return map;
}

int main(void)
{
    gpom_map_t *map = make_map(&gpom_params_street, 8);
    for (int i = 0; i < STREET_SCANS - 1; ++i) {
        insert_scan(map, i, "insert");
        step(map, 16);
    }
    insert_scan(map, STREET_SCANS - 1, "insert");
    refresh(map, 16, "refresh");
    query(map, "query_8+8");
    send_distances(map);
    (void)query_street(&gpom_params_street, MANY, "query_16+16");
    gpom_params_t plain; /* Matern-1/2 */
    gpom_params_init(&plain);
    map = query_street(&plain, 8, "query_plain_8+8");
    refresh(map, 16, "refresh_plain");
    (void)query_street(&plain, MANY, "query_plain_16+16");
    align_in_room();
    return 0;
}
