/** \file frame.h
 *  Checked frames on a serial line: one LCM datagram each, found again after any disturbance.
 *
 *  A frame on the line:  0, COBS(body), 0
 *  Its body:             u16 bytes of the datagram, u16 number of the frame, the datagram,
 *                        u32 CRC-32 (gpom/crc32.h) of all bytes of the body before it.
 *  Numbers are big-endian, as in LCM's datagrams.
 *
 *  COBS (Cheshire and Baker 1999) takes the zeros out of the body: it is cut behind each zero and
 *  after 254 bytes without one; a piece of n bytes other than zero is sent as the byte n + 1 and
 *  these bytes. So a zero on the line always ends a frame, and a reader that joins in the middle,
 *  or after noise, is right again at the next one.
 *
 *  Frames are numbered 0, 1, 2, ... 65535, 1, 2, ...: number 0 is a sender's first, which neither
 *  repeats another nor tells of lost ones. A frame numbered like one of the GPOM_UART_FRAME_WINDOW
 *  newest is a repeated one. */
#ifndef GPOM_UART_FRAME_H
#define GPOM_UART_FRAME_H

#include "ports/codec/wire.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Bytes of a body besides its datagram. */
#define GPOM_UART_BODY_BYTES 8u

/** A frame numbered at most so many behind the newest one counts as repeated. */
#define GPOM_UART_FRAME_WINDOW 32u

/** Most bytes of a frame on the line, for a datagram of n_bytes. */
#define GPOM_UART_FRAME_BYTES(n_bytes)                                                             \
    ((size_t)(n_bytes) + GPOM_UART_BODY_BYTES + ((size_t)(n_bytes) + GPOM_UART_BODY_BYTES) / 254 + \
     3)

/** What came, by cause. Counters only rise; each sequence of bytes between zeros counts once. */
typedef struct {
    uint64_t frames_received; /**< Passed on. */
    uint64_t frames_short;    /**< Dropped: ends before its length or its coding says. */
    uint64_t frames_long;     /**< Dropped: goes on after its length, or exceeds the memory. */
    uint64_t frames_corrupt;  /**< Dropped: CRC-32 does not fit. */
    uint64_t frames_repeated; /**< Dropped: its number came before. */
    uint64_t frames_lost;     /**< Numbers that were left out. */
} gpom_uart_frame_stats_t;

/** A datagram out of a frame. */
typedef struct {
    const uint8_t *datagram; /**< View into the reader's memory until the next byte. */
    uint32_t n_bytes;
    uint16_t number;
} gpom_uart_frame_t;

/** Takes a line apart. Only `stats` is for reading. */
typedef struct {
    gpom_uart_frame_stats_t stats;
    uint8_t *body;
    uint32_t body_max;
    uint32_t n_body;  /* bytes of the body so far */
    uint32_t n_piece; /* bytes still to come of the piece of COBS */
    uint16_t newest;
    bool has_code;     /* a piece has begun: something came since the last zero */
    bool is_zero_next; /* a zero of the body stands between this piece and the next */
    bool is_too_long;  /* the body exceeds body_max */
    bool has_newest;
} gpom_uart_frame_reader_t;

/** Make a reader for datagrams of up to body_max - GPOM_UART_BODY_BYTES bytes in `body`, the
 *  caller's as long as the reader is used. */
void gpom_uart_frame_reader_init(gpom_uart_frame_reader_t *reader, uint8_t *body,
                                 uint32_t body_max);

/** Take the next byte of the line. True: a frame is whole and in order. Any bytes may come.
 *  Cost: a few instructions; at a frame's end its CRC-32, 2 steps a byte. */
bool gpom_uart_frame_read(gpom_uart_frame_reader_t *reader, uint8_t byte, gpom_uart_frame_t *frame);

/** Write a frame; `number` as above (gpom_uart_frame_next_number()). Bytes written, at most
 *  GPOM_UART_FRAME_BYTES(n_bytes); 0 if they do not fit, n_bytes exceeds 65535, or a pointer is
 *  NULL. */
GPOM_NODISCARD size_t gpom_uart_frame_write(const gpom_uart_frame_t *frame, uint8_t *bytes,
                                            size_t n_max);

/** The number that follows. */
uint16_t gpom_uart_frame_next_number(uint16_t number);

#ifdef __cplusplus
}
#endif
#endif
