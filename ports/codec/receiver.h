/** \file receiver.h
 *  LCM datagrams in, whole messages out: fragments are put together in memory fixed at the start.
 *
 *  A message that comes in one datagram is passed on as a view. Fragments are kept in one of
 *  n_slots slots, by sender and sequence number, in any order, those of several messages
 *  interleaved; a bitmap of a slot's fragments tells a repeated one. Every datagram that is not
 *  taken, and every message that is given up, is counted under one cause. */
#ifndef GPOM_CODEC_RECEIVER_H
#define GPOM_CODEC_RECEIVER_H

#include "ports/codec/wire.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What a receiver is made for. */
typedef struct {
    uint32_t n_slots;           /**< Messages in fragments at a time; 0: none are taken. */
    uint32_t message_bytes_max; /**< Of a message in fragments. */
    uint32_t fragments_max;     /**< Of a message; 1 .. 65535. */
    int64_t timeout_us;         /**< A message is given up so long after its last fragment; > 0. */
} gpom_wire_receiver_config_t;

/** Counters only rise; each has one cause. */
typedef struct {
    uint64_t messages_short;         /**< Passed on: came in one datagram. */
    uint64_t messages_assembled;     /**< Passed on: came in fragments. */
    uint64_t messages_timed_out;     /**< Given up: a fragment did not come in time. */
    uint64_t messages_evicted;       /**< Given up: all slots taken, a newer message came. */
    uint64_t datagrams_other;        /**< Dropped: not LCM's. */
    uint64_t datagrams_malformed;    /**< Dropped: truncated, or contradicts itself. */
    uint64_t fragments_overlong;     /**< Dropped: its message or their number is too large. */
    uint64_t fragments_inconsistent; /**< Dropped: contradicts another of its message. */
    uint64_t fragments_repeated;     /**< Dropped: had come before. */
    uint64_t fragments_late;         /**< Dropped: its message had been given up. */
    uint64_t fragments_reordered;    /**< Taken, though a later one had come before it. */
} gpom_wire_receiver_stats_t;

/** One message being put together. Internal; here so that its size is known. */
typedef struct {
    uint8_t *data;
    uint64_t *bitmap;
    uint64_t sender;
    int64_t stamp_us; /* of its last fragment */
    uint32_t sequence;
    uint32_t message_bytes;
    uint32_t first_bytes;  /* of fragment 0 */
    uint32_t stride_bytes; /* of the fragments between the first and the last */
    uint32_t last_offset;  /* of the last fragment */
    uint16_t n_fragments;
    uint16_t n_received;
    uint16_t i_highest;
    uint8_t state;
    char channel[GPOM_WIRE_CHANNEL_MAX + 1];
} gpom_wire_slot_t;

/** Bytes of memory for a receiver: a constant expression for a static array. */
#define GPOM_WIRE_RECEIVER_BYTES(n_slots, message_bytes_max, fragments_max)                        \
    ((size_t)(n_slots) * (sizeof(gpom_wire_slot_t) + ((size_t)(fragments_max) + 63) / 64 * 8 +     \
                          ((size_t)(message_bytes_max) + 7) / 8 * 8))

/** A receiver in the caller's memory. Only `stats` is for reading. */
typedef struct {
    gpom_wire_receiver_stats_t stats;
    gpom_wire_receiver_config_t config;
    gpom_wire_slot_t *slots;
} gpom_wire_receiver_t;

/** A datagram as it came. */
typedef struct {
    const uint8_t *bytes;
    size_t n_bytes;
    uint64_t sender; /**< Any number that tells senders apart: address << 16 | port, say. */
    int64_t now_us;  /**< A clock that never decreases. */
} gpom_wire_arrival_t;

/** A whole message: views into the datagram or the receiver. */
typedef struct {
    const char *channel; /**< NUL-terminated. */
    const uint8_t *payload;
    size_t payload_bytes;
    uint32_t sequence; /**< The sender's LCM sequence number. */
} gpom_wire_message_t;

/** Make a receiver in `mem`: 8-byte aligned, GPOM_WIRE_RECEIVER_BYTES() of the configuration at
 *  least, the caller's, as long as the receiver is used; may be NULL if n_slots is 0.
 *  Errors: GPOM_ERR_ARG (null, or a value out of range), GPOM_ERR_MEM. */
GPOM_NODISCARD gpom_status_t gpom_wire_receiver_init(gpom_wire_receiver_t *receiver,
                                                     const gpom_wire_receiver_config_t *config,
                                                     void *mem, size_t mem_bytes);

/** Take a datagram. True: a message is complete; `message` is valid until the next call or as long
 *  as the datagram, whichever ends first. False: wait for more; the reason may be in the counters.
 *  Cost: O(n_slots), and the bytes are copied once. */
GPOM_NODISCARD bool gpom_wire_receive(gpom_wire_receiver_t *receiver,
                                      const gpom_wire_arrival_t *arrival,
                                      gpom_wire_message_t *message);

/** Give up what has timed out. gpom_wire_receive() does so by itself; call it where datagrams may
 *  cease and the counters matter. O(n_slots). */
void gpom_wire_receiver_expire(gpom_wire_receiver_t *receiver, int64_t now_us);

#ifdef __cplusplus
}
#endif
#endif
