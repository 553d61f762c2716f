#include "ports/codec/gpom_scan.h"

#include "ports/codec/cursor.h"

static void scan_fields(gpom_cursor_t *c, gpom_wire_scan_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_u32(c, &m->sequence);
    gpom_cursor_u16(c, &m->sensor_id);
    gpom_cursor_f64s(c, m->pose, 3);
    gpom_cursor_f32s(c, m->pose_cov, 9);
    gpom_cursor_f64(c, &m->angle_min_rad);
    gpom_cursor_f64(c, &m->angle_step_rad);
    gpom_cursor_count(c, &m->ranges_m.n);
    gpom_cursor_floats(c, &m->ranges_m);
}

GPOM_WIRE_DEFINE_DECODE(gpom_wire_scan_decode, gpom_wire_scan_t, scan_fields,
                        GPOM_WIRE_SCAN_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_scan_encode, gpom_wire_scan_t, scan_fields,
                        GPOM_WIRE_SCAN_FINGERPRINT, true)
