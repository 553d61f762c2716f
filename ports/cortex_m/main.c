/* A Gaussian-process occupancy map on a bare Cortex-M. The scans of a street go in, and answers
 * come out.
 *
 * The scans, hyperparameters and points are in street.h, which is generated at build time. The
 * tests compare the printed answers with the answers of gpom-query on the host for the same files.
 */
#include "gpom/gpom.h"
#include "gpom/presets/street.h"
#include "semihosting.h"
#include "street.h"

enum {
    BEAM_MAX = STREET_SCANS * STREET_RANGES,
    POINTS = sizeof street_points / sizeof street_points[0],
    POINTS_AT_ONCE = 50
};

static uint64_t map_memory[(GPOM_MAP_BYTES(BEAM_MAX, 0) + 7) / 8];
static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(16, 1)];
static gpom_answer_t answers[POINTS_AT_ONCE];

static gpom_status_t make_map(gpom_map_t **map)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.beam_max = BEAM_MAX;
    config.params = gpom_params_street;
    return gpom_map_init(map, &config, map_memory, sizeof map_memory);
}

static gpom_status_t insert_scan(gpom_map_t *map, int i_scan)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = street_range_max_m;
    const double *const at = street_poses[i_scan];
    const gpom_pose_t pose = {at[0], at[1], at[2], NULL};
    const gpom_scan_t scan = {i_scan, street_angle_min_rad, street_angle_step_rad,
                              street_ranges_m[i_scan], STREET_RANGES};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}

static gpom_status_t insert_street(gpom_map_t *map)
{
    for (int i = 0; i < STREET_SCANS; ++i) {
        const gpom_status_t status = insert_scan(map, i);
        if (status != GPOM_OK) {
            return status;
        }
    }
    return GPOM_OK;
}

/* Print the bits of a float as a decimal number, so that no digits are lost. */
static void print_bits(float value)
{
    const union {
        float value;
        uint32_t bits;
    } same = {value};
    semihosting_write(" ");
    semihosting_write_u32(same.bits);
}

static void print_answers(uint32_t n)
{
    for (uint32_t i = 0; i < n; ++i) {
        semihosting_write("answer");
        print_bits(answers[i].mean);
        print_bits(answers[i].variance);
        print_bits(answers[i].probability);
        semihosting_write("\n");
    }
}

static gpom_status_t answer_points(const gpom_map_t *map)
{
    const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};
    for (uint32_t i = 0; i < POINTS; i += POINTS_AT_ONCE) {
        const uint32_t n = POINTS - i < POINTS_AT_ONCE ? POINTS - i : POINTS_AT_ONCE;
        const gpom_status_t status =
            gpom_query_points(map, &street_points[i], n, answers, &scratch);
        if (status != GPOM_OK) {
            return status;
        }
        print_answers(n);
    }
    return GPOM_OK;
}

int main(void)
{
    gpom_map_t *map;
    gpom_status_t status = make_map(&map);
    status = status == GPOM_OK ? insert_street(map) : status;
    status = status == GPOM_OK ? gpom_map_build(map) : status;
    status = status == GPOM_OK ? answer_points(map) : status;
    if (status != GPOM_OK) {
        semihosting_write("stopped: ");
        semihosting_write(gpom_status_str(status));
        semihosting_write("\n");
        return 1;
    }
    return 0;
}
