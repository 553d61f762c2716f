/** \file stop.h
 *  A stop decision from GPOM_Clearance frames, for a microcontroller without any other sensor. It
 *  uses no heap, no operating system, and 40 bytes.
 *
 *  "Go" needs a good frame for every watched part of the picture. A good frame came within the
 *  time-out and has the right length, CRC and counter. Its map is fresh, and its watched sectors
 *  are free at least up to distance_min. Everything else means "stop". At the start and after each
 *  fault the decision is "stop" until `n_good_min` frames in a row were right. */
#ifndef GPOM_CAN_EXAMPLES_STOP_H
#define GPOM_CAN_EXAMPLES_STOP_H

#include "ports/can/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint32_t timeout_ms;   /**< Longest time between two frames of a watched part; 1 .. 2^31 - 1. */
    uint16_t sectors;      /**< Bit i: sector i is watched. 0: never "go". */
    uint8_t distance_min;  /**< Least clearance in watched sectors: code of a distance [0.1 m]. */
    uint8_t n_good_min;    /**< Frames in a row without fault that are needed for "go". */
    uint8_t n_missing_max; /**< Frames that may be missing between two frames, by the counter. */
} gpom_stop_config_t;

typedef struct {
    gpom_stop_config_t config;
    bool has_alive;
    uint8_t alive;  /**< Counter of the last frame without damage. */
    uint8_t n_good; /**< Frames in a row without fault, at most n_good_min. */
    struct {
        bool is_free;     /**< Its last frame said that the watched sectors are free. */
        uint32_t came_ms; /**< When its last frame came. */
    } parts[GPOM_CAN_CLEARANCE_FRAMES];
} gpom_stop_t;

/** Begin with "stop". */
void gpom_stop_init(gpom_stop_t *stop, const gpom_stop_config_t *config);

/** Take a frame with the identifier of GPOM_Clearance. It came at now_ms of a clock that may wrap.
 */
void gpom_stop_on_frame(gpom_stop_t *stop, const uint8_t *bytes, size_t n_bytes, uint32_t now_ms);

/** True for "go". Call it at least every 2^31 ms, because it also forgets frames that are too old.
 */
bool gpom_stop_may_go(gpom_stop_t *stop, uint32_t now_ms);

#ifdef __cplusplus
}
#endif
#endif
