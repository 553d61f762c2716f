#include "ports/codec/cursor.h"

#include "gpom/crc32.h"

#include <string.h>

enum { FINGERPRINT_BYTES = 8, CRC_BYTES = 4 };

static uint32_t big_endian(const uint8_t *bytes, size_t n_bytes)
{
    uint32_t value = 0;
    for (size_t i = 0; i < n_bytes; ++i) {
        value = (value << 8) | bytes[i];
    }
    return value;
}

static void fail(gpom_cursor_t *c, gpom_wire_fault_t fault)
{
    if (c->fault == GPOM_WIRE_OK) {
        c->fault = fault;
    }
    c->end = c->at;
}

void gpom_cursor_require(gpom_cursor_t *c, bool holds, gpom_wire_fault_t fault)
{
    if (!holds) {
        fail(c, fault);
    }
}

bool gpom_cursor_has(gpom_cursor_t *c, uint32_t n, size_t element_bytes)
{
    if (n > (c->end - c->at) / element_bytes) { /* a division: a product could overflow */
        fail(c, c->to != NULL ? GPOM_WIRE_CAPACITY : GPOM_WIRE_SHORT);
        return false;
    }
    return true;
}

/* 1 to 4 bytes, big-endian. */
static void number(gpom_cursor_t *c, uint32_t *value, size_t n_bytes)
{
    if (!gpom_cursor_has(c, 1, n_bytes)) {
        *value = 0;
        return;
    }
    if (c->to == NULL) {
        *value = big_endian(c->from + c->at, n_bytes);
    } else {
        for (size_t i = 0; i < n_bytes; ++i) {
            c->to[c->at + i] = (uint8_t)(*value >> (8 * (n_bytes - 1 - i)));
        }
    }
    c->at += n_bytes;
}

/* The value of a field when writing. 0 when reading, because the field may be uninitialised. */
#define VALUE_OF(c, value) ((c)->to != NULL ? *(value) : 0u)

static void number_64(gpom_cursor_t *c, uint64_t *value)
{
    uint32_t high = (uint32_t)(VALUE_OF(c, value) >> 32);
    uint32_t low = (uint32_t)VALUE_OF(c, value);
    if (!gpom_cursor_has(c, 1, 8)) { /* do not read or write only a half */
        *value = 0;
        return;
    }
    number(c, &high, 4);
    number(c, &low, 4);
    *value = (uint64_t)high << 32 | low;
}

gpom_cursor_t gpom_cursor_read(const uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type)
{
    gpom_cursor_t c = {bytes, NULL, 0, n_bytes, type.has_crc, GPOM_WIRE_OK};
    uint64_t fingerprint = 0;
    number_64(&c, &fingerprint);
    gpom_cursor_require(&c, fingerprint == type.fingerprint, GPOM_WIRE_TYPE);
    if (type.has_crc && gpom_cursor_has(&c, 1, CRC_BYTES)) {
        c.end -= CRC_BYTES;
        gpom_cursor_require(&c, big_endian(bytes + c.end, CRC_BYTES) == gpom_crc32(bytes, c.end),
                            GPOM_WIRE_CRC);
    }
    return c;
}

gpom_cursor_t gpom_cursor_write(uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type)
{
    gpom_cursor_t c = {NULL, bytes, 0, n_bytes, type.has_crc, GPOM_WIRE_OK};
    number_64(&c, &type.fingerprint);
    return c;
}

gpom_wire_fault_t gpom_cursor_end(gpom_cursor_t *c)
{
    gpom_cursor_require(c, c->at == c->end, GPOM_WIRE_LONG);
    return c->fault;
}

size_t gpom_cursor_bytes(gpom_cursor_t *c)
{
    if (c->has_crc && c->fault == GPOM_WIRE_OK) {
        uint32_t crc = gpom_crc32(c->to, c->at);
        number(c, &crc, CRC_BYTES);
    }
    return c->fault == GPOM_WIRE_OK ? c->at : 0;
}

void gpom_cursor_u8(gpom_cursor_t *c, uint8_t *value)
{
    uint32_t wide = VALUE_OF(c, value);
    number(c, &wide, 1);
    *value = (uint8_t)wide;
}

void gpom_cursor_u16(gpom_cursor_t *c, uint16_t *value)
{
    uint32_t wide = VALUE_OF(c, value);
    number(c, &wide, 2);
    *value = (uint16_t)wide;
}

