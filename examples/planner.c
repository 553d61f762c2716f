/* A planner on the low-resolution map: the shortest way through free cells, and where to explore
 * next.
 *
 *     cc -std=c99 -Iinclude -Ibuild/host-release/include examples/planner.c \
 *         build/host-release/libgpom.a -lldl -lamd -lm -o build/planner && build/planner
 *
 * Two rooms, a door between them and a door to the outside; the robot has looked about in both.
 * Prints the map: # occupied, . free, ? unsure, blank unknown, * the way. */
#include "gpom/gpom.h"
#include "gpom/presets/indoor.h"

#include <math.h>
#include <stdio.h>

enum { NX = 56, NY = 36, CELL_COUNT = NX * NY, RANGES = 360, BEAM_MAX = 4096, NEIGHBOURS = 16 };
static const double cell_m = 0.25;

static uint64_t map_memory[(GPOM_MAP_BYTES(BEAM_MAX, CELL_COUNT) + 7) / 8];
static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(NEIGHBOURS, GPOM_LANES_MAX)];
static const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};

/* ---- a world to scan ------------------------------------------------------------------------- */

typedef struct {
    double x0_m, y0_m, x1_m, y1_m;
} wall_t;

static const wall_t walls[] = {
    {1, 1, 13, 1}, {1, 8, 13, 8},  {1, 1, 1, 8}, {13, 1, 13, 3}, {13, 4.5, 13, 8}, /* outside */
    {7, 1, 7, 5},  {7, 6.5, 7, 8},                                                 /* between */
};

/* Distance to a wall along a ray; INFINITY if it misses. */
static double hit_m(const wall_t *w, double x_m, double y_m, double dx, double dy)
{
    const double ex = w->x1_m - w->x0_m, ey = w->y1_m - w->y0_m;
    const double cross = dx * ey - dy * ex;
    const double along = ((w->x0_m - x_m) * ey - (w->y0_m - y_m) * ex) / cross;
    const double across = ((w->x0_m - x_m) * dy - (w->y0_m - y_m) * dx) / cross;
    return along > 0 && across >= 0 && across <= 1 ? along : (double)INFINITY;
}

static gpom_status_t look_about(gpom_map_t *map, int64_t stamp_us, double x_m, double y_m)
{
    static float ranges_m[RANGES];
    const double step_rad = 2 * 3.14159265 / RANGES;
    for (int i = 0; i < RANGES; ++i) {
        double nearest_m = (double)INFINITY; /* no return */
        for (size_t k = 0; k < sizeof walls / sizeof walls[0]; ++k) {
            nearest_m =
                fmin(nearest_m, hit_m(&walls[k], x_m, y_m, cos(i * step_rad), sin(i * step_rad)));
        }
        ranges_m[i] = (float)nearest_m;
    }
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = 10.0f;
    const gpom_pose_t pose = {x_m, y_m, 0.0, NULL};
    const gpom_scan_t scan = {stamp_us, 0.0, step_rad, ranges_m, RANGES};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}

/* ---- the map --------------------------------------------------------------------------------- */

static gpom_status_t begin(gpom_map_t **map)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = gpom_params_indoor;
    config.beam_max = BEAM_MAX;
    config.keep_m = 0.05f;
    config.clear_scans = 3;
    config.lowres_cell_m = cell_m;
    config.lowres_nx = NX;
    config.lowres_ny = NY;
    return gpom_map_init(map, &config, map_memory, sizeof map_memory);
}

/* A robot takes a slice in each control period; here all of the work is done at once. */
static gpom_status_t finish(gpom_map_t *map)
{
    uint64_t used = 1;
    gpom_status_t status = GPOM_OK;
    while (status == GPOM_OK && used > 0) {
        status = gpom_map_step(map, GPOM_STEP_OPS_MIN(NEIGHBOURS), &scratch, &used);
    }
    return status;
}

/* ---- the way --------------------------------------------------------------------------------- */

static gpom_cell_t cells[CELL_COUNT];
static int steps_to_goal[CELL_COUNT]; /* -1: no way is known */
static int queue[CELL_COUNT];

static int cell_at(double x_m, double y_m)
{
    return (int)(y_m / cell_m) * NX + (int)(x_m / cell_m); /* the raster begins at 0, 0 */
}

/* The neighbour in one of four directions; -1 beyond the raster. */
static int neighbour(int cell, int direction)
{
    const int ix = cell % NX + (direction == 0) - (direction == 1);
    const int iy = cell / NX + (direction == 2) - (direction == 3);
    return ix < 0 || ix >= NX || iy < 0 || iy >= NY ? -1 : iy * NX + ix;
}

