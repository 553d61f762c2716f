/** \file frame.h
 *  Checked frames on a serial line. Each frame holds one LCM datagram. The reader finds the next
 *  frame after any disturbance.
 *
 *  A frame on the line:  0, COBS(body), 0
 *  Its body:             u16 bytes of the datagram, u16 number of the frame, the datagram,
 *                        u32 CRC-32 (gpom/crc32.h) of all bytes of the body before it.
 *  Numbers are big-endian, as in LCM's datagrams.
 *
 *  COBS (Cheshire and Baker 1999) removes the zeros from the body. The body is cut behind each zero
 *  and after 254 bytes without a zero. A piece with n bytes other than zero is sent as the byte
 *  n + 1 and these n bytes. So a zero on the line always ends a frame. A reader that starts in the
 *  middle of a frame, or after noise, reads correctly again after the next zero.
 *
 *  Frames have the numbers 0, 1, 2, ... 65535, 1, 2, ... Number 0 is the first frame of a sender.
 *  It never counts as repeated, and no frames before it count as lost. A frame with the number of
 *  one of the GPOM_UART_FRAME_WINDOW newest frames is a repeated one. */
#ifndef GPOM_UART_FRAME_H
#define GPOM_UART_FRAME_H

#include "ports/codec/wire.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Bytes of a body in addition to its datagram. */
#define GPOM_UART_BODY_BYTES 8u

/** A frame whose number is at most this far behind the newest one counts as repeated. */
#define GPOM_UART_FRAME_WINDOW 32u

/** Most bytes of a frame on the line, for a datagram of n_bytes. */
#define GPOM_UART_FRAME_BYTES(n_bytes)                                                             \
    ((size_t)(n_bytes) + GPOM_UART_BODY_BYTES + ((size_t)(n_bytes) + GPOM_UART_BODY_BYTES) / 254 + \
     3)

/** Counters of frames, by cause. They only rise. Each sequence of bytes between zeros counts once.
 */
typedef struct {
    uint64_t frames_received; /**< Passed on. */
    uint64_t frames_short;    /**< Dropped: fewer bytes than its length or its COBS code says. */
    uint64_t frames_long;     /**< Dropped: more bytes than its length says or the memory holds. */
    uint64_t frames_corrupt;  /**< Dropped: the CRC-32 is wrong. */
    uint64_t frames_repeated; /**< Dropped: its number came before. */
    uint64_t frames_lost;     /**< Numbers that did not come. */
} gpom_uart_frame_stats_t;

/** A datagram and the number of its frame. */
typedef struct {
    const uint8_t *datagram; /**< View into the reader's memory. Valid until the next byte. */
    uint32_t n_bytes;
    uint16_t number;
} gpom_uart_frame_t;

/** Finds frames in the bytes of a line. The caller may read `stats` only. */
typedef struct {
    gpom_uart_frame_stats_t stats;
    uint8_t *body;
    uint32_t body_max;
    uint32_t n_body;  /* bytes of the body so far */
    uint32_t n_piece; /* bytes of the present COBS piece that are still to come */
    uint16_t newest;
    bool has_code;     /* a piece has begun: at least one byte came since the last zero */
    bool is_zero_next; /* the body has a zero between this piece and the next */
    bool is_too_long;  /* the body exceeds body_max */
    bool has_newest;
} gpom_uart_frame_reader_t;

/** Make a reader for datagrams of up to body_max - GPOM_UART_BODY_BYTES bytes. `body` belongs to
 *  the caller and must outlive the reader. */
void gpom_uart_frame_reader_init(gpom_uart_frame_reader_t *reader, uint8_t *body,
                                 uint32_t body_max);

/** Take the next byte of the line, which may be any byte. True if it completes a frame that is
 *  whole and not repeated.
 *  Cost: a few instructions. At the end of a frame also its CRC-32, 2 steps per byte. */
bool gpom_uart_frame_read(gpom_uart_frame_reader_t *reader, uint8_t byte, gpom_uart_frame_t *frame);

/** Write a frame. Its number is 0 or comes from gpom_uart_frame_next_number(). Returns the bytes
 *  written, at most GPOM_UART_FRAME_BYTES(n_bytes). 0 if they do not fit, n_bytes exceeds 65535, or
 *  a pointer is NULL. */
GPOM_NODISCARD size_t gpom_uart_frame_write(const gpom_uart_frame_t *frame, uint8_t *bytes,
                                            size_t n_max);

/** The number of the frame after frame `number`. */
uint16_t gpom_uart_frame_next_number(uint16_t number);

#ifdef __cplusplus
}
#endif
#endif
