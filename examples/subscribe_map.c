/* Subscribe to the map with gpom's own decoder: no heap, safe on any bytes.
 * cc -I. -Iinclude examples/subscribe_map.c build/host-release/libgpom_codec.a -llcm -lm */
#include "ports/codec/codec.h"

#include <lcm/lcm.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { CELLS_MAX = 1024 * 1024, STALE_S = 1 };
static uint8_t classes[CELLS_MAX];
static gpom_wire_map_t last; /* the newest tile; its views are gone */

static int age_s(void) { return (int)(time(NULL) - last.stamp_us / 1000000); }

static int is_moved(const gpom_wire_map_t *t)
{
    const double dx_m = t->corner_m[0] - last.corner_m[0] - t->cell_m * (t->ix0 - last.ix0);
    const double dy_m = t->corner_m[1] - last.corner_m[1] - t->cell_m * (t->iy0 - last.iy0);
    return t->frame_epoch != last.frame_epoch || t->map_nx != last.map_nx ||
           t->map_ny != last.map_ny || fabs(dx_m) + fabs(dy_m) > 0.5 * t->cell_m;
}

static void take(const lcm_recv_buf_t *buffer, const char *channel, void *unused)
{
    gpom_wire_map_t t;
    if (gpom_wire_map_decode(&t, buffer->data, buffer->data_size) != GPOM_WIRE_OK ||
        (size_t)t.map_nx * t.map_ny > CELLS_MAX || t.frame_epoch < last.frame_epoch) {
        return; /* damaged, too large, or late: from before the frame jumped */
    }
    if (is_moved(&t)) { /* what was known is of no use */
        memset(classes, GPOM_WIRE_UNKNOWN, sizeof classes);
    }
    for (size_t i = 0; i < (size_t)t.nx * t.ny; ++i) {
        const size_t at = (t.iy0 + i / t.nx) * t.map_nx + t.ix0 + i % t.nx;
        classes[at] = gpom_wire_class(t.variance_class[i]);
    }
    last = t;
    size_t n[4] = {0};
    for (size_t i = 0; i < (size_t)t.map_nx * t.map_ny; ++i) {
        ++n[classes[i]];
    }
    printf("age %d s: %zu occupied, %zu free\n", age_s(), n[GPOM_WIRE_OCCUPIED], n[0]);
}

int main(int argc, char **argv)
{
    lcm_t *const bus = lcm_create(argc > 1 ? argv[1] : NULL);
    if (bus == NULL || lcm_subscribe(bus, "GPOM_MAP", take, NULL) == NULL) {
        return 1;
    }
    for (;;) {
        if (lcm_handle_timeout(bus, 1000 * STALE_S) <= 0 || age_s() > STALE_S) {
            puts("stale: no map from a recent scan");
        }
        fflush(stdout);
    }
}
