/** \file datagram.h
 *  LCM's datagrams. A datagram holds a short message after its channel and sequence number, or one
 *  fragment of a message.
 *
 *  Short:    "LC02", u32 sequence, channel, NUL, message.
 *  Fragment: "LC03", u32 sequence, u32 bytes of the message, u32 offset, u16 number of this
 *            fragment, u16 number of fragments, in fragment 0 channel and NUL, a piece of the
 *            message.
 *  All numbers are big-endian. The sequence number counts a sender's messages on all channels. */
#ifndef GPOM_CODEC_DATAGRAM_H
#define GPOM_CODEC_DATAGRAM_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Bytes before the channel name. */
#define GPOM_WIRE_SHORT_HEADER_BYTES 8u
#define GPOM_WIRE_FRAGMENT_HEADER_BYTES 20u

/** The parts of a datagram. The pointers are views into it. */
typedef struct {
    const char *channel; /**< NUL-terminated. NULL in every fragment except the first. */
    const uint8_t *payload;
    uint32_t payload_bytes;
    uint32_t sequence;
    uint32_t message_bytes; /**< Bytes of the whole message. payload_bytes for a short message. */
    uint32_t offset;        /**< Offset of the payload in the message. */
    uint16_t i_fragment;
    uint16_t n_fragments; /**< 0 for a short message, which has no fragments. */
} gpom_wire_datagram_t;

/** Read the parts of a datagram. Faults: GPOM_WIRE_TYPE (not an LCM datagram), GPOM_WIRE_SHORT
 *  (ends inside its header), GPOM_WIRE_VALUE (channel name too long), GPOM_WIRE_COUNT (fragment
 *  numbers, sizes or offsets contradict each other), GPOM_WIRE_LONG (more bytes than UDP carries).
 */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_datagram_read(gpom_wire_datagram_t *datagram,
                                                         const uint8_t *bytes, size_t n_bytes);

/** Write the header of a short message. The caller then encodes the message right behind it.
 *  Returns the bytes written. 0 if they do not fit, a pointer is NULL, or the channel name is too
 *  long. */
GPOM_NODISCARD size_t gpom_wire_datagram_begin(uint8_t *bytes, size_t n_bytes, const char *channel,
                                               uint32_t sequence);

/** A message that is sent in fragments. */
typedef struct {
    const char *channel;
    const uint8_t *payload; /**< The encoded message. */
    uint32_t payload_bytes;
    uint32_t sequence;
    uint32_t datagram_bytes_max; /**< For example GPOM_WIRE_DATAGRAM_BYTES. */
} gpom_wire_outgoing_t;

/** Number of fragments of a message. 0 if the message cannot be sent, for one of these reasons:
 *  - A pointer is NULL.
 *  - The message is empty or longer than 2^28 bytes (LCM's limit).
 *  - The channel name is too long.
 *  - The datagrams are too small for the channel name or too large for UDP.
 *  - More than 65535 fragments would be needed. */
GPOM_NODISCARD uint32_t gpom_wire_fragment_count(const gpom_wire_outgoing_t *message);

/** Write fragment i_fragment as a whole datagram. Returns the bytes written. 0 if they do not fit,
 *  there is no such fragment, or the message cannot be sent. */
GPOM_NODISCARD size_t gpom_wire_fragment_write(const gpom_wire_outgoing_t *message,
                                               uint32_t i_fragment, uint8_t *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
