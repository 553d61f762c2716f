#include "ports/codec/gpom_distances.h"

#include "ports/codec/cursor.h"

void gpom_wire_offset_put(uint8_t *offsets, uint32_t i, int16_t offset)
{
    const uint16_t bits = (uint16_t)offset;
    offsets[2 * i] = (uint8_t)(bits >> 8);
    offsets[2 * i + 1] = (uint8_t)(bits & 0xff);
}

int16_t gpom_wire_offset(const uint8_t *offsets, uint32_t i)
{
    const int32_t bits = offsets[2 * i] << 8 | offsets[2 * i + 1];
    return (int16_t)(bits < 0x8000 ? bits : bits - 0x10000);
}

static bool is_place_valid(const gpom_wire_distances_t *m)
{
    return m->map_nx <= INT16_MAX && m->map_ny <= INT16_MAX &&
           (uint32_t)m->ix0 + m->nx <= m->map_nx && (uint32_t)m->iy0 + m->ny <= m->map_ny;
}

/* True if an offset from column or row i of n leads to one of them. */
static bool is_inside(uint32_t i, int16_t offset, uint32_t n)
{
    const int32_t to = (int32_t)i + offset;
    return to >= 0 && to < (int32_t)n;
}

/* True if the offsets of all cells lead to cells of the map, or to none. */
static bool are_offsets_valid(const gpom_wire_distances_t *m, const uint8_t *dxs,
                              const uint8_t *dys, uint32_t n_cells)
{
    for (uint32_t i = 0; i < n_cells; ++i) {
        const int16_t dx = gpom_wire_offset(dxs, i);
        const int16_t dy = gpom_wire_offset(dys, i);
        const bool is_none = dx == GPOM_WIRE_OFFSET_NONE && dy == GPOM_WIRE_OFFSET_NONE;
        if (!is_none && (!is_inside(m->ix0 + i % m->nx, dx, m->map_nx) ||
                         !is_inside(m->iy0 + i / m->nx, dy, m->map_ny))) {
            return false;
        }
    }
    return true;
}

static void cells_fields(gpom_cursor_t *c, gpom_wire_distances_t *m)
{
    uint32_t n_cells = (uint32_t)m->nx * m->ny;
    gpom_cursor_count(c, &n_cells);
    gpom_cursor_require(c, n_cells == (uint32_t)m->nx * m->ny, GPOM_WIRE_COUNT);
    gpom_cursor_require(c, n_cells <= GPOM_WIRE_DISTANCES_CELLS_MAX, GPOM_WIRE_CAPACITY);
    gpom_cursor_bytes_view(c, &m->occupied_dx, 2 * n_cells);
    gpom_cursor_bytes_view(c, &m->occupied_dy, 2 * n_cells);
    gpom_cursor_bytes_view(c, &m->not_free_dx, 2 * n_cells);
    gpom_cursor_bytes_view(c, &m->not_free_dy, 2 * n_cells);
    if (c->fault == GPOM_WIRE_OK) {
        gpom_cursor_require(c,
                            are_offsets_valid(m, m->occupied_dx, m->occupied_dy, n_cells) &&
                                are_offsets_valid(m, m->not_free_dx, m->not_free_dy, n_cells),
                            GPOM_WIRE_VALUE);
    }
}

static void distances_fields(gpom_cursor_t *c, gpom_wire_distances_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_u32(c, &m->sequence);
    gpom_cursor_u16(c, &m->i_tile);
    gpom_cursor_u16(c, &m->n_tiles);
    gpom_cursor_u8(c, &m->keyframe);
    gpom_cursor_i32(c, &m->frame_epoch);
    gpom_cursor_f64s(c, m->corner_m, 2);
    gpom_cursor_f32(c, &m->cell_m);
    gpom_cursor_u16(c, &m->map_nx);
    gpom_cursor_u16(c, &m->map_ny);
    gpom_cursor_u16(c, &m->ix0);
    gpom_cursor_u16(c, &m->iy0);
    gpom_cursor_u16(c, &m->nx);
    gpom_cursor_u16(c, &m->ny);
    gpom_cursor_require(c, m->i_tile < m->n_tiles && m->n_tiles <= INT16_MAX && m->keyframe <= 1,
                        GPOM_WIRE_VALUE);
    gpom_cursor_require(c, is_place_valid(m), GPOM_WIRE_VALUE);
    cells_fields(c, m);
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_distances_decode, gpom_wire_distances_t, distances_fields,
                        GPOM_WIRE_DISTANCES_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_distances_encode, gpom_wire_distances_t, distances_fields,
                        GPOM_WIRE_DISTANCES_FINGERPRINT, true)
