/** \file protect.h
 *  End-to-end protection of CAN frames in the manner of AUTOSAR E2E profiles 1 and 5: a CRC over
 *  payload and a data id that is not sent, and a counter that shows a sender is alive. */
#ifndef GPOM_CAN_PROTECT_H
#define GPOM_CAN_PROTECT_H

#include "ports/can/signal.h"

#ifdef __cplusplus
extern "C" {
#endif

/** What is wrong with a frame: one cause each, to be counted. */
typedef enum {
    GPOM_CAN_OK = 0,
    GPOM_CAN_LENGTH,  /**< Not as many bytes as the message has. */
    GPOM_CAN_CRC,     /**< Damaged, or another message under this id. */
    GPOM_CAN_COUNTER, /**< The counter stands still, or is none. */
    GPOM_CAN_VALUE,   /**< A field has a value that its definition does not know. */
    GPOM_CAN_FAULTS   /**< Number of the above, for arrays of counters. */
} gpom_can_fault_t;

/** Alive counters run 0 .. 14, 0, ... as in profile 1; 15 is never sent. */
#define GPOM_CAN_ALIVE_MAX 14u

/** CRC-8 SAE-J1850: polynomial 0x1D. Its own start and final XOR are 0xFF; AUTOSAR's profile 1 has
 *  0 for both. */
typedef struct {
    uint8_t start;
    uint8_t final_xor;
} gpom_can_crc8_t;

/** CRC-8 over the low and high byte of data_id, then `bytes` but for the one at i_skipped, where
 *  the CRC itself stands (n_bytes or more: none is left out).  8 steps a byte. */
uint8_t gpom_can_crc8(gpom_can_crc8_t crc, uint16_t data_id, const uint8_t *bytes, size_t n_bytes,
                      size_t i_skipped);

/** CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF) over `bytes`, then the low and high byte
 *  of data_id, as in profile 5.  8 steps a byte. */
uint16_t gpom_can_crc16(uint16_t data_id, const uint8_t *bytes, size_t n_bytes);

/** Protection of a foreign message, as configured. */
typedef struct {
    bool has_crc;
    uint8_t i_crc_byte;
    uint16_t data_id;
    gpom_can_crc8_t crc;
    bool has_counter;
    gpom_can_signal_t counter;
    uint32_t counter_max; /**< The counter runs 0 .. counter_max, 0, ... */
} gpom_can_protection_t;

/** What is known of a protected stream of frames. Zero: nothing. */
typedef struct {
    bool has_counter;
    uint32_t counter;
    uint32_t n_lost; /**< Frames missing between the last two, by the counter. */
} gpom_can_stream_t;

/** Check a frame and note its counter. A frame with a wrong CRC changes nothing; one that repeats
 *  the counter is a fault; missing ones are counted in stream->n_lost.  8 steps a byte. */
GPOM_NODISCARD gpom_can_fault_t gpom_can_check(const gpom_can_protection_t *protection,
                                               gpom_can_stream_t *stream, const uint8_t *bytes,
                                               size_t n_bytes);

/** One line of English for a fault; never NULL, static storage. */
const char *gpom_can_fault_str(gpom_can_fault_t fault);

#ifdef __cplusplus
}
#endif
#endif
