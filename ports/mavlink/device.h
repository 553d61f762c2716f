/** \file device.h
 *  MAVLink from a microcontroller that maps (ports/uart/device.h): OBSTACLE_DISTANCE and HEARTBEAT
 *  over a second line, which leads to an autopilot. The main loop calls gpom_mavlink_device_tick()
 *  beside gpom_device_tick(). An image that does not call it contains nothing of MAVLink. */
#ifndef GPOM_MAVLINK_DEVICE_H
#define GPOM_MAVLINK_DEVICE_H

#include "ports/mavlink/messages.h"
#include "ports/uart/device.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Fill it with gpom_mavlink_device_config_init(), then change it. */
typedef struct {
    uint8_t system_id;    /**< That of the vehicle. Default 1. */
    uint8_t component_id; /**< Default GPOM_MAVLINK_COMPONENT_ID. */
    uint8_t sensor;       /**< gpom_mavlink_sensor_t. Default GPOM_MAVLINK_LASER. */
    uint32_t n_sectors;   /**< gpom_mavlink_is_sector_count() is true for it. Default 72. */
    float range_m;        /**< Up to GPOM_MAVLINK_RANGE_MAX_M [m]. Default 25. */
    float radius_m;       /**< Cells whose centre is this near to the robot are its own place [m].
                                Default 0.5. */
    int64_t period_us;    /**< Of OBSTACLE_DISTANCE. Default 100,000. */
    void *ctx;
    /** Send bytes over the autopilot's line. Returns the number that was taken. The others are
     *  offered again. It may not wait. */
    size_t (*bytes_write)(void *ctx, const uint8_t *bytes, size_t n_bytes);
} gpom_mavlink_device_config_t;

/** The caller may read the counters. The other fields are internal. */
typedef struct {
    uint64_t n_sent;     /**< Messages that the line began to take. */
    uint64_t n_not_sent; /**< Messages left out, because the line or the main loop was busy for a
                              whole period. */
    gpom_mavlink_device_config_t config;
    gpom_mavlink_sender_t sender;
    bool is_begun;
    int64_t obstacles_due_us, heartbeat_due_us;
    uint32_t n_bytes, i_byte; /* bytes of the message, and bytes of it that were taken */
    uint8_t bytes[GPOM_MAVLINK_BYTES];
    gpom_mavlink_obstacles_t obstacles;
    gpom_sector_t sectors[GPOM_MAVLINK_SECTORS_MAX];
} gpom_mavlink_device_t;

/** Fill a configuration with the documented defaults. It has no hook yet. */
void gpom_mavlink_device_config_init(gpom_mavlink_device_config_t *config);

/** Begin. Errors: GPOM_ERR_ARG (null, a missing hook, a number out of range). */
GPOM_NODISCARD gpom_status_t gpom_mavlink_device_init(gpom_mavlink_device_t *mavlink,
                                                      const gpom_mavlink_device_config_t *config);

/** One turn of the main loop: write at most one message that is due, and offer its bytes to the
 *  line. While no scan with a usable reading was inserted for stale_after_us of the device, no
 *  sector has a reading. True if bytes are still waiting for the line: the processor must not sleep
 *  long.
 *  Cost: gpom_sectors() of n_sectors, and 5,100 instructions for the message, each period. */
bool gpom_mavlink_device_tick(gpom_mavlink_device_t *mavlink, const gpom_device_t *device);

#ifdef __cplusplus
}
#endif
#endif
