/** \file gpom_query.h
 *  gpom.query_t and gpom.answer_t: questions to the map. */
#ifndef GPOM_CODEC_GPOM_QUERY_H
#define GPOM_CODEC_GPOM_QUERY_H

#include "gpom/query.h"
#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_QUERY_FINGERPRINT UINT64_C(0xdbecc97130af3fa6)
#define GPOM_WIRE_ANSWER_FINGERPRINT UINT64_C(0xefc9f7a58845fac3)

/** Most points of a query and of an answer: either fits one datagram, and no client can ask for
 *  more work at once. */
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
    gpom_point_t *points; /**< Caller's, GPOM_WIRE_POINTS_MAX when decoding. */
    uint32_t n_points;
} gpom_wire_query_t;

/** lcmtypes/gpom_answer_t.lcm. Of an answer's points travel mean, variance, probability, cls. */
typedef struct {
    int64_t stamp_us;
    int64_t map_stamp_us;
    int64_t client;
    uint32_t sequence;
    int32_t frame_epoch;
    uint8_t status;        /**< gpom_wire_answer_status_t. */
    gpom_answer_t *points; /**< Caller's, GPOM_WIRE_POINTS_MAX when decoding. */
    uint32_t n_points;
} gpom_wire_answer_t;

/** Read a message; set `points` before. Faults besides those of the bytes: GPOM_WIRE_CAPACITY (more
 *  than GPOM_WIRE_POINTS_MAX points), GPOM_WIRE_VALUE (unknown kind, status or class). After a
 *  fault only `points` may be relied on. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_query_decode(gpom_wire_query_t *message,
                                                        const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_answer_decode(gpom_wire_answer_t *message,
                                                         const uint8_t *bytes, size_t n_bytes);

/** The same of a query whose sender did not compute its CRC-32, as lcm-gen's typed publish does
 *  not: crc32 must be 0. Nothing tells then whether the message was damaged. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_query_decode_without_crc(gpom_wire_query_t *message,
                                                                    const uint8_t *bytes,
                                                                    size_t n_bytes);

/** Bytes written; 0 if they do not fit, a pointer is missing, or a field breaks what the decoder
 *  checks. */
GPOM_NODISCARD size_t gpom_wire_query_encode(const gpom_wire_query_t *message, uint8_t *bytes,
                                             size_t n_bytes);
GPOM_NODISCARD size_t gpom_wire_answer_encode(const gpom_wire_answer_t *message, uint8_t *bytes,
                                              size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
