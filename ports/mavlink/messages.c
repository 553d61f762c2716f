#include "ports/mavlink/messages.h"

/* Without signatures, the generated code needs no SHA-256. */
#define MAVLINK_NO_SIGN_PACKET
#define MAVLINK_NO_SIGNATURE_CHECK
#include <common/mavlink.h>

bool gpom_mavlink_is_sector_count(uint32_t n_sectors)
{
    return n_sectors >= GPOM_MAVLINK_SECTORS_MIN && n_sectors <= GPOM_MAVLINK_SECTORS_MAX &&
           360u % n_sectors == 0;
}

void gpom_mavlink_obstacles_init(gpom_mavlink_obstacles_t *obstacles, uint32_t n_sectors,
                                 float range_m)
{
    const bool is_range = range_m >= 0.01f && range_m <= (float)GPOM_MAVLINK_RANGE_MAX_M;
    obstacles->stamp_us = 0;
    for (uint32_t i = 0; i < GPOM_MAVLINK_SECTORS_MAX; ++i) {
        obstacles->distance_cm[i] = GPOM_MAVLINK_NO_READING;
    }
    obstacles->n_sectors =
        gpom_mavlink_is_sector_count(n_sectors) && is_range ? (uint8_t)n_sectors : 0;
    obstacles->range_cm = is_range ? (uint16_t)(100.0f * range_m) : 0;
    obstacles->sensor = GPOM_MAVLINK_LASER;
}

/* Half the width of ArduPilot's sector in front [degrees]. */
#define FRONT_DEG 22.5f

static uint32_t width_deg(uint32_t n_sectors) { return 360u / n_sectors; }

/* Number of elements before the one about forward. ArduPilot (AP_Proximity_MAV.cpp) has eight
 * sectors. Of each it keeps the least distance of elements that follow each other; elements that
 * come later in the message replace it. So the message begins with the first element in ArduPilot's
 * sector in front. */
static uint32_t elements_before(uint32_t n_sectors)
{
    return (uint32_t)(FRONT_DEG / (float)width_deg(n_sectors));
}

static uint16_t reading_of(const gpom_sector_t *sector, uint16_t range_cm)
{
    const float distance_cm = 100.0f * sector->distance_m;
    if ((sector->flags & GPOM_SECTOR_UNKNOWN) != 0) {
        return GPOM_MAVLINK_NO_READING;
    }
    if (sector->cls == GPOM_FREE) {
        return (uint16_t)(range_cm + 1u);
    }
    if (!(distance_cm < (float)range_cm + 1.0f)) {
        return GPOM_MAVLINK_NO_READING;
    }
    return distance_cm >= (float)GPOM_MAVLINK_CM_MIN ? (uint16_t)distance_cm
                                                     : (uint16_t)GPOM_MAVLINK_CM_MIN;
}

/* Sectors count counter-clockwise, elements clockwise. */
void gpom_mavlink_set_sectors(gpom_mavlink_obstacles_t *obstacles, const gpom_sector_t *sectors)
{
    const uint32_t n = obstacles->n_sectors;
    for (uint32_t i = 0; i < n; ++i) {
        obstacles->distance_cm[(n - i + elements_before(n)) % n] =
            reading_of(&sectors[i], obstacles->range_cm);
    }
}

/* Copy a finished message, and take over the number of the next one. */
static size_t finish(gpom_mavlink_sender_t *sender, const mavlink_status_t *status,
                     const mavlink_message_t *message, uint8_t *bytes)
{
    sender->sequence = status->current_tx_seq;
    return mavlink_msg_to_send_buffer(bytes, message);
}

size_t gpom_mavlink_heartbeat(gpom_mavlink_sender_t *sender, gpom_mavlink_state_t state,
                              uint8_t *bytes)
{
    mavlink_status_t status = {.current_tx_seq = sender->sequence};
    mavlink_message_t message;
    mavlink_msg_heartbeat_pack_status(sender->system_id, sender->component_id, &status, &message,
                                      MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, 0, 0,
                                      (uint8_t)state);
    return finish(sender, &status, &message, bytes);
}

size_t gpom_mavlink_obstacle_distance(gpom_mavlink_sender_t *sender,
                                      const gpom_mavlink_obstacles_t *obstacles, uint8_t *bytes)
{
    const uint32_t n = obstacles->n_sectors > 0 ? obstacles->n_sectors : GPOM_MAVLINK_SECTORS_MAX;
    const float width = (float)width_deg(n);
    const uint64_t stamp_us = obstacles->stamp_us > 0 ? (uint64_t)obstacles->stamp_us : 0;
    mavlink_status_t status = {.current_tx_seq = sender->sequence};
    mavlink_message_t message;
    mavlink_msg_obstacle_distance_pack_status(
        sender->system_id, sender->component_id, &status, &message, stamp_us, obstacles->sensor,
        obstacles->distance_cm, (uint8_t)width_deg(n), GPOM_MAVLINK_CM_MIN, obstacles->range_cm,
        width, 0.0f - width * (float)elements_before(n), MAV_FRAME_BODY_FRD);
    return finish(sender, &status, &message, bytes);
}
