/* Prints what a map keeps, bit by bit, after a robot drove among posts, one of which moves, with
 * some spurious returns. Linked with libraries of several lane widths by test_lanes.py.
 *
 * usage: kept_beams BEAM_MAX DEPTH_M
 *
 * BEAM_MAX below what the drive is worth: beams are evicted. DEPTH_M: occupied depth of a hit. */
#include "gpom/gpom.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_SCANS = 120, N_RANGES = 97, N_POSTS = 40 };

typedef struct {
    double x_m, y_m, radius_m;
} post_t;

static uint64_t random_state = 1;

/* Uniform in [0, 1). Knuth's MMIX generator. */
static double uniform(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* Range at which a ray meets the nearest post; infinity: none. */
static double range_to_posts(const post_t *posts, double x_m, double y_m, double yaw_rad)
{
    double nearest_m = INFINITY;
    for (int i = 0; i < N_POSTS; ++i) {
        const double dx = posts[i].x_m - x_m;
        const double dy = posts[i].y_m - y_m;
        const double along = dx * cos(yaw_rad) + dy * sin(yaw_rad);
        const double across = dx * sin(yaw_rad) - dy * cos(yaw_rad);
        const double half2 = posts[i].radius_m * posts[i].radius_m - across * across;
        if (half2 > 0.0 && along > sqrt(half2) && along - sqrt(half2) < nearest_m) {
            nearest_m = along - sqrt(half2);
        }
    }
    return nearest_m;
}

static gpom_status_t insert_scan(gpom_map_t *map, const post_t *posts, int i_scan)
{
    static float ranges_m[N_RANGES];
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    const double step_rad = 6.28 / N_RANGES;
    const double turn_rad = 0.05 * i_scan;
    const gpom_pose_t pose = {8.0 * cos(turn_rad), 8.0 * sin(turn_rad), 3.0 * turn_rad, NULL};
    for (int i = 0; i < N_RANGES; ++i) {
        const double yaw_rad = pose.yaw_rad + i * step_rad;
        const double range_m = range_to_posts(posts, pose.x_m, pose.y_m, yaw_rad);
        ranges_m[i] = (float)(uniform() < 0.05 ? 30.0 * uniform() : range_m + 0.01 * uniform());
    }
    const gpom_scan_t scan = {50000 * (i_scan / 2), 0.0, step_rad, ranges_m, N_RANGES};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}

/* A wall at x = 105 m is hit. Later two beams come from the side: one ends beside the hit,
 * the other 1 m behind it, where the wall is if it has a depth. */
static gpom_status_t look_from_the_side(gpom_map_t *map)
{
    const float to_wall_m[] = {5.0f};
    const float from_side_m[] = {4.982f, 4.9f};
    const gpom_scan_t scans[] = {{10000000, 0.0, 0.1, to_wall_m, 1},
                                 {20000000, -0.1816, 0.1816, from_side_m, 2}};
    const gpom_pose_t poses[] = {{100.0, 100.0, 0.0, NULL}, {106.0, 105.0, -1.5707963, NULL}};
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    gpom_status_t status = GPOM_OK;
    for (int i = 0; i < 2 && status == GPOM_OK; ++i) {
        status = gpom_scan_insert(map, &scans[i], &sensor, &poses[i]);
    }
    return status;
}

static gpom_status_t drive(gpom_map_t *map)
{
    static post_t posts[N_POSTS];
    for (int i = 0; i < N_POSTS; ++i) {
        const post_t post = {40.0 * uniform() - 20.0, 40.0 * uniform() - 20.0, 0.2 + uniform()};
        posts[i] = post;
    }
    for (int i = 0; i < N_SCANS; ++i) {
        posts[0].x_m = i < N_SCANS / 2 ? 3.0 : -3.0;
        gpom_status_t status = insert_scan(map, posts, i);
        if (status == GPOM_OK && i % 10 == 9) {
            status = gpom_map_build(map);
        }
        if (status != GPOM_OK) {
            return status;
        }
    }
    return look_from_the_side(map);
}

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static void print_beams(const gpom_map_t *map)
{
    for (uint32_t i = 0; i < gpom_map_slot_count(map); ++i) {
        gpom_beam_t b;
        if (gpom_map_beam(map, i, &b) != GPOM_OK || !(b.is_hit || b.is_free)) {
            continue;
        }
        printf("slot %" PRIu32 " id %" PRIu32 " at %a %a us %" PRId64 " bits %08" PRIx32
               " %08" PRIx32 " %08" PRIx32 " is %d %d %d %d agreed %d\n",
               i, b.id, b.x_m, b.y_m, b.stamp_us, bits_of(b.dir_x), bits_of(b.dir_y),
               bits_of(b.range_m), b.is_hit, b.is_free, b.returned, b.provisional, b.n_agreed);
    }
}

static void print_counters(const gpom_map_t *map)
{
    gpom_stats_t n;
    if (gpom_map_stats(map, &n) == GPOM_OK) {
        printf("hit %" PRIu64 " no_return %" PRIu64 " known %" PRIu64 " contradicting %" PRIu64 "\n"
               "redundant %" PRIu64 " not_confirmed %" PRIu64 "\n"
               "evicted_redundant %" PRIu64 " evicted_far %" PRIu64 " evicted_old %" PRIu64
               " evicted_contradicted %" PRIu64 "\n"
               "hits_cleared %" PRIu64 " free_cleared %" PRIu64 "\n",
               n.beams_hit, n.beams_no_return, n.beams_known, n.beams_contradicting,
               n.beams_redundant, n.beams_not_confirmed, n.beams_evicted_redundant,
               n.beams_evicted_far, n.beams_evicted_old, n.beams_evicted_contradicted,
               n.hits_cleared, n.free_cleared);
    }
}

int main(int argc, char **argv)
{
    gpom_config_t config;
    gpom_map_t *map;
    gpom_config_init(&config);
    config.beam_max = argc == 3 ? (uint32_t)strtoul(argv[1], NULL, 10) : 0;
    config.params.depth_m = argc == 3 ? strtof(argv[2], NULL) : 0.0f;
    config.keep_m = 0.4f;
    config.clear_scans = 2;
    config.far_m = 15.0f;
    config.old_s = 2.0f;
    const size_t mem_bytes = gpom_map_bytes(&config);
    void *const mem = calloc(1, mem_bytes + 1);
    gpom_status_t status = gpom_map_init(&map, &config, mem, mem_bytes);
    if (status == GPOM_OK) {
        status = drive(map);
    }
    if (status != GPOM_OK) {
        fprintf(stderr, "kept_beams: %s\n", gpom_status_str(status));
        free(mem);
        return 1;
    }
    print_beams(map);
    print_counters(map);
    free(mem);
    return 0;
}
