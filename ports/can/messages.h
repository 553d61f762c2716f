/** \file messages.h
 *  GPOM_Status, GPOM_Clearance, GPOM_ClearanceFd and GPOM_Tile: the frames that tell small
 *  controllers what the map knows. gpom.dbc describes their layout. The fields here hold codes, as
 *  they are sent. gpom_can_…_code() converts a number into its code.
 *
 *  Every field has a value of its own for "unknown". Rounding never makes an occupied place look
 *  free: distances are rounded down, probabilities and deviations are rounded up. */
#ifndef GPOM_CAN_MESSAGES_H
#define GPOM_CAN_MESSAGES_H

#include "ports/can/protect.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_CAN_CLASSIC_BYTES 8u
#define GPOM_CAN_FD_BYTES 64u

/** Default identifiers. */
#define GPOM_CAN_STATUS_ID 0x6A0u
#define GPOM_CAN_CLEARANCE_ID 0x6A1u
#define GPOM_CAN_CLEARANCE_FD_ID 0x6A2u
#define GPOM_CAN_TILE_ID 0x6A3u

/** Data ids of the CRCs. They do not depend on the identifiers. */
#define GPOM_CAN_STATUS_DATA_ID 0x6A50u
#define GPOM_CAN_CLEARANCE_DATA_ID 0x6A51u
#define GPOM_CAN_CLEARANCE_FD_DATA_ID 0x6A52u
#define GPOM_CAN_TILE_DATA_ID 0x6A53u

/** State of the sender, which tells whether the map may be believed. */
typedef enum {
    GPOM_CAN_STARTING = 0, /**< No scan came yet. All sectors are unknown. */
    GPOM_CAN_MAPPING = 1,  /**< The map is fresh. */
    GPOM_CAN_STALE = 2,    /**< No scan came for the configured time. All sectors are unknown. */
    GPOM_CAN_STOPPING = 3  /**< The sender shuts down. All sectors are unknown. */
} gpom_can_state_t;

/** Fault bits of GPOM_Status. */
enum {
    GPOM_CAN_FAULT_SCAN = 1,     /**< No scan in time. */
    GPOM_CAN_FAULT_POSE = 2,     /**< Poses or odometry are missing or refused. */
    GPOM_CAN_FAULT_LCM = 4,      /**< Scans or poses were lost on the way. */
    GPOM_CAN_FAULT_CAN = 8,      /**< Bad or lost frames, error frames or bus-off. */
    GPOM_CAN_FAULT_OVERRUN = 16, /**< More scans or queries than could be served. */
    GPOM_CAN_FAULT_FULL = 32     /**< The map is full. New beams replace kept ones. */
};

/** Codes of distances. 0 .. 253 are tenths of a metre. */
#define GPOM_CAN_DISTANCE_MAX 253u
#define GPOM_CAN_DISTANCE_CLEAR 254u /**< There is no obstacle within the sender's range. */
#define GPOM_CAN_DISTANCE_UNKNOWN 255u

#define GPOM_CAN_AGE_MAX 254u /**< 2.54 s or more. */
#define GPOM_CAN_AGE_UNKNOWN 255u
#define GPOM_CAN_BEARING_UNKNOWN (-128)
#define GPOM_CAN_FILL_MAX 100u

/** Codes of probabilities and deviations. 0 .. 14 are 14ths. */
#define GPOM_CAN_LEVEL_MAX 14u
#define GPOM_CAN_LEVEL_UNKNOWN 15u

/** GPOM_Status, 8 bytes. */
typedef struct {
    uint8_t alive;     /**< 0 .. GPOM_CAN_ALIVE_MAX. */
    uint8_t state;     /**< gpom_can_state_t. */
    uint8_t age;       /**< Age of the newest scan [10 ms], or GPOM_CAN_AGE_UNKNOWN. */
    uint8_t sequence;  /**< Scans inserted, modulo 256. */
    uint8_t clearance; /**< Least distance code of all sectors that are not unknown. */
    int8_t bearing;    /**< Bearing of the middle of the sector with the least clearance
                                [2 degrees], counter-clockwise from forward, -90 .. 90, or
                                GPOM_CAN_BEARING_UNKNOWN. */
    uint8_t fill;      /**< Used part of the map's memory [%]. */
    uint8_t faults;    /**< Bits: GPOM_CAN_FAULT_SCAN and so on. */
} gpom_can_status_t;

/** Sectors of GPOM_Clearance. Each is 24 degrees wide. Sector 0 is around the forward direction,
 *  and the others follow counter-clockwise. A frame holds five of them. */
#define GPOM_CAN_SECTORS 15u
#define GPOM_CAN_SECTORS_IN_FRAME 5u
#define GPOM_CAN_CLEARANCE_FRAMES 3u