/* Free, and so are the cells about it: the robot is wider than a cell. */
static int is_drivable(int cell)
{
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const int ix = cell % NX + dx, iy = cell / NX + dy;
            if (ix < 0 || ix >= NX || iy < 0 || iy >= NY || cells[iy * NX + ix].cls != GPOM_FREE) {
                return 0;
            }
        }
    }
    return 1;
}

/* Breadth first from the goal: how many steps is each drivable cell away from it? */
static void measure_steps_to(int goal)
{
    for (int i = 0; i < CELL_COUNT; ++i) {
        steps_to_goal[i] = -1;
    }
    int n_queued = 0;
    steps_to_goal[goal] = 0;
    queue[n_queued++] = goal;
    for (int i = 0; i < n_queued; ++i) {
        for (int direction = 0; direction < 4; ++direction) {
            const int next = neighbour(queue[i], direction);
            if (next >= 0 && steps_to_goal[next] < 0 && is_drivable(next)) {
                steps_to_goal[next] = steps_to_goal[queue[i]] + 1;
                queue[n_queued++] = next;
            }
        }
    }
}

/* Mark the way from a cell, downhill, and return how many steps it has; -1: there is none. */
static int mark_way(char *picture, int cell)
{
    const int n_steps = steps_to_goal[cell];
    while (steps_to_goal[cell] > 0) {
        picture[cell] = '*';
        for (int direction = 0; direction < 4; ++direction) {
            const int next = neighbour(cell, direction);
            if (next >= 0 && steps_to_goal[next] == steps_to_goal[cell] - 1) {
                cell = next;
                break;
            }
        }
    }
    return n_steps;
}

/* ---- what is printed ------------------------------------------------------------------------- */

static void print_way(int start, int goal)
{
    static char picture[CELL_COUNT];
    static const char signs[] = {'.', '?', '#', ' '}; /* by gpom_class_t */
    for (int i = 0; i < CELL_COUNT; ++i) {
        picture[i] = signs[cells[i].cls];
    }
    measure_steps_to(goal);
    const int n_steps = mark_way(picture, start);
    for (int iy = NY - 1; iy >= 0; --iy) {
        printf("%.*s\n", NX, &picture[iy * NX]);
    }
    if (n_steps < 0) {
        puts("no way through free cells");
    } else {
        printf("way of %d steps, %.2f m\n", n_steps, n_steps * cell_m);
    }
}

/* Where does the map know least, of all places that the robot can reach? */
static gpom_status_t print_frontier(const gpom_map_t *map, const gpom_point_t *from)
{
    static uint8_t memory[GPOM_EXPLORE_BYTES(NX, NY)];
    const gpom_scratch_t explore_scratch = {memory, sizeof memory};
    gpom_goal_t goal;
    gpom_goals_t goals = {&goal, 1, 0};
    const gpom_status_t status = gpom_explore(map, from, &goals, &explore_scratch);
    if (status == GPOM_OK && goals.n_goals > 0) {
        printf("explore next: %.2f %.2f, %u steps away\n", (goal.ix + 0.5) * cell_m,
               (goal.iy + 0.5) * cell_m, (unsigned)goal.n_steps);
    }
    return status;
}

int main(void)
{
    const gpom_point_t start = {3.0, 3.0}, goal = {11.0, 6.0};
    gpom_map_t *map;
    gpom_lowres_info_t info;
    gpom_status_t status = begin(&map);
    status = status == GPOM_OK ? look_about(map, 100000, start.x_m, start.y_m) : status;
    status = status == GPOM_OK ? look_about(map, 200000, 6.0, 5.5) : status;
    status = status == GPOM_OK ? look_about(map, 300000, 9.0, 4.0) : status;
    status = status == GPOM_OK ? finish(map) : status;
    /* May run in another thread than the rest: it takes no lock. */
    status = status == GPOM_OK ? gpom_lowres_copy(map, GPOM_LAYER_COARSE, cells, CELL_COUNT, &info)
                               : status;
    if (status == GPOM_OK) {
        print_way(cell_at(start.x_m, start.y_m), cell_at(goal.x_m, goal.y_m));
        status = print_frontier(map, &start);
    }
    if (status != GPOM_OK) {
        fprintf(stderr, "planner: %s\n", gpom_status_str(status));
    }
    return status == GPOM_OK ? 0 : 1;
}