void gpom_cursor_u32(gpom_cursor_t *c, uint32_t *value) { number(c, value, 4); }

void gpom_cursor_i32(gpom_cursor_t *c, int32_t *value)
{
    uint32_t bits = 0;
    if (c->to != NULL) {
        memcpy(&bits, value, sizeof bits);
    }
    number(c, &bits, 4);
    memcpy(value, &bits, sizeof bits);
}

void gpom_cursor_i64(gpom_cursor_t *c, int64_t *value)
{
    uint64_t bits = 0;
    if (c->to != NULL) {
        memcpy(&bits, value, sizeof bits);
    }
    number_64(c, &bits);
    memcpy(value, &bits, sizeof bits);
}

void gpom_cursor_f32(gpom_cursor_t *c, float *value)
{
    uint32_t bits = 0;
    if (c->to != NULL) {
        memcpy(&bits, value, sizeof bits);
    }
    number(c, &bits, 4);
    memcpy(value, &bits, sizeof bits);
}

void gpom_cursor_f64(gpom_cursor_t *c, double *value)
{
    uint64_t bits = 0;
    if (c->to != NULL) {
        memcpy(&bits, value, sizeof bits);
    }
    number_64(c, &bits);
    memcpy(value, &bits, sizeof bits);
}

void gpom_cursor_f32s(gpom_cursor_t *c, float *values, size_t n)
{
    for (size_t i = 0; i < n; ++i) {
        gpom_cursor_f32(c, &values[i]);
    }
}

void gpom_cursor_f64s(gpom_cursor_t *c, double *values, size_t n)
{
    for (size_t i = 0; i < n; ++i) {
        gpom_cursor_f64(c, &values[i]);
    }
}

void gpom_cursor_count(gpom_cursor_t *c, uint32_t *n)
{
    gpom_cursor_u32(c, n);
    if (*n > INT32_MAX) { /* negative on the wire */
        *n = 0;
        fail(c, GPOM_WIRE_COUNT);
    }
}

void gpom_cursor_same_count(gpom_cursor_t *c, uint32_t *n_other, uint32_t n)
{
    if (c->to == NULL) {
        *n_other = n;
    }
    gpom_cursor_require(c, *n_other == n, GPOM_WIRE_COUNT);
}

/* True if n elements must be copied between the message and the caller's array. Without an array,
 * elements are skipped when reading and are a fault when writing. */
static bool wants(gpom_cursor_t *c, bool has_array, uint32_t n, uint32_t n_max)
{
    if (has_array) {
        gpom_cursor_require(c, c->to != NULL || n <= n_max, GPOM_WIRE_CAPACITY);
        return c->fault == GPOM_WIRE_OK;
    }
    gpom_cursor_require(c, c->to == NULL || n == 0, GPOM_WIRE_ARG);
    return false;
}

void gpom_cursor_floats(gpom_cursor_t *c, gpom_wire_floats_t *floats)
{
    if (!gpom_cursor_has(c, floats->n, 4)) {
        floats->n = 0;
    } else if (wants(c, floats->values != NULL, floats->n, floats->n_max)) {
        gpom_cursor_f32s(c, floats->values, floats->n);
    } else if (c->fault == GPOM_WIRE_OK) {
        c->at += (size_t)4 * floats->n;
    }
}

void gpom_cursor_times(gpom_cursor_t *c, gpom_wire_times_t *times)
{
    if (!gpom_cursor_has(c, times->n, 8)) {
        times->n = 0;
    } else if (wants(c, times->values != NULL, times->n, times->n_max)) {
        for (uint32_t i = 0; i < times->n; ++i) {
            gpom_cursor_i64(c, &times->values[i]);
        }
    } else if (c->fault == GPOM_WIRE_OK) {
        c->at += (size_t)8 * times->n;
    }
}

void gpom_cursor_bytes_view(gpom_cursor_t *c, const uint8_t **bytes, uint32_t n)
{
    if (!gpom_cursor_has(c, n, 1)) {
        if (c->to == NULL) {
            *bytes = NULL;
        }
        return;
    }
    if (c->to == NULL) {
        *bytes = c->from + c->at;
    } else {
        gpom_cursor_require(c, *bytes != NULL || n == 0, GPOM_WIRE_ARG);
        if (c->fault != GPOM_WIRE_OK || n == 0) {
            return;
        }
        memcpy(c->to + c->at, *bytes, n);
    }
    c->at += n;
}
