#include "ports/can/examples/stop.h"

/* Forget what earlier frames said. The decision is "stop" until n_good_min frames in a row were
 * right. */
static void distrust(gpom_stop_t *stop)
{
    stop->n_good = 0;
    for (size_t i = 0; i < GPOM_CAN_CLEARANCE_FRAMES; ++i) {
        stop->parts[i].is_free = false;
    }
}

static unsigned watched_sectors(const gpom_stop_t *stop, size_t i_part)
{
    const unsigned of_part = (1u << GPOM_CAN_SECTORS_IN_FRAME) - 1u;
    return ((unsigned)stop->config.sectors >> (GPOM_CAN_SECTORS_IN_FRAME * i_part)) & of_part;
}

/* True if the map is fresh and all watched sectors of this part are free up to distance_min. */
static bool is_free(const gpom_stop_t *stop, const gpom_can_clearance_t *frame)
{
    const unsigned watched = watched_sectors(stop, frame->i_part);
    bool is_free = frame->state == GPOM_CAN_MAPPING;
    for (size_t i = 0; i < GPOM_CAN_SECTORS_IN_FRAME; ++i) {
        const uint8_t distance = frame->distance[i];
        const bool is_far =
            distance != GPOM_CAN_DISTANCE_UNKNOWN && distance >= stop->config.distance_min;
        is_free = is_free && (is_far || ((watched >> i) & 1u) == 0);
    }
    return is_free;
}

static bool is_next(const gpom_stop_t *stop, uint8_t alive)
{
    const unsigned step = gpom_can_alive_step(stop->alive, alive);
    return !stop->has_alive || (step >= 1u && step <= 1u + stop->config.n_missing_max);
}

void gpom_stop_init(gpom_stop_t *stop, const gpom_stop_config_t *config)
{
    stop->config = *config;
    stop->has_alive = false;
    stop->alive = 0;
    for (size_t i = 0; i < GPOM_CAN_CLEARANCE_FRAMES; ++i) {
        stop->parts[i].came_ms = 0;
    }
    distrust(stop);
}

void gpom_stop_on_frame(gpom_stop_t *stop, const uint8_t *bytes, size_t n_bytes, uint32_t now_ms)
{
    gpom_can_clearance_t frame;
    if (gpom_can_clearance_unpack(&frame, bytes, n_bytes) != GPOM_CAN_OK) {
        distrust(stop);
        return;
    }
    if (!is_next(stop, frame.alive)) {
        distrust(stop);
    } else if (stop->n_good < stop->config.n_good_min) {
        ++stop->n_good;
    }
    stop->has_alive = true;
    stop->alive = frame.alive;
    stop->parts[frame.i_part].is_free = stop->n_good > 0 && is_free(stop, &frame);
    stop->parts[frame.i_part].came_ms = now_ms;
}

bool gpom_stop_may_go(gpom_stop_t *stop, uint32_t now_ms)
{
    bool may_go =
        stop->config.sectors != 0 && stop->n_good > 0 && stop->n_good >= stop->config.n_good_min;
    for (size_t i = 0; i < GPOM_CAN_CLEARANCE_FRAMES; ++i) {
        if (now_ms - stop->parts[i].came_ms > stop->config.timeout_ms) {
            stop->parts[i].is_free = false;
        }
        may_go = may_go && (stop->parts[i].is_free || watched_sectors(stop, i) == 0);
    }
    return may_go;
}
