/* A board for examples/bare_main_loop.c: a robot in a corridor 2 m wide that ends at x = 4 m, which
 * drives towards the end as far as it is told to, and prints that. Ends after 80 turns. */
#include "ports/cortex_m/semihosting.h"

#include "gpom/gpom.h"

#include <math.h>

enum { RANGES = 60, TURNS = 80, TURNS_PER_SCAN = 3 };
static const double wall_m = 4.0;
static const double half_width_m = 1.0;
static const double step_m = 0.05;   /* a turn's way */
static const double margin_m = 0.75; /* kept before what is not free */
static double robot_m;
static int i_turn;

int board_scan_read(gpom_pose_t *pose, int64_t *stamp_us, float ranges_m[RANGES]);
void board_drive(double free_m);
void board_stop(const char *why);
void board_wait(void);

int board_scan_read(gpom_pose_t *pose, int64_t *stamp_us, float ranges_m[RANGES])
{
    pose->x_m = robot_m;
    *stamp_us = (int64_t)100000 * (i_turn + 1);
    for (int i = 0; i < RANGES; ++i) {
        const double bearing_rad = -1.5 + 0.05 * i;
        const double to_end_m = (wall_m - robot_m) / cos(bearing_rad);
        const double to_side_m = half_width_m / fabs(sin(bearing_rad));
        ranges_m[i] = (float)(to_end_m < to_side_m ? to_end_m : to_side_m);
    }
    return i_turn % TURNS_PER_SCAN == 0;
}

void board_drive(double free_m)
{
    semihosting_write("at ");
    semihosting_write_u32((uint32_t)(1000.0 * robot_m));
    semihosting_write(" free ");
    semihosting_write_u32((uint32_t)(1000.0 * free_m));
    semihosting_write("\n");
    if (free_m > margin_m) {
        robot_m += step_m;
    }
}

void board_stop(const char *why)
{
    semihosting_write("stopped: ");
    semihosting_write(why);
    semihosting_write("\n");
    semihosting_exit(1);
}

void board_wait(void)
{
    if (++i_turn == TURNS) {
        semihosting_exit(0);
    }
}
