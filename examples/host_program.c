/* A log into a map, and answers out of it, by the C API alone:
 *
 *     cc -std=c99 -Iinclude -Ibuild/host-release/include examples/host_program.c \
 *         build/host-release/libgpom.a -lldl -lamd -lm -o build/host_program
 *     build/host_program scans.csv 12.5 30 14 30.5
 *
 * Scans are CSV, one a line: t,x,y,theta,angle_min,angle_step,range_max,r0,r1,... in s, m and rad,
 * as gpom-sim writes them. Prints for each point how likely it is occupied. */
#define _POSIX_C_SOURCE 200809L /* getline */
#include "gpom/gpom.h"
#include "gpom/presets/street.h"

#include <stdio.h>
#include <stdlib.h>

enum { HEAD = 7 }; /* numbers before the ranges */

/* One line of the log. */
typedef struct {
    double head[HEAD]; /* t, x, y, theta, angle_min, angle_step, range_max */
    float ranges_m[GPOM_RANGES_MAX];
    uint32_t n_ranges;
} log_line_t;

/* Read the numbers of a line; 0 if it has too few or something else. */
static int read_line(log_line_t *line, const char *text)
{
    line->n_ranges = 0;
    for (int i = 0; line->n_ranges < GPOM_RANGES_MAX; ++i) {
        char *end;
        const double value = strtod(text, &end); /* also nan: ignored, and inf: no return */
        if (end == text) {
            return 0;
        }
        if (i < HEAD) {
            line->head[i] = value;
        } else {
            line->ranges_m[line->n_ranges++] = (float)value;
        }
        if (*end != ',') {
            return i >= HEAD && (*end == '\n' || *end == '\0');
        }
        text = end + 1;
    }
    return 0;
}

static gpom_status_t insert(gpom_map_t *map, const log_line_t *line)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_max_m = (float)line->head[6];
    const gpom_pose_t pose = {line->head[1], line->head[2], line->head[3], NULL};
    const gpom_scan_t scan = {(int64_t)(1e6 * line->head[0]), line->head[4], line->head[5],
                              line->ranges_m, line->n_ranges};
    return gpom_scan_insert(map, &scan, &sensor, &pose);
}

/* All scans of a file; 0 on success, else it has said why. */
static int insert_log(gpom_map_t *map, const char *path)
{
    static log_line_t line;
    FILE *const file = fopen(path, "r");
    if (file == NULL) {
        perror(path);
        return 2;
    }
    char *text = NULL;
    size_t text_bytes = 0;
    int n_lines = 0, failed = 0;
    while (!failed && getline(&text, &text_bytes, file) > 0) {
        ++n_lines;
        if (text[0] == '#') {
            continue;
        }
        const gpom_status_t status = read_line(&line, text) ? insert(map, &line) : GPOM_ERR_FORMAT;
        if (status != GPOM_OK) {
            fprintf(stderr, "%s:%d: %s\n", path, n_lines, gpom_status_str(status));
            failed = 2;
        }
    }
    free(text);
    fclose(file);
    return failed;
}

/* A map in memory that is taken once; NULL if that cannot be. */
static gpom_map_t *make_map(void)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = gpom_params_street;
    config.beam_max = 100000;
    void *const memory = malloc(gpom_map_bytes(&config));
    gpom_map_t *map;
    if (gpom_map_init(&map, &config, memory, gpom_map_bytes(&config)) != GPOM_OK) {
        free(memory);
        return NULL;
    }
    return map; /* at the beginning of its memory; it lives as long as the program */
}

static int print_answer(const gpom_map_t *map, double x_m, double y_m)
{
    static uint8_t scratch_memory[GPOM_SCRATCH_BYTES(16, GPOM_LANES_MAX)];
    static const char *const words[] = {"free", "unsure", "occupied"};
    const gpom_scratch_t scratch = {scratch_memory, sizeof scratch_memory};
    const gpom_point_t point = {x_m, y_m};
    gpom_answer_t answer;
    const gpom_status_t status = gpom_query_points(map, &point, 1, &answer, &scratch);
    if (status != GPOM_OK) {
        fprintf(stderr, "%g %g: %s\n", x_m, y_m, gpom_status_str(status));
        return 1;
    }
    printf("%g %g: p = %.3f, variance %.3f, %s\n", x_m, y_m, (double)answer.probability,
           (double)answer.variance, words[answer.cls]);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc < 4 || argc % 2 != 0) {
        fprintf(stderr, "usage: host_program SCANS.csv X Y [X Y]...\n");
        return 2;
    }
    gpom_map_t *const map = make_map();
    if (map == NULL || insert_log(map, argv[1]) != 0) {
        return 2;
    }
    int failed = gpom_map_build(map) != GPOM_OK; /* makes queries fast; answers stay the same */
    for (int i = 2; i < argc; i += 2) {
        failed |= print_answer(map, strtod(argv[i], NULL), strtod(argv[i + 1], NULL));
    }
    return failed;
}
