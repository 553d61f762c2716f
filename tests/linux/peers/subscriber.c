/* A subscriber as lcm-gen makes them in C, of all that gpomd publishes: prints each message's
 * channel and, in hexadecimal, what it encodes to again. */
#include "gpom_answer_t.h"
#include "gpom_map_t.h"
#include "gpom_status_t.h"
#include "mbot_lcm_msgs_occupancy_grid_t.h"
#include "occ_map_pixel_map_t.h"

#include <stdio.h>

enum { BYTES_MAX = 1 << 20 };
static unsigned char bytes[BYTES_MAX];

static void print(const char *channel, int n_bytes)
{
    printf("%s ", channel);
    for (int i = 0; i < n_bytes; ++i) {
        printf("%02x", bytes[i]);
    }
    printf("\n");
    fflush(stdout);
}

#define TAKE(type)                                                                                 \
    static void take_##type(const lcm_recv_buf_t *buffer, const char *channel,                     \
                            const type *message, void *unused)                                     \
    {                                                                                              \
        (void)buffer;                                                                              \
        (void)unused;                                                                              \
        print(channel, type##_encode(bytes, 0, BYTES_MAX, message));                               \
    }

TAKE(gpom_map_t)
TAKE(gpom_status_t)
TAKE(gpom_answer_t)
TAKE(mbot_lcm_msgs_occupancy_grid_t)
TAKE(occ_map_pixel_map_t)

int main(int argc, char **argv)
{
    lcm_t *const bus = lcm_create(argc > 1 ? argv[1] : NULL);
    if (bus == NULL) {
        return 1;
    }
    gpom_map_t_subscribe(bus, "GPOM_MAP", take_gpom_map_t, NULL);
    gpom_status_t_subscribe(bus, "GPOM_STATUS", take_gpom_status_t, NULL);
    gpom_answer_t_subscribe(bus, "GPOM_ANSWER", take_gpom_answer_t, NULL);
    mbot_lcm_msgs_occupancy_grid_t_subscribe(bus, "SLAM_MAP", take_mbot_lcm_msgs_occupancy_grid_t,
                                             NULL);
    occ_map_pixel_map_t_subscribe(bus, "PIXEL_MAP", take_occ_map_pixel_map_t, NULL);
    while (lcm_handle(bus) == 0) {
    }
    return 1;
}
