/** \file protect.h
 *  End-to-end protection of CAN frames, similar to AUTOSAR E2E profiles 1 and 5. A frame has a CRC
 *  over its payload and a data id that is not sent. A counter shows that the sender is alive. */
#ifndef GPOM_CAN_PROTECT_H
#define GPOM_CAN_PROTECT_H

#include "ports/can/signal.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Why a frame is wrong. Each fault has one cause, so that it can be counted. */
typedef enum {
    GPOM_CAN_OK = 0,
    GPOM_CAN_LENGTH,  /**< The number of bytes is not that of the message. */
    GPOM_CAN_CRC,     /**< The frame is damaged, or is another message under this id. */
    GPOM_CAN_COUNTER, /**< The counter did not change, or has an impossible value. */
    GPOM_CAN_VALUE,   /**< A field has a value that its definition does not allow. */
    GPOM_CAN_FAULTS   /**< Number of values above, for arrays of counters. */
} gpom_can_fault_t;

/** Alive counters run 0 .. 14, 0, ... as in profile 1. 15 is never sent. */
#define GPOM_CAN_ALIVE_MAX 14u

/** CRC-8 SAE-J1850, with polynomial 0x1D. The standard sets start and final XOR to 0xFF. AUTOSAR's
 *  profile 1 sets both to 0. */
typedef struct {
    uint8_t start;
    uint8_t final_xor;
} gpom_can_crc8_t;

/** CRC-8 over the low and high byte of data_id, then over `bytes` without byte i_skipped, which
 *  holds the CRC itself. If i_skipped is n_bytes or more, no byte is left out.
 *  Cost: 8 steps per byte. */
uint8_t gpom_can_crc8(gpom_can_crc8_t crc, uint16_t data_id, const uint8_t *bytes, size_t n_bytes,
                      size_t i_skipped);

/** CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF) over `bytes`, then over the low and high
 *  byte of data_id, as in profile 5.
 *  Cost: 8 steps per byte. */
uint16_t gpom_can_crc16(uint16_t data_id, const uint8_t *bytes, size_t n_bytes);

/** Configured protection of a message that other devices send. */
typedef struct {
    bool has_crc;
    uint8_t i_crc_byte;
    uint16_t data_id;
    gpom_can_crc8_t crc;
    bool has_counter;
    gpom_can_signal_t counter;
    uint32_t counter_max; /**< The counter runs 0 .. counter_max, 0, ... */
} gpom_can_protection_t;

/** State of a protected stream of frames. All zero before the first frame. */
typedef struct {
    bool has_counter;
    uint32_t counter;
    uint32_t n_lost; /**< Frames missing between the last two frames, by the counter. */
} gpom_can_stream_t;

/** Check a frame and note its counter. A frame with a wrong CRC does not change the counter. A
 *  frame that repeats the counter is a fault. stream->n_lost becomes the number of missing frames.
 *  Cost: 8 steps per byte. */
GPOM_NODISCARD gpom_can_fault_t gpom_can_check(const gpom_can_protection_t *protection,
                                               gpom_can_stream_t *stream, const uint8_t *bytes,
                                               size_t n_bytes);

/** One line of English for a fault. Never NULL. The text has static storage. */
const char *gpom_can_fault_str(gpom_can_fault_t fault);

#ifdef __cplusplus
}
#endif
#endif
