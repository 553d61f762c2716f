#include "ports/codec/occ_map.h"

#include "ports/codec/cursor.h"

/* Bytes of a pixel. 0 for an unknown kind. */
static uint32_t pixel_bytes(uint8_t pixel)
{
    switch (pixel) {
    case GPOM_WIRE_PIXEL_DOUBLE:
        return 8;
    case GPOM_WIRE_PIXEL_FLOAT:
    case GPOM_WIRE_PIXEL_INT32:
    case GPOM_WIRE_PIXEL_UINT32:
        return 4;
    case GPOM_WIRE_PIXEL_INT16:
    case GPOM_WIRE_PIXEL_UINT16:
        return 2;
    case GPOM_WIRE_PIXEL_INT8:
    case GPOM_WIRE_PIXEL_UINT8:
        return 1;
    default:
        return 0;
    }
}

static bool is_size_valid(const gpom_wire_pixel_map_t *m)
{
    const uint64_t n_pixels = (uint64_t)m->nx * m->ny; /* < 2^62, but 8 times this may overflow */
    return m->is_compressed == 1 ||
           (n_pixels <= m->n_bytes && n_pixels * pixel_bytes(m->pixel) == m->n_bytes);
}

static void pixel_map_fields(gpom_cursor_t *c, gpom_wire_pixel_map_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_count(c, &m->nx);
    gpom_cursor_count(c, &m->ny);
    gpom_cursor_f64s(c, m->centre0_m, 2);
    gpom_cursor_f64s(c, m->end_m, 2);
    gpom_cursor_f64(c, &m->cell_m);
    gpom_cursor_u8(c, &m->is_compressed);
    gpom_cursor_u8(c, &m->pixel);
    gpom_cursor_require(c, m->is_compressed <= 1 && pixel_bytes(m->pixel) != 0, GPOM_WIRE_VALUE);
    gpom_cursor_count(c, &m->n_bytes);
    gpom_cursor_require(c, is_size_valid(m), GPOM_WIRE_COUNT);
    gpom_cursor_bytes_view(c, &m->pixels, m->n_bytes);
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_pixel_map_decode, gpom_wire_pixel_map_t, pixel_map_fields,
                        GPOM_WIRE_PIXEL_MAP_FINGERPRINT, false)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_pixel_map_encode, gpom_wire_pixel_map_t, pixel_map_fields,
                        GPOM_WIRE_PIXEL_MAP_FINGERPRINT, false)
