#include "ports/uart/frame.h"

#include "gpom/crc32.h"

#include <string.h>

enum { HEAD_BYTES = 4, CRC_BYTES = 4, PIECE_MAX = 254 };

static uint16_t read_u16(const uint8_t *at) { return (uint16_t)(at[0] << 8 | at[1]); }

static uint32_t read_u32(const uint8_t *at)
{
    return (uint32_t)read_u16(at) << 16 | read_u16(at + 2);
}

void gpom_uart_frame_reader_init(gpom_uart_frame_reader_t *reader, uint8_t *body, uint32_t body_max)
{
    memset(reader, 0, sizeof *reader);
    reader->body = body;
    reader->body_max = body_max;
}

static void take(gpom_uart_frame_reader_t *reader, uint8_t byte)
{
    if (reader->n_body < reader->body_max) {
        reader->body[reader->n_body++] = byte;
    } else {
        reader->is_too_long = true;
    }
}

/* True if a frame's number is new. Counts the numbers that are missing before it. */
static bool is_new(gpom_uart_frame_reader_t *reader, uint16_t number)
{
    if (reader->has_newest && number != 0) {
        /* Numbers run 1 .. 65535 and then start at 1 again. 0 is not one of them. */
        const uint32_t ahead = (number + 65535u - reader->newest) % 65535u;
        if (ahead == 0 || ahead >= 65535u - GPOM_UART_FRAME_WINDOW) {
            ++reader->stats.frames_repeated;
            return false;
        }
        reader->stats.frames_lost += ahead < 65535u / 2 ? ahead - 1 : 0; /* else: a new start */
    }
    reader->has_newest = true;
    reader->newest = number;
    return true;
}

/* A zero came. True if the bytes before it are a whole frame with a new number. */
static bool is_whole(gpom_uart_frame_reader_t *reader, gpom_uart_frame_t *frame)
{
    gpom_uart_frame_stats_t *const stats = &reader->stats;
    const uint8_t *const body = reader->body;
    if (reader->is_too_long) {
        ++stats->frames_long;
        return false;
    }
    if (reader->n_piece > 0 || reader->n_body < GPOM_UART_BODY_BYTES) {
        ++stats->frames_short;
        return false;
    }
    const uint32_t n_crc = reader->n_body - CRC_BYTES;
    const uint32_t n_bytes = read_u16(body);
    if (n_bytes != n_crc - HEAD_BYTES) {
        stats->frames_short += n_bytes > n_crc - HEAD_BYTES;
        stats->frames_long += n_bytes < n_crc - HEAD_BYTES;
        return false;
    }
    if (gpom_crc32(body, n_crc) != read_u32(body + n_crc)) {
        ++stats->frames_corrupt;
        return false;
    }
    frame->datagram = body + HEAD_BYTES;
    frame->n_bytes = n_bytes;
    frame->number = read_u16(body + 2);
    if (!is_new(reader, frame->number)) {
        return false;
    }
    ++stats->frames_received;
    return true;
}

bool gpom_uart_frame_read(gpom_uart_frame_reader_t *reader, uint8_t byte, gpom_uart_frame_t *frame)
{
    if (byte == 0) {
        const bool is_frame = reader->has_code && is_whole(reader, frame);
        reader->n_body = reader->n_piece = 0;
        reader->has_code = reader->is_zero_next = reader->is_too_long = false;
        return is_frame;
    }
    if (reader->n_piece > 0) {
        --reader->n_piece;
        take(reader, byte);
        return false;
    }
    if (reader->is_zero_next) {
        take(reader, 0);
    }
    reader->has_code = true;
    reader->n_piece = byte - 1u;
    reader->is_zero_next = reader->n_piece < PIECE_MAX;
    return false;
}

/* COBS while it is written. The first byte of a piece is left open until the length of the piece is
 * known. */
typedef struct {
    uint8_t *bytes;
    size_t n_max;
    size_t n;
    size_t i_piece;
    uint32_t crc;
} line_t;

static void line_byte(line_t *line, uint8_t byte)
{
    if (line->n < line->n_max) {
        line->bytes[line->n] = byte;
    }
    ++line->n;
}

static void piece_end(line_t *line)
{
    if (line->i_piece < line->n_max) {
        line->bytes[line->i_piece] = (uint8_t)(line->n - line->i_piece);
    }
    line->i_piece = line->n;
    line_byte(line, 0); /* left open for the length of the next piece */
}

static void line_bytes(line_t *line, const uint8_t *bytes, size_t n_bytes)
{
    line->crc = gpom_crc32_continue(line->crc, bytes, n_bytes);
    for (size_t i = 0; i < n_bytes; ++i) {
        if (bytes[i] != 0) {
            line_byte(line, bytes[i]);
        }
        if (bytes[i] == 0 || line->n - line->i_piece > PIECE_MAX) {
            piece_end(line);
        }
    }
}

size_t gpom_uart_frame_write(const gpom_uart_frame_t *frame, uint8_t *bytes, size_t n_max)
{
    if (frame == NULL || bytes == NULL || frame->datagram == NULL || frame->n_bytes > 65535) {
        return 0;
    }
    line_t line = {bytes, n_max, 0, 1, 0};
    const uint8_t head[HEAD_BYTES] = {(uint8_t)(frame->n_bytes >> 8), (uint8_t)frame->n_bytes,
                                      (uint8_t)(frame->number >> 8), (uint8_t)frame->number};
    line_byte(&line, 0);
    line_byte(&line, 0); /* left open for the length of the first piece */
    line_bytes(&line, head, sizeof head);
    line_bytes(&line, frame->datagram, frame->n_bytes);
    const uint8_t crc[CRC_BYTES] = {(uint8_t)(line.crc >> 24), (uint8_t)(line.crc >> 16),
                                    (uint8_t)(line.crc >> 8), (uint8_t)line.crc};
    line_bytes(&line, crc, sizeof crc);
    piece_end(&line); /* the byte that it leaves open is the zero that ends the frame */
    return line.n <= n_max ? line.n : 0;
}

uint16_t gpom_uart_frame_next_number(uint16_t number)
{
    return number == UINT16_MAX ? 1 : (uint16_t)(number + 1);
}
