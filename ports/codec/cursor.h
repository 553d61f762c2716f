/** \file cursor.h
 *  A position in a message that is read or written. Reading and writing use the same list of
 *  fields.
 *
 *  Internal to the codec. The cursor keeps the first fault. After a fault nothing more is written,
 *  and every value that is read is 0. So a list of fields needs no checks of its own, and loops
 *  over counts that were read end at once. */
#ifndef GPOM_CODEC_CURSOR_H
#define GPOM_CODEC_CURSOR_H

#include "ports/codec/wire.h"

#include <stdbool.h>

typedef struct {
    const uint8_t *from; /* start of the message when reading, else NULL */
    uint8_t *to;         /* start of the message when writing, else NULL */
    size_t at;           /* offset of the next byte */
    size_t end;          /* bytes from this offset on are not read or written */
    bool has_crc;        /* the message ends with a CRC-32 over all bytes before it */
    gpom_wire_fault_t fault;
} gpom_cursor_t;

/** How a message type is identified and protected. */
typedef struct {
    uint64_t fingerprint;
    bool has_crc;
} gpom_wire_type_t;

/** Begin to read or write a message. Reading compares the fingerprint and checks the CRC-32.
 *  Writing writes the fingerprint. */
gpom_cursor_t gpom_cursor_read(const uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type);
gpom_cursor_t gpom_cursor_write(uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type);

/** End reading. Bytes that are left are a fault. */
gpom_wire_fault_t gpom_cursor_end(gpom_cursor_t *c);
/** End writing. Adds the CRC-32. Returns the bytes written, or 0 after any fault. */
size_t gpom_cursor_bytes(gpom_cursor_t *c);

/** Note a fault unless `holds`. */
void gpom_cursor_require(gpom_cursor_t *c, bool holds, gpom_wire_fault_t fault);

void gpom_cursor_u8(gpom_cursor_t *c, uint8_t *value);
void gpom_cursor_u16(gpom_cursor_t *c, uint16_t *value);
void gpom_cursor_u32(gpom_cursor_t *c, uint32_t *value);
void gpom_cursor_i32(gpom_cursor_t *c, int32_t *value);
void gpom_cursor_i64(gpom_cursor_t *c, int64_t *value);
void gpom_cursor_f32(gpom_cursor_t *c, float *value);
void gpom_cursor_f64(gpom_cursor_t *c, double *value);

/** n elements. The number is not in the message. */
void gpom_cursor_f32s(gpom_cursor_t *c, float *values, size_t n);
void gpom_cursor_f64s(gpom_cursor_t *c, double *values, size_t n);

/** A count. It is an int32 in the message and must not be negative. */
void gpom_cursor_count(gpom_cursor_t *c, uint32_t *n);
/** The number of elements of another array, which must be `n` and is not in the message. It is set
 *  when reading and compared when writing. */
void gpom_cursor_same_count(gpom_cursor_t *c, uint32_t *n_other, uint32_t n);

/** True if n elements of element_bytes still fit. Else it is a fault. Call it before the elements
 *  are read or written. */
bool gpom_cursor_has(gpom_cursor_t *c, uint32_t n, size_t element_bytes);

/** The elements of an array. Its number of elements is read or written before by
 *  gpom_cursor_count(). */
void gpom_cursor_floats(gpom_cursor_t *c, gpom_wire_floats_t *floats);
void gpom_cursor_times(gpom_cursor_t *c, gpom_wire_times_t *times);

/** n bytes. Reading sets *bytes to a view into the message. Writing copies them into the message.
 */
void gpom_cursor_bytes_view(gpom_cursor_t *c, const uint8_t **bytes, uint32_t n);

/* NOLINTBEGIN(bugprone-macro-parentheses): names of types and functions take no parentheses. */
/** Defines the function `decode`, which reads a message of type `message_t`. `fields` is the
 *  function that lists its fields. Function names are written in full, so that a search finds
 *  them. */
#define GPOM_WIRE_DEFINE_DECODE(decode, message_t, fields, fingerprint, has_crc)                   \
    gpom_wire_fault_t decode(message_t *message, const uint8_t *bytes, size_t n_bytes)             \
    {                                                                                              \
        if (message == NULL || bytes == NULL) {                                                    \
            return GPOM_WIRE_ARG;                                                                  \
        }                                                                                          \
        const gpom_wire_type_t type = {fingerprint, has_crc};                                      \
        gpom_cursor_t cursor = gpom_cursor_read(bytes, n_bytes, type);                             \
        fields(&cursor, message);                                                                  \
        return gpom_cursor_end(&cursor);                                                           \
    }

/** Defines the function `encode`, which writes a message of type `message_t`. */
#define GPOM_WIRE_DEFINE_ENCODE(encode, message_t, fields, fingerprint, has_crc)                   \
    size_t encode(const message_t *message, uint8_t *bytes, size_t n_bytes)                        \
    {                                                                                              \
        if (message == NULL || bytes == NULL) {                                                    \
            return 0;                                                                              \
        }                                                                                          \
        message_t copy = *message;                                                                 \
        const gpom_wire_type_t type = {fingerprint, has_crc};                                      \
        gpom_cursor_t cursor = gpom_cursor_write(bytes, n_bytes, type);                            \
        fields(&cursor, &copy);                                                                    \
        return gpom_cursor_bytes(&cursor);                                                         \
    }
/* NOLINTEND(bugprone-macro-parentheses) */

#endif
