/** \file messages.h
 *  MAVLink 2 messages for autopilots: HEARTBEAT and OBSTACLE_DISTANCE. Plain C99 without heap. Safe
 *  in an interrupt. Each sender belongs to one thread.
 *
 *  The layout of the messages is that of MAVLink's common.xml. The bytes are written by the C code
 *  that pymavlink's mavgen generates from it at build time. Messages are not signed.
 *
 *  docs/mavlink.md says what PX4 and ArduPilot make of them. */
#ifndef GPOM_MAVLINK_MESSAGES_H
#define GPOM_MAVLINK_MESSAGES_H

#include "gpom/sectors.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Bytes of the longest message here: a header of 10, OBSTACLE_DISTANCE of 167, a CRC of 2. */
#define GPOM_MAVLINK_BYTES 179u

/** Least and greatest number of sectors of OBSTACLE_DISTANCE. */
#define GPOM_MAVLINK_SECTORS_MIN 8u
#define GPOM_MAVLINK_SECTORS_MAX 72u

/** Greatest distance that the message has room for [m]. */
#define GPOM_MAVLINK_RANGE_MAX_M 655.0

/** Distance in a sector without a reading. */
#define GPOM_MAVLINK_NO_READING UINT16_MAX

/** Least distance that is sent [cm]. ArduPilot ignores a distance of 0. */
#define GPOM_MAVLINK_CM_MIN 1u

/** Component id that MAVLink gives to obstacle avoidance: MAV_COMP_ID_OBSTACLE_AVOIDANCE. */
#define GPOM_MAVLINK_COMPONENT_ID 196u

/** What HEARTBEAT says about the map: values of MAV_STATE. */
typedef enum {
    GPOM_MAVLINK_STARTING = 1, /**< MAV_STATE_BOOT: no scan came yet. */
    GPOM_MAVLINK_MAPPING = 4,  /**< MAV_STATE_ACTIVE. */
    GPOM_MAVLINK_STALE = 5,    /**< MAV_STATE_CRITICAL: the map is old, or the pose is not known. */
    GPOM_MAVLINK_STOPPING = 7  /**< MAV_STATE_POWEROFF. */
} gpom_mavlink_state_t;

/** What measured the distances: values of MAV_DISTANCE_SENSOR. */
typedef enum {
    GPOM_MAVLINK_LASER = 0,
    GPOM_MAVLINK_ULTRASOUND = 1,
    GPOM_MAVLINK_INFRARED = 2,
    GPOM_MAVLINK_RADAR = 3,
    GPOM_MAVLINK_UNKNOWN_SENSOR = 4
} gpom_mavlink_sensor_t;

/** Who sends. System and component id are those of MAVLink, 1 to 255. */
typedef struct {
    uint8_t system_id;    /**< That of the vehicle. */
    uint8_t component_id; /**< See GPOM_MAVLINK_COMPONENT_ID. */
    uint8_t sequence;     /**< Number of the next message. */
} gpom_mavlink_sender_t;

/** Contents of OBSTACLE_DISTANCE. Fill with gpom_mavlink_obstacles_init() and
 *  gpom_mavlink_set_sectors(). */
typedef struct {
    int64_t stamp_us;                               /**< Since 1970 or since the device started
                                                         [us]. Default 0. */
    uint16_t distance_cm[GPOM_MAVLINK_SECTORS_MAX]; /**< As in the message: clockwise, see
                                                         gpom_mavlink_obstacle_distance(). */
    uint8_t n_sectors;
    uint16_t range_cm;
    uint8_t sensor; /**< gpom_mavlink_sensor_t. Default GPOM_MAVLINK_LASER. */
} gpom_mavlink_obstacles_t;

/** True if n sectors have a width of whole degrees: n is 8 to 72 and divides 360. */
bool gpom_mavlink_is_sector_count(uint32_t n_sectors);

/** Begin a message in which no sector has a reading.
 *
 *  n_sectors  gpom_mavlink_is_sector_count() is true for it. Otherwise no sector gets a reading.
 *  range_m    0.01 to GPOM_MAVLINK_RANGE_MAX_M [m], rounded down to whole centimetres. */
void gpom_mavlink_obstacles_init(gpom_mavlink_obstacles_t *obstacles, uint32_t n_sectors,
                                 float range_m);

/** Set the readings of all n_sectors sectors. A sector in which all is free, up to the range of
 *  gpom_sectors(), gets range_cm + 1: no obstacle. One of which nothing is known has no reading.
 *  Any other gets its distance_m, rounded down to whole centimetres, but at least
 *  GPOM_MAVLINK_CM_MIN; a distance beyond the range, or NaN, is no reading.
 *
 *  sectors  n_sectors sectors of gpom_sectors(), which ran with the same range. */
void gpom_mavlink_set_sectors(gpom_mavlink_obstacles_t *obstacles, const gpom_sector_t *sectors);

/** Write a HEARTBEAT: MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID. MAVLink wants one a
 *  second. Returns its bytes.
 *
 *  bytes  room for GPOM_MAVLINK_BYTES. */
size_t gpom_mavlink_heartbeat(gpom_mavlink_sender_t *sender, gpom_mavlink_state_t state,
                              uint8_t *bytes);

/** Write an OBSTACLE_DISTANCE in MAV_FRAME_BODY_FRD: elements follow clockwise, and the first one
 *  is up to 22.5 degrees to the left of forward, as the angle offset says. Returns its bytes.
 *
 *  bytes  room for GPOM_MAVLINK_BYTES. */
size_t gpom_mavlink_obstacle_distance(gpom_mavlink_sender_t *sender,
                                      const gpom_mavlink_obstacles_t *obstacles, uint8_t *bytes);

#ifdef __cplusplus
}
#endif
#endif
