/** \file stop.h
 *  A stop decision from GPOM_Clearance frames, for a microcontroller without any other sensor: no
 *  heap, no operating system, 40 bytes.
 *
 *  "Go" needs, for every watched part of the picture, a frame that came within the time-out, whose
 *  length, CRC and counter are right, whose map is fresh, and whose watched sectors are free at
 *  least as far as asked. Whatever else comes, or does not come, means "stop": so does the time
 *  until `n_good_min` frames in a row have been right, at the start and after each fault. */
#ifndef GPOM_CAN_EXAMPLES_STOP_H
#define GPOM_CAN_EXAMPLES_STOP_H

#include "ports/can/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint32_t timeout_ms;   /**< Between two frames of a watched part; 1 .. 2^31 - 1. */
    uint16_t sectors;      /**< Watched sectors, bit by bit; 0: never "go". */
    uint8_t distance_min;  /**< Least clearance in them: code of a distance [0.1 m]. */
    uint8_t n_good_min;    /**< Frames in a row without fault before any is believed. */
    uint8_t n_missing_max; /**< Frames that may be missing between two, by the counter. */
} gpom_stop_config_t;

typedef struct {
    gpom_stop_config_t config;
    bool has_alive;
    uint8_t alive;  /**< Of the last frame that was whole. */
    uint8_t n_good; /**< Frames in a row without fault, at most n_good_min. */
    struct {
        bool is_free;     /**< Its last frame said so. */
        uint32_t came_ms; /**< When it came. */
    } parts[GPOM_CAN_CLEARANCE_FRAMES];
} gpom_stop_t;

/** Begin with "stop". */
void gpom_stop_init(gpom_stop_t *stop, const gpom_stop_config_t *config);

/** A frame with the identifier of GPOM_Clearance has come, at now_ms of a clock that may wrap. */
void gpom_stop_on_frame(gpom_stop_t *stop, const uint8_t *bytes, size_t n_bytes, uint32_t now_ms);

/** True: go. Call it at least every 2^31 ms; frames that are too old are forgotten here. */
bool gpom_stop_may_go(gpom_stop_t *stop, uint32_t now_ms);

#ifdef __cplusplus
}
#endif
#endif
