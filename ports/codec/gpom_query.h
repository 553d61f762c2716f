/** \file gpom_query.h
 *  gpom.query_t and gpom.answer_t: queries to the map and their answers. */
#ifndef GPOM_CODEC_GPOM_QUERY_H
#define GPOM_CODEC_GPOM_QUERY_H

#include "gpom/query.h"
#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_QUERY_FINGERPRINT UINT64_C(0xdbecc97130af3fa6)
#define GPOM_WIRE_ANSWER_FINGERPRINT UINT64_C(0xefc9f7a58845fac3)

/** Most points of a query and of an answer. Both fit one datagram. The limit also bounds the work
 *  that a client can ask for at once. */
#define GPOM_WIRE_POINTS_MAX 80u

/** Bytes of an encoded query and answer. */
#define GPOM_WIRE_QUERY_BYTES(n_points) ((size_t)41 + (size_t)16 * (size_t)(n_points))
#define GPOM_WIRE_ANSWER_BYTES(n_points) ((size_t)49 + (size_t)13 * (size_t)(n_points))

typedef enum { GPOM_WIRE_QUERY_POINTS = 0, GPOM_WIRE_QUERY_PATH = 1 } gpom_wire_query_kind_t;

typedef enum {
    GPOM_WIRE_ANSWER_OK = 0,
    GPOM_WIRE_ANSWER_TOO_MANY = 1,
    GPOM_WIRE_ANSWER_BAD_STEP = 2,
    GPOM_WIRE_ANSWER_OUT_OF_REACH = 3,
    GPOM_WIRE_ANSWER_NO_CRC = 4
} gpom_wire_answer_status_t;

/** lcmtypes/gpom_query_t.lcm. */
typedef struct {
    int64_t stamp_us;
    int64_t client;
    uint32_t sequence;
    uint8_t kind; /**< gpom_wire_query_kind_t. */
    float step_m;
    gpom_point_t *points; /**< Caller's array, of GPOM_WIRE_POINTS_MAX elements when decoding. */
    uint32_t n_points;
} gpom_wire_query_t;

/** lcmtypes/gpom_answer_t.lcm. For each point the message holds mean, variance, probability and
 *  cls. */
typedef struct {
    int64_t stamp_us;
    int64_t map_stamp_us;
    int64_t client;
    uint32_t sequence;
    int32_t frame_epoch;
    uint8_t status;        /**< gpom_wire_answer_status_t. */
    gpom_answer_t *points; /**< Caller's array, of GPOM_WIRE_POINTS_MAX elements when decoding. */
    uint32_t n_points;
} gpom_wire_answer_t;

/** Read a message. Set `points` before. Besides the faults of every message there are
 *  GPOM_WIRE_CAPACITY (more than GPOM_WIRE_POINTS_MAX points) and GPOM_WIRE_VALUE (unknown kind,
 *  status or class). After a fault only `points` is valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_query_decode(gpom_wire_query_t *message,
                                                        const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_answer_decode(gpom_wire_answer_t *message,
                                                         const uint8_t *bytes, size_t n_bytes);

/** Read a query whose sender did not compute the CRC-32. The typed publish function that lcm-gen
 *  generates does not compute it. crc32 must be 0. Damage of the message is not detected then. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_query_decode_without_crc(gpom_wire_query_t *message,
                                                                    const uint8_t *bytes,
                                                                    size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit, a pointer is missing, or the
 *  decoder would refuse a field. */
GPOM_NODISCARD size_t gpom_wire_query_encode(const gpom_wire_query_t *message, uint8_t *bytes,
                                             size_t n_bytes);
GPOM_NODISCARD size_t gpom_wire_answer_encode(const gpom_wire_answer_t *message, uint8_t *bytes,
                                              size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
