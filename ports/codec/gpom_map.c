#include "ports/codec/gpom_map.h"

#include "ports/codec/cursor.h"

enum { P_CODE_ONE = 254, V_CODE_ONE = 63 };

static bool is_place_valid(const gpom_wire_map_t *m)
{
    return m->map_nx <= INT16_MAX && m->map_ny <= INT16_MAX &&
           (uint32_t)m->ix0 + m->nx <= m->map_nx && (uint32_t)m->iy0 + m->ny <= m->map_ny;
}

/* True if every cell is either unknown in both of its codes or in neither. */
static bool are_codes_valid(const gpom_wire_map_t *m, uint32_t n_cells)
{
    for (uint32_t i = 0; i < n_cells; ++i) {
        const bool is_unknown = m->probability[i] == GPOM_WIRE_PROBABILITY_UNKNOWN;
        if (is_unknown != (gpom_wire_class(m->variance_class[i]) == GPOM_WIRE_UNKNOWN)) {
            return false;
        }
    }
    return true;
}

static void cells_fields(gpom_cursor_t *c, gpom_wire_map_t *m)
{
    uint32_t n_cells = (uint32_t)m->nx * m->ny;
    gpom_cursor_count(c, &n_cells);
    gpom_cursor_require(c, n_cells == (uint32_t)m->nx * m->ny, GPOM_WIRE_COUNT);
    gpom_cursor_require(c, n_cells <= GPOM_WIRE_MAP_CELLS_MAX, GPOM_WIRE_CAPACITY);
    gpom_cursor_bytes_view(c, &m->probability, n_cells);
    gpom_cursor_bytes_view(c, &m->variance_class, n_cells);
    if (c->fault == GPOM_WIRE_OK) {
        gpom_cursor_require(c, are_codes_valid(m, n_cells), GPOM_WIRE_VALUE);
    }
}

static void map_fields(gpom_cursor_t *c, gpom_wire_map_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_u32(c, &m->map_sequence);
    gpom_cursor_u16(c, &m->i_tile);
    gpom_cursor_u16(c, &m->n_tiles);
    gpom_cursor_u8(c, &m->keyframe);
    gpom_cursor_i32(c, &m->frame_epoch);
    gpom_cursor_f64s(c, m->pose, 3);
    gpom_cursor_f64s(c, m->corner_m, 2);
    gpom_cursor_f32(c, &m->cell_m);
    gpom_cursor_f32(c, &m->prior_variance);
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

GPOM_WIRE_DEFINE_DECODE(gpom_wire_map_decode, gpom_wire_map_t, map_fields,
                        GPOM_WIRE_MAP_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_map_encode, gpom_wire_map_t, map_fields,
                        GPOM_WIRE_MAP_FINGERPRINT, true)

uint8_t gpom_wire_probability_code(uint16_t probability_65535ths, uint8_t cls)
{
    if (cls >= GPOM_WIRE_UNKNOWN) {
        return GPOM_WIRE_PROBABILITY_UNKNOWN;
    }
    return (uint8_t)(((uint32_t)probability_65535ths * P_CODE_ONE + 65534u) / 65535u);
}

uint8_t gpom_wire_variance_class_code(uint8_t variance_255ths, uint8_t cls)
{
    const uint32_t variance = ((uint32_t)variance_255ths * V_CODE_ONE + 254u) / 255u;
    return (uint8_t)(variance << 2 | (cls >= GPOM_WIRE_UNKNOWN ? GPOM_WIRE_UNKNOWN : cls));
}

float gpom_wire_probability(uint8_t probability_code)
{
    return (float)probability_code / (float)P_CODE_ONE;
}

float gpom_wire_variance_fraction(uint8_t variance_class_code)
{
    return (float)(variance_class_code >> 2) / (float)V_CODE_ONE;
}

uint8_t gpom_wire_class(uint8_t variance_class_code) { return variance_class_code & 3u; }
