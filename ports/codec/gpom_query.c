#include "ports/codec/gpom_query.h"

#include "ports/codec/cursor.h"
#include "ports/codec/gpom_map.h"

enum { POINT_BYTES = 16, POINT_ANSWER_BYTES = 13 };

/* Read or write the number of points. True if the message has room for so many points. */
static bool points_count(gpom_cursor_t *c, uint32_t *n_points, bool has_array, size_t element_bytes)
{
    gpom_cursor_count(c, n_points);
    gpom_cursor_require(c, *n_points <= GPOM_WIRE_POINTS_MAX, GPOM_WIRE_CAPACITY);
    gpom_cursor_require(c, has_array || *n_points == 0, GPOM_WIRE_ARG);
    return c->fault == GPOM_WIRE_OK && gpom_cursor_has(c, *n_points, element_bytes);
}

static void query_fields(gpom_cursor_t *c, gpom_wire_query_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_i64(c, &m->client);
    gpom_cursor_u32(c, &m->sequence);
    gpom_cursor_u8(c, &m->kind);
    gpom_cursor_require(c, m->kind <= GPOM_WIRE_QUERY_PATH, GPOM_WIRE_VALUE);
    gpom_cursor_f32(c, &m->step_m);
    if (!points_count(c, &m->n_points, m->points != NULL, POINT_BYTES)) {
        m->n_points = 0;
        return;
    }
    for (uint32_t i = 0; i < m->n_points; ++i) {
        gpom_cursor_f64(c, &m->points[i].x_m);
        gpom_cursor_f64(c, &m->points[i].y_m);
    }
}

static void point_answer_fields(gpom_cursor_t *c, gpom_answer_t *answer)
{
    gpom_cursor_f32(c, &answer->mean);
    gpom_cursor_f32(c, &answer->variance);
    gpom_cursor_f32(c, &answer->probability);
    gpom_cursor_u8(c, &answer->cls);
    gpom_cursor_require(c, answer->cls <= GPOM_WIRE_UNKNOWN, GPOM_WIRE_VALUE);
}

static void answer_fields(gpom_cursor_t *c, gpom_wire_answer_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_i64(c, &m->map_stamp_us);
    gpom_cursor_i64(c, &m->client);
    gpom_cursor_u32(c, &m->sequence);
    gpom_cursor_i32(c, &m->frame_epoch);
    gpom_cursor_u8(c, &m->status);
    gpom_cursor_require(c, m->status <= GPOM_WIRE_ANSWER_NO_CRC, GPOM_WIRE_VALUE);
    if (!points_count(c, &m->n_points, m->points != NULL, POINT_ANSWER_BYTES)) {
        m->n_points = 0;
        return;
    }
    for (uint32_t i = 0; i < m->n_points; ++i) {
        if (c->to == NULL) { /* fields that are not in the message */
            m->points[i].flags = m->points[i].n_hits = m->points[i].n_free = 0;
        }
        point_answer_fields(c, &m->points[i]);
    }
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_query_decode, gpom_wire_query_t, query_fields,
                        GPOM_WIRE_QUERY_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_query_encode, gpom_wire_query_t, query_fields,
                        GPOM_WIRE_QUERY_FINGERPRINT, true)
GPOM_WIRE_DEFINE_DECODE(gpom_wire_answer_decode, gpom_wire_answer_t, answer_fields,
                        GPOM_WIRE_ANSWER_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_answer_encode, gpom_wire_answer_t, answer_fields,
                        GPOM_WIRE_ANSWER_FINGERPRINT, true)

gpom_wire_fault_t gpom_wire_query_decode_without_crc(gpom_wire_query_t *message,
                                                     const uint8_t *bytes, size_t n_bytes)
{
    if (message == NULL || bytes == NULL) {
        return GPOM_WIRE_ARG;
    }
    const gpom_wire_type_t type = {GPOM_WIRE_QUERY_FINGERPRINT, false};
    gpom_cursor_t c = gpom_cursor_read(bytes, n_bytes, type);
    uint32_t crc = 0;
    query_fields(&c, message);
    gpom_cursor_u32(&c, &crc);
    gpom_cursor_require(&c, crc == 0, GPOM_WIRE_CRC);
    return gpom_cursor_end(&c);
}
