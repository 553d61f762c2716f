/** \file cursor.h
 *  A place in a message that is read or written: one list of fields serves both directions.
 *
 *  Internal to the codec. The first fault stays; after it nothing more is read or written, and
 *  whatever is read is 0. So a list of fields needs no check of its own, and loops over counts that
 *  were read end at once. */
#ifndef GPOM_CODEC_CURSOR_H
#define GPOM_CODEC_CURSOR_H

#include "ports/codec/wire.h"

#include <stdbool.h>

typedef struct {
    const uint8_t *from; /* start of the message when reading, else NULL */
    uint8_t *to;         /* start of the message when writing, else NULL */
    size_t at;           /* next byte */
    size_t end;          /* no byte from here on is touched */
    bool has_crc;        /* the message ends in a CRC-32 over all before it */
    gpom_wire_fault_t fault;
} gpom_cursor_t;

/** What a type is on the wire. */
typedef struct {
    uint64_t fingerprint;
    bool has_crc;
} gpom_wire_type_t;

/** Begin: the fingerprint is read and compared, or written; a CRC-32 is checked first. */
gpom_cursor_t gpom_cursor_read(const uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type);
gpom_cursor_t gpom_cursor_write(uint8_t *bytes, size_t n_bytes, gpom_wire_type_t type);

/** End of reading: nothing may be left. */
gpom_wire_fault_t gpom_cursor_end(gpom_cursor_t *c);
/** End of writing: adds the CRC-32; bytes written, 0 after any fault. */
size_t gpom_cursor_bytes(gpom_cursor_t *c);

/** A fault unless `holds`. */
void gpom_cursor_require(gpom_cursor_t *c, bool holds, gpom_wire_fault_t fault);

void gpom_cursor_u8(gpom_cursor_t *c, uint8_t *value);
void gpom_cursor_u16(gpom_cursor_t *c, uint16_t *value);
void gpom_cursor_u32(gpom_cursor_t *c, uint32_t *value);
void gpom_cursor_i32(gpom_cursor_t *c, int32_t *value);
void gpom_cursor_i64(gpom_cursor_t *c, int64_t *value);
void gpom_cursor_f32(gpom_cursor_t *c, float *value);
void gpom_cursor_f64(gpom_cursor_t *c, double *value);

/** Fixed numbers of elements. */
void gpom_cursor_f32s(gpom_cursor_t *c, float *values, size_t n);
void gpom_cursor_f64s(gpom_cursor_t *c, double *values, size_t n);

/** A count: int32 on the wire, not negative. */
void gpom_cursor_count(gpom_cursor_t *c, uint32_t *n);
/** A second array of `n` elements whose count is not sent again: set, or compared when writing. */
void gpom_cursor_same_count(gpom_cursor_t *c, uint32_t *n_other, uint32_t n);

/** n elements of element_bytes still to come: a fault if they cannot, before any is touched. */
bool gpom_cursor_has(gpom_cursor_t *c, uint32_t n, size_t element_bytes);

/** values->n elements, the count not included. */
void gpom_cursor_floats(gpom_cursor_t *c, gpom_wire_floats_t *floats);
void gpom_cursor_times(gpom_cursor_t *c, gpom_wire_times_t *times);

/** n bytes: a view into the message when reading, copied into it when writing. */
void gpom_cursor_bytes_view(gpom_cursor_t *c, const uint8_t **bytes, uint32_t n);

/** Defines the function `decode` that reads a message of type `message_t`; `fields` lists its
 *  fields. Names are given whole, so that a search finds them. */
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

/** The same of the function `encode` that writes it. */
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

#endif
