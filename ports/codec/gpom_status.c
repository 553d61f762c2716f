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

GPOM_WIRE_DEFINE_DECODE(gpom_wire_status_decode, gpom_wire_status_t, status_fields,
                        GPOM_WIRE_STATUS_FINGERPRINT, true)
GPOM_WIRE_DEFINE_ENCODE(gpom_wire_status_encode, gpom_wire_status_t, status_fields,
                        GPOM_WIRE_STATUS_FINGERPRINT, true)

void gpom_wire_count_beams(const gpom_stats_t *stats, int64_t *counts)
{
    counts[GPOM_WIRE_BEAMS_HIT] = (int64_t)stats->beams_hit;
    counts[GPOM_WIRE_BEAMS_NO_RETURN] = (int64_t)stats->beams_no_return;
    counts[GPOM_WIRE_BEAMS_NAN] = (int64_t)stats->beams_nan;
    counts[GPOM_WIRE_BEAMS_NOT_POSITIVE] = (int64_t)stats->beams_not_positive;
    counts[GPOM_WIRE_BEAMS_TOO_NEAR] = (int64_t)stats->beams_too_near;
    counts[GPOM_WIRE_BEAMS_MASKED] = (int64_t)stats->beams_masked;
    counts[GPOM_WIRE_BEAMS_FULL] = (int64_t)stats->beams_redundant;
    counts[GPOM_WIRE_BEAMS_KNOWN] = (int64_t)stats->beams_known;
    counts[GPOM_WIRE_BEAMS_CONTRADICTING] = (int64_t)stats->beams_contradicting;
    counts[GPOM_WIRE_BEAMS_IDS_SPENT] = (int64_t)stats->beams_ids_spent;
    counts[GPOM_WIRE_KEPT_EVICTED] =
        (int64_t)(stats->beams_evicted_redundant + stats->beams_evicted_far +
                  stats->beams_evicted_old + stats->beams_evicted_contradicted);
}
