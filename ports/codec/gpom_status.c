#include "ports/codec/gpom_status.h"

#include "ports/codec/cursor.h"

static void status_fields(gpom_cursor_t *c, gpom_wire_status_t *m)
{
    gpom_cursor_i64(c, &m->stamp_us);
    gpom_cursor_u32(c, &m->sequence);
    gpom_cursor_u8(c, &m->state);
    gpom_cursor_require(c, m->state <= GPOM_WIRE_STATE_STOPPING, GPOM_WIRE_VALUE);
    gpom_cursor_i32(c, &m->version);
    gpom_cursor_i32(c, &m->map_format);
    gpom_cursor_i32(c, &m->frame_epoch);
    gpom_cursor_i64(c, &m->uptime_us);
    gpom_cursor_i64(c, &m->scan_stamp_us);
    gpom_cursor_i64(c, &m->scan_lag_us);
    gpom_cursor_i64(c, &m->scan_lag_us_max);
    gpom_cursor_f32(c, &m->scan_rate_hz);
    gpom_cursor_f32(c, &m->pose_rate_hz);
    gpom_cursor_f32(c, &m->map_rate_hz);
    gpom_cursor_f32(c, &m->query_rate_hz);
    gpom_cursor_i32(c, &m->n_beams);
    gpom_cursor_i32(c, &m->beam_max);
    gpom_cursor_i32(c, &m->n_cells_dirty);
    gpom_cursor_i64(c, &m->map_bytes);
    gpom_cursor_i64(c, &m->process_bytes);
    for (int i = 0; i < GPOM_WIRE_COUNTS; ++i) {
        gpom_cursor_i64(c, &m->counts[i]);
    }
}

GPOM_WIRE_DEFINE(status, {GPOM_WIRE_STATUS_FINGERPRINT, true})
