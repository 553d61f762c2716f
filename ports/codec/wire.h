/** \file wire.h
 *  Shared by the whole codec: faults, arrays, limits.
 *
 *  The codec converts LCM messages in caller memory into structs and back. It uses no heap and no
 *  operating system, and it checks every length before use. A decoder may be given any bytes. Each
 *  type has a struct, gpom_wire_<type>_decode() and gpom_wire_<type>_encode(). The fields are those
 *  of lcmtypes/, where units and conventions are described.
 *
 *  Cost of a decode or encode: a few operations per byte, and 8 steps per byte for the CRC-32 of
 *  gpom's own types. Stack: under 1 KiB. The codec has no state, so it is safe in an interrupt that
 *  has enough time. */
#ifndef GPOM_CODEC_WIRE_H
#define GPOM_CODEC_WIRE_H

#include "gpom/status.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Most payload of a UDP datagram that fits one Ethernet frame, so that IP does not fragment it. */
#define GPOM_WIRE_DATAGRAM_BYTES 1472u

/** Longest channel name without its NUL (LCM's limit). */
#define GPOM_WIRE_CHANNEL_MAX 63u

/** Why bytes are not a message, or why a struct cannot be written as one. Each fault has one cause,
 *  so that it can be counted. */
typedef enum {
    GPOM_WIRE_OK = 0,
    GPOM_WIRE_ARG,      /**< Error of the caller: a null pointer. */
    GPOM_WIRE_TYPE,     /**< Another fingerprint, or not an LCM datagram. */
    GPOM_WIRE_SHORT,    /**< The bytes end before the message does. */
    GPOM_WIRE_LONG,     /**< Bytes are left after the message. */
    GPOM_WIRE_CRC,      /**< Damaged on the way: the CRC-32 is wrong (gpom's own types). */
    GPOM_WIRE_COUNT,    /**< A count is negative, or two counts that must agree differ. */
    GPOM_WIRE_CAPACITY, /**< More elements or bytes than the receiving memory holds. */
    GPOM_WIRE_VALUE,    /**< A field has a value that its definition does not allow. */
    GPOM_WIRE_FAULTS    /**< Number of values above, for arrays of counters. */
} gpom_wire_fault_t;

/** One line of English for a fault. Never NULL. The text has static storage. */
const char *gpom_wire_fault_str(gpom_wire_fault_t fault);

/** First 8 bytes of a message, which identify its type. 0 if there are fewer bytes. No type has
 *  fingerprint 0. */
uint64_t gpom_wire_fingerprint(const uint8_t *bytes, size_t n_bytes);

/** Floats in the caller's array. Decoding: the array has room for n_max elements, and n is set. If
 *  `values` is NULL, the elements are skipped, whatever their number. Encoding: n values are
 *  written, and n_max is not used. */
typedef struct {
    float *values;
    uint32_t n_max;
    uint32_t n;
} gpom_wire_floats_t;

/** Times [us] in the caller's array. Used in the same way as gpom_wire_floats_t. */
typedef struct {
    int64_t *values;
    uint32_t n_max;
    uint32_t n;
} gpom_wire_times_t;

#ifdef __cplusplus
}
#endif
#endif
