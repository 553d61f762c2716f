#include "ports/codec/datagram.h"

#include "ports/codec/cursor.h"

#include <string.h>

#define MAGIC_SHORT UINT32_C(0x4c433032)    /* LC02 */
#define MAGIC_FRAGMENT UINT32_C(0x4c433033) /* LC03 */

enum { UDP_BYTES_MAX = 65535, FRAGMENTS_MAX = 65535, MESSAGE_BYTES_MAX = 1 << 28 };

/* Bytes of a name including its NUL. 0 if no NUL is among the first n_max bytes. */
static uint32_t name_bytes(const char *name, size_t n_max)
{
    for (uint32_t i = 0; i < n_max; ++i) {
        if (name[i] == '\0') {
            return i + 1;
        }
    }
    return 0;
}

static uint32_t channel_bytes(const char *channel)
{
    return channel != NULL ? name_bytes(channel, GPOM_WIRE_CHANNEL_MAX + 1) : 0;
}

/* The fields of a fragment's header. Reading and writing both use this list. */
static void fragment_fields(gpom_cursor_t *c, gpom_wire_datagram_t *d)
{
    gpom_cursor_u32(c, &d->message_bytes);
    gpom_cursor_u32(c, &d->offset);
    gpom_cursor_u16(c, &d->i_fragment);
    gpom_cursor_u16(c, &d->n_fragments);
}

static void channel_read(gpom_cursor_t *c, gpom_wire_datagram_t *d)
{
    const size_t n_left = c->end - c->at;
    const size_t n_max = GPOM_WIRE_CHANNEL_MAX + 1;
    d->channel = (const char *)c->from + c->at;
    const uint32_t n = name_bytes(d->channel, n_left < n_max ? n_left : n_max);
    gpom_cursor_require(c, n > 0, n_left < n_max ? GPOM_WIRE_SHORT : GPOM_WIRE_VALUE);
    c->at += n;
}

/* True if the fragment lies inside its message. The first fragment must be at the start of the
 * message, and the last one at its end. */
static bool is_fragment_valid(const gpom_wire_datagram_t *d)
{
    const uint64_t end = (uint64_t)d->offset + d->payload_bytes;
    return d->i_fragment < d->n_fragments && end <= d->message_bytes &&
           (d->i_fragment > 0 || d->offset == 0) &&
           (d->i_fragment + 1 < d->n_fragments || end == d->message_bytes);
}

gpom_wire_fault_t gpom_wire_datagram_read(gpom_wire_datagram_t *datagram, const uint8_t *bytes,
                                          size_t n_bytes)
{
    if (datagram == NULL || bytes == NULL) {
        return GPOM_WIRE_ARG;
    }
    gpom_wire_datagram_t d = {NULL, NULL, 0, 0, 0, 0, 0, 0};
    gpom_cursor_t c = {bytes, NULL, 0, n_bytes, false, GPOM_WIRE_OK};
    uint32_t magic = 0;
    gpom_cursor_require(&c, n_bytes <= UDP_BYTES_MAX, GPOM_WIRE_LONG);
    gpom_cursor_u32(&c, &magic);
    const bool is_fragment = magic == MAGIC_FRAGMENT;
    gpom_cursor_require(&c, is_fragment || magic == MAGIC_SHORT, GPOM_WIRE_TYPE);
    gpom_cursor_u32(&c, &d.sequence);
    if (is_fragment) {
        fragment_fields(&c, &d);
    }
    if (c.fault == GPOM_WIRE_OK && d.i_fragment == 0) {
        channel_read(&c, &d);
    }
    if (c.fault != GPOM_WIRE_OK) {
        return c.fault;
    }
    d.payload = bytes + c.at;
    d.payload_bytes = (uint32_t)(c.end - c.at);
    if (!is_fragment) {
        d.message_bytes = d.payload_bytes;
    } else if (!is_fragment_valid(&d)) {
        return GPOM_WIRE_COUNT;
    }
    *datagram = d;
    return GPOM_WIRE_OK;
}

static void header_write(gpom_cursor_t *c, uint32_t magic, uint32_t sequence)
{
    gpom_cursor_u32(c, &magic);
    gpom_cursor_u32(c, &sequence);
}

size_t gpom_wire_datagram_begin(uint8_t *bytes, size_t n_bytes, const char *channel,
                                uint32_t sequence)
{
    const uint32_t n_channel = channel_bytes(channel);
    if (bytes == NULL || n_channel == 0) {
        return 0;
    }
    gpom_cursor_t c = {NULL, bytes, 0, n_bytes, false, GPOM_WIRE_OK};
    header_write(&c, MAGIC_SHORT, sequence);
    const uint8_t *name = (const uint8_t *)channel;
    gpom_cursor_bytes_view(&c, &name, n_channel);
    return gpom_cursor_bytes(&c);
}

/* Bytes after the header of each fragment except the last one, which may have fewer. In the first
 * fragment they begin with the channel name. */
static uint32_t fragment_bytes(const gpom_wire_outgoing_t *m)
{
    const uint32_t n = m->datagram_bytes_max;
    return n > GPOM_WIRE_FRAGMENT_HEADER_BYTES && n <= UDP_BYTES_MAX
               ? n - GPOM_WIRE_FRAGMENT_HEADER_BYTES
               : 0;
}

uint32_t gpom_wire_fragment_count(const gpom_wire_outgoing_t *message)
{
    if (message == NULL || message->payload == NULL || message->payload_bytes == 0 ||
        message->payload_bytes > MESSAGE_BYTES_MAX) {
        return 0;
    }
    const uint32_t n_channel = channel_bytes(message->channel);
    const uint32_t size = fragment_bytes(message);
    if (n_channel == 0 || size < n_channel) {
        return 0;
    }
    const uint32_t n = (message->payload_bytes + n_channel + size - 1) / size;
    return n <= FRAGMENTS_MAX ? n : 0;
}

size_t gpom_wire_fragment_write(const gpom_wire_outgoing_t *message, uint32_t i_fragment,
                                uint8_t *bytes, size_t n_bytes)
{
    const uint32_t n_fragments = gpom_wire_fragment_count(message);
    if (bytes == NULL || i_fragment >= n_fragments) {
        return 0;
    }
    const uint32_t size = fragment_bytes(message);
    const uint32_t n_channel = channel_bytes(message->channel);
    const uint32_t offset = i_fragment == 0 ? 0 : i_fragment * size - n_channel;
    const uint32_t room = i_fragment == 0 ? size - n_channel : size;
    const uint32_t n_left = message->payload_bytes - offset;
    gpom_wire_datagram_t d = {
        message->channel,     message->payload + offset, n_left < room ? n_left : room,
        message->sequence,    message->payload_bytes,    offset,
        (uint16_t)i_fragment, (uint16_t)n_fragments};
    gpom_cursor_t c = {NULL, bytes, 0, n_bytes, false, GPOM_WIRE_OK};
    header_write(&c, MAGIC_FRAGMENT, d.sequence);
    fragment_fields(&c, &d);
    if (i_fragment == 0) {
        const uint8_t *name = (const uint8_t *)d.channel;
        gpom_cursor_bytes_view(&c, &name, n_channel);
    }
    gpom_cursor_bytes_view(&c, &d.payload, d.payload_bytes);
    return gpom_cursor_bytes(&c);
}
