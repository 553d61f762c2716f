/** \file receiver.h
 *  Takes LCM datagrams and gives whole messages. All memory is fixed at the start.
 *
 *  A message that comes in one datagram is passed on as a view. Fragments of a message are
 *  collected in one of n_slots slots, which is found by sender and sequence number. Fragments may
 *  come in any order, and fragments of several messages may be interleaved. Each slot has a bitmap
 *  of its fragments, which shows a repeated fragment. Every datagram that is dropped, and every
 *  message that is given up, is counted under one cause. */
#ifndef GPOM_CODEC_RECEIVER_H
#define GPOM_CODEC_RECEIVER_H

#include "ports/codec/wire.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Limits of a receiver. */
typedef struct {
    uint32_t n_slots;           /**< Fragmented messages collected at a time. 0: none are taken. */
    uint32_t message_bytes_max; /**< Most bytes of a fragmented message. */
    uint32_t fragments_max;     /**< Most fragments of a message; 1 .. 65535. */
    int64_t timeout_us;         /**< > 0. A message waits this long after its newest fragment. */
} gpom_wire_receiver_config_t;

/** Counters. They only rise, and each has one cause. */
typedef struct {
    uint64_t messages_short;         /**< Message passed on that came in one datagram. */
    uint64_t messages_assembled;     /**< Message passed on that came in fragments. */
    uint64_t messages_timed_out;     /**< Message given up: a fragment did not come in time. */
    uint64_t messages_evicted;       /**< Message given up: a newer one needed its slot. */
    uint64_t datagrams_other;        /**< Datagram dropped: not from LCM. */
    uint64_t datagrams_malformed;    /**< Datagram dropped: truncated, or contradicts itself. */
    uint64_t fragments_overlong;     /**< Fragment dropped: message or number of them too large. */
    uint64_t fragments_inconsistent; /**< Fragment dropped: contradicts another one. */
    uint64_t fragments_repeated;     /**< Fragment dropped: it came before. */
    uint64_t fragments_late;         /**< Fragment dropped: its message was given up before. */
    uint64_t fragments_reordered;    /**< Fragment taken, although a later one came before it. */
} gpom_wire_receiver_stats_t;

/** A message whose fragments are collected. Internal. It is here so that its size is known. */
typedef struct {
    uint8_t *data;
    uint64_t *bitmap;
    uint64_t sender;
    int64_t stamp_us; /* when the newest fragment came */
    uint32_t sequence;
    uint32_t message_bytes;
    uint32_t first_bytes;  /* payload of fragment 0 */
    uint32_t stride_bytes; /* payload of each fragment between the first and the last */
    uint32_t last_offset;  /* offset of the last fragment */
    uint16_t n_fragments;
    uint16_t n_received;
    uint16_t i_highest;
    uint8_t state;
    char channel[GPOM_WIRE_CHANNEL_MAX + 1];
} gpom_wire_slot_t;

/** Bytes of memory for a receiver. A constant expression, which can size a static array. */
#define GPOM_WIRE_RECEIVER_BYTES(n_slots, message_bytes_max, fragments_max)                        \
    ((size_t)(n_slots) * (sizeof(gpom_wire_slot_t) + ((size_t)(fragments_max) + 63) / 64 * 8 +     \
                          ((size_t)(message_bytes_max) + 7) / 8 * 8))

/** A receiver in the caller's memory. The caller may read `stats` only. */
typedef struct {
    gpom_wire_receiver_stats_t stats;
    gpom_wire_receiver_config_t config;
    gpom_wire_slot_t *slots;
} gpom_wire_receiver_t;

/** A datagram that arrived. */
typedef struct {
    const uint8_t *bytes;
    size_t n_bytes;
    uint64_t sender; /**< A number that tells senders apart, such as address << 16 | port. */
    int64_t now_us;  /**< Time of a clock that never decreases. */
} gpom_wire_arrival_t;

/** A whole message. The pointers are views into the datagram or the receiver. */
typedef struct {
    const char *channel; /**< NUL-terminated. */
    const uint8_t *payload;
    size_t payload_bytes;
    uint32_t sequence; /**< The sender's LCM sequence number. */
} gpom_wire_message_t;

/** Make a receiver in `mem`. `mem` belongs to the caller and must outlive the receiver. It must be
 *  8-byte aligned and have at least GPOM_WIRE_RECEIVER_BYTES() of the configuration. It may be NULL
 *  if n_slots is 0.
 *  Errors: GPOM_ERR_ARG (null, or a value out of range), GPOM_ERR_MEM. */
GPOM_NODISCARD gpom_status_t gpom_wire_receiver_init(gpom_wire_receiver_t *receiver,
                                                     const gpom_wire_receiver_config_t *config,
                                                     void *mem, size_t mem_bytes);

/** Take a datagram. True if a message is complete. `message` is then valid until the next call, and
 *  only as long as the datagram is. False if more datagrams are needed, or if this one was dropped,
 *  which a counter shows.
 *  Cost: O(n_slots), and the bytes are copied once. */
GPOM_NODISCARD bool gpom_wire_receive(gpom_wire_receiver_t *receiver,
                                      const gpom_wire_arrival_t *arrival,
                                      gpom_wire_message_t *message);

/** Give up messages that have timed out. gpom_wire_receive() does this, too. Call it if datagrams
 *  may stop and the counters must still be right.
 *  Cost: O(n_slots). */
void gpom_wire_receiver_expire(gpom_wire_receiver_t *receiver, int64_t now_us);

#ifdef __cplusplus
}
#endif
#endif
