#include "ports/mavlink/device.h"

#include <string.h>

#define HEARTBEAT_PERIOD_US 1000000

void gpom_mavlink_device_config_init(gpom_mavlink_device_config_t *config)
{
    memset(config, 0, sizeof *config);
    config->system_id = 1;
    config->component_id = GPOM_MAVLINK_COMPONENT_ID;
    config->sensor = GPOM_MAVLINK_LASER;
    config->n_sectors = GPOM_MAVLINK_SECTORS_MAX;
    config->range_m = 25.0f;
    config->radius_m = 0.5f;
    config->period_us = 100000;
}

/* Written so that NaN is refused. */
static bool is_good(const gpom_mavlink_device_config_t *config)
{
    const bool is_range = config->range_m >= 0.01f &&
                          config->range_m <= (float)GPOM_MAVLINK_RANGE_MAX_M &&
                          config->radius_m >= 0.0f && config->radius_m < config->range_m;
    return is_range && config->bytes_write != NULL && config->system_id != 0 &&
           config->component_id != 0 && config->sensor <= GPOM_MAVLINK_UNKNOWN_SENSOR &&
           config->period_us > 0 && gpom_mavlink_is_sector_count(config->n_sectors);
}

gpom_status_t gpom_mavlink_device_init(gpom_mavlink_device_t *mavlink,
                                       const gpom_mavlink_device_config_t *config)
{
    if (mavlink == NULL || config == NULL || !is_good(config)) {
        return GPOM_ERR_ARG;
    }
    memset(mavlink, 0, sizeof *mavlink);
    mavlink->config = *config;
    mavlink->sender.system_id = config->system_id;
    mavlink->sender.component_id = config->component_id;
    return GPOM_OK;
}

static gpom_mavlink_state_t state_of(const gpom_device_t *device, int64_t now_us)
{
    switch (gpom_device_state(device, now_us)) {
    case GPOM_WIRE_STATE_STARTING:
        return GPOM_MAVLINK_STARTING;
    case GPOM_WIRE_STATE_MAPPING:
        return GPOM_MAVLINK_MAPPING;
    default:
        return GPOM_MAVLINK_STALE;
    }
}

/* Write how far all is free about the place of the newest scan. If the map is stale, no sector has
 * a reading. */
static size_t write_obstacles(gpom_mavlink_device_t *mavlink, const gpom_device_t *device,
                              int64_t now_us)
{
    const gpom_mavlink_device_config_t *const config = &mavlink->config;
    const gpom_lookout_t lookout = {device->pose[0], device->pose[1], device->pose[2],
                                    config->range_m, config->radius_m};
    gpom_mavlink_obstacles_init(&mavlink->obstacles, config->n_sectors, config->range_m);
    mavlink->obstacles.stamp_us = device->stamp_us;
    mavlink->obstacles.sensor = config->sensor;
    if (gpom_device_state(device, now_us) == GPOM_WIRE_STATE_MAPPING &&
        gpom_sectors(device->map, &lookout, mavlink->sectors, config->n_sectors, NULL) == GPOM_OK) {
        gpom_mavlink_set_sectors(&mavlink->obstacles, mavlink->sectors);
    }
    return gpom_mavlink_obstacle_distance(&mavlink->sender, &mavlink->obstacles, mavlink->bytes);
}

/* True if it is time for a message. Counts those whose whole period passed without. */
static bool has_come(gpom_mavlink_device_t *mavlink, int64_t *due_us, int64_t period_us,
                     int64_t now_us)
{
    if (now_us < *due_us) {
        return false;
    }
    const int64_t n_missed = (now_us - *due_us) / period_us;
    mavlink->n_not_sent += (uint64_t)n_missed;
    *due_us += (n_missed + 1) * period_us;
    return true;
}

/* Begin the next message that is due, if the line has taken the one before. Heartbeats come first,
 * because they are rare. */
static void begin_message(gpom_mavlink_device_t *mavlink, const gpom_device_t *device,
                          int64_t now_us)
{
    size_t n_bytes = 0;
    if (mavlink->i_byte < mavlink->n_bytes) {
        return;
    }
    if (has_come(mavlink, &mavlink->heartbeat_due_us, HEARTBEAT_PERIOD_US, now_us)) {
        n_bytes =
            gpom_mavlink_heartbeat(&mavlink->sender, state_of(device, now_us), mavlink->bytes);
    } else if (has_come(mavlink, &mavlink->obstacles_due_us, mavlink->config.period_us, now_us)) {
        n_bytes = write_obstacles(mavlink, device, now_us);
    }
    mavlink->n_sent += n_bytes > 0 ? 1 : 0;
    mavlink->n_bytes = (uint32_t)n_bytes;
    mavlink->i_byte = 0;
}

bool gpom_mavlink_device_tick(gpom_mavlink_device_t *mavlink, const gpom_device_t *device)
{
    const int64_t now_us = device->port.now_us(device->port.ctx);
    if (!mavlink->is_begun) {
        mavlink->is_begun = true;
        mavlink->obstacles_due_us = mavlink->heartbeat_due_us = now_us;
    }
    begin_message(mavlink, device, now_us);
    const uint32_t n_left = mavlink->n_bytes - mavlink->i_byte;
    if (n_left > 0) {
        mavlink->i_byte += (uint32_t)mavlink->config.bytes_write(
            mavlink->config.ctx, mavlink->bytes + mavlink->i_byte, n_left);
    }
    return mavlink->i_byte < mavlink->n_bytes;
}
