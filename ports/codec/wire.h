/** \file wire.h
 *  What all of the codec shares: faults, arrays, limits.
 *
 *  The codec turns LCM messages in caller memory into structs and back: no heap, no operating
 *  system, every length checked before it is used. Any bytes may be handed to a decoder. Each type
 *  has a struct, gpom_wire_<type>_decode() and gpom_wire_<type>_encode(); their fields are those of
 *  lcmtypes/, where units and conventions are written down.
 *
 *  Cost of a decode or encode: a few operations a byte, and 8 steps a byte for the CRC-32 of gpom's
 *  own types. Stack: under 1 KiB. Safe in an interrupt if the time is; no state of its own. */
#ifndef GPOM_CODEC_WIRE_H
#define GPOM_CODEC_WIRE_H

#include "gpom/status.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Payload of an Ethernet frame's UDP datagram: IP fragments none. */
#define GPOM_WIRE_DATAGRAM_BYTES 1472u

/** Longest channel name, its NUL not counted (LCM's limit). */
#define GPOM_WIRE_CHANNEL_MAX 63u

/** Why bytes are not a message, or a struct cannot become one: one cause each, to be counted. */
typedef enum {
    GPOM_WIRE_OK = 0,
    GPOM_WIRE_ARG,      /**< The caller's: a null pointer. */
    GPOM_WIRE_TYPE,     /**< Another fingerprint, or not an LCM datagram. */
    GPOM_WIRE_SHORT,    /**< The bytes end before the message does. */
    GPOM_WIRE_LONG,     /**< Bytes are left after the message. */
    GPOM_WIRE_CRC,      /**< Damaged on the way: CRC-32 does not fit (gpom's own types). */
    GPOM_WIRE_COUNT,    /**< A count is negative, or two that must agree do not. */
    GPOM_WIRE_CAPACITY, /**< More elements or bytes than the receiving memory holds. */
    GPOM_WIRE_VALUE,    /**< A field has a value that its definition does not know. */
    GPOM_WIRE_FAULTS    /**< Number of the above, for arrays of counters. */
} gpom_wire_fault_t;

/** One line of English for a fault; never NULL, static storage. */
const char *gpom_wire_fault_str(gpom_wire_fault_t fault);

/** First 8 bytes of a message, which tell its type; 0 (no type's) if there are fewer. */
uint64_t gpom_wire_fingerprint(const uint8_t *bytes, size_t n_bytes);

/** Floats in the caller's array. Decoding: n_max says how many fit, n is set; with values NULL they
 *  are skipped, whatever their number. Encoding: n values are sent, n_max is not used. */
typedef struct {
    float *values;
    uint32_t n_max;
    uint32_t n;
} gpom_wire_floats_t;

/** Times [us] in the caller's array; as gpom_wire_floats_t. */
typedef struct {
    int64_t *values;
    uint32_t n_max;
    uint32_t n;
} gpom_wire_times_t;

#ifdef __cplusplus
}
#endif
#endif