/** GPOM_Clearance, 8 bytes: sectors 5 i_part to 5 i_part + 4. */
typedef struct {
    uint8_t alive;    /**< Grows by one with each frame, of any part. */
    uint8_t i_part;   /**< 0 .. 2. */
    uint8_t state;    /**< gpom_can_state_t. */
    uint8_t sequence; /**< The same in all parts of one picture. */
    uint8_t distance[GPOM_CAN_SECTORS_IN_FRAME];
} gpom_can_clearance_t;

/** Sectors of GPOM_ClearanceFd. Each is 360 / 28 degrees wide. The order is that of GPOM_Clearance.
 */
#define GPOM_CAN_FD_SECTORS 28u

/** GPOM_ClearanceFd, 64 bytes. */
typedef struct {
    uint8_t alive;
    uint8_t state;
    uint8_t sequence;
    uint32_t stamp_ms; /**< Stamp of the newest scan, modulo 2^32. */
    uint8_t distance[GPOM_CAN_FD_SECTORS];
    uint8_t probability[GPOM_CAN_FD_SECTORS]; /**< Probability of the cell that limits the sector.
                                                   Greatest in the sector if no cell does. */
    uint8_t deviation[GPOM_CAN_FD_SECTORS];   /**< Deviation of the same cell, relative to the
                                                   prior's. */
} gpom_can_clearance_fd_t;

#define GPOM_CAN_TILE_SIDE 8u
#define GPOM_CAN_TILE_CELLS 64u
#define GPOM_CAN_TILE_DEVIATION_MAX 3u

/** GPOM_Tile, 64 bytes: 8 x 8 cells. Its lower left corner is at 8 (reference + tile) cells from
 *  the map frame's origin. */
typedef struct {
    uint8_t alive;
    uint8_t state;
    uint8_t sequence; /**< The same in all tiles of one picture. */
    int8_t tile_x;
    int8_t tile_y;
    uint8_t cell_cm; /**< Side of a cell [0.01 m]. */
    uint8_t n_tiles; /**< Tiles of the picture. */
    uint32_t stamp_ms;
    int16_t reference_x; /**< The robot's tile, from the map frame's origin [tiles], modulo 2^16. */
    int16_t reference_y;
    uint8_t probability[GPOM_CAN_TILE_CELLS]; /**< Cell (ix, iy) at 8 iy + ix. */
    uint8_t deviation[GPOM_CAN_TILE_CELLS];   /**< 0 .. 3 thirds of the prior's deviation. */
} gpom_can_tile_t;

/** Code of a distance, rounded down. NaN becomes unknown.
 *  Cost: a few operations. */
uint8_t gpom_can_distance_code(float distance_m);

/** Distance that is free according to a code [m]. 0 if the code is unknown, range_m if the code is
 *  clear. */
float gpom_can_distance_m(uint8_t code, float range_m);

/** Code of an age, rounded up. NaN becomes unknown. */
uint8_t gpom_can_age_code(float age_s);

/** Code of a bearing, rounded to the nearest. NaN becomes unknown. */
int8_t gpom_can_bearing_code(float bearing_rad);

/** Code of a probability in 65535ths, rounded up. The code is 0 only if the probability is 0. */
uint8_t gpom_can_probability_code(uint16_t probability_65535ths);

/** Code of the standard deviation of a variance given in 255ths of the prior's. The code is the
 *  least n <= n_max with (n / n_max)^2 >= variance / 255, which is rounded up.
 *  Cost: O(n_max). */
uint8_t gpom_can_deviation_code(uint8_t variance_255ths, uint8_t n_max);

/** Write a frame with its CRC. Only the bits of a field that fit the frame are written.
 *  Cost: O(bytes). */
void gpom_can_status_pack(const gpom_can_status_t *message, uint8_t *bytes);
void gpom_can_clearance_pack(const gpom_can_clearance_t *message, uint8_t *bytes);
void gpom_can_clearance_fd_pack(const gpom_can_clearance_fd_t *message, uint8_t *bytes);
void gpom_can_tile_pack(const gpom_can_tile_t *message, uint8_t *bytes);

/** Read a frame. Checks its length, then its CRC, then its fields. After a fault nothing in
 *  `message` is valid. The caller checks the counter with gpom_can_alive_step().
 *  Cost: O(bytes). */
GPOM_NODISCARD gpom_can_fault_t gpom_can_status_unpack(gpom_can_status_t *message,
                                                       const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_can_fault_t gpom_can_clearance_unpack(gpom_can_clearance_t *message,
                                                          const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_can_fault_t gpom_can_clearance_fd_unpack(gpom_can_clearance_fd_t *message,
                                                             const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_can_fault_t gpom_can_tile_unpack(gpom_can_tile_t *message, const uint8_t *bytes,
                                                     size_t n_bytes);

/** The alive counter of the next frame. */
uint8_t gpom_can_alive_next(uint8_t alive);

/** How far counter `now` is ahead of counter `before`, both 0 .. GPOM_CAN_ALIVE_MAX. 0: the counter
 *  did not change. 1: the next frame. More: frames are missing. */
uint8_t gpom_can_alive_step(uint8_t before, uint8_t now);

#ifdef __cplusplus
}
#endif
#endif
