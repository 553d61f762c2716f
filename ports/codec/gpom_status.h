/** \file gpom_status.h
 *  gpom.status_t: state, rates and counters of the mapping program. */
#ifndef GPOM_CODEC_GPOM_STATUS_H
#define GPOM_CODEC_GPOM_STATUS_H

#include "gpom/map.h"
#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_STATUS_FINGERPRINT UINT64_C(0x9c14d72b736bf503)

/** Bytes of an encoded status. */
#define GPOM_WIRE_STATUS_BYTES ((size_t)817)

typedef enum {
    GPOM_WIRE_STATE_STARTING = 0,
    GPOM_WIRE_STATE_MAPPING = 1,
    GPOM_WIRE_STATE_STALE = 2,
    GPOM_WIRE_STATE_STOPPING = 3
} gpom_wire_state_t;

/** Indices of gpom_wire_status_t.counts. lcmtypes/gpom_status_t.lcm says what each one counts. */
enum {
    GPOM_WIRE_SCANS_RECEIVED = 0,
    GPOM_WIRE_SCANS_INSERTED = 1,
    GPOM_WIRE_SCANS_BAD_POSE = 2,
    GPOM_WIRE_SCANS_OUT_OF_REACH = 3,
    GPOM_WIRE_SCANS_OTHER_TYPE = 4,
    GPOM_WIRE_SCANS_CORRUPT = 5,
    GPOM_WIRE_SCANS_MALFORMED = 6,
    GPOM_WIRE_SCANS_LOST = 7,
    GPOM_WIRE_SCANS_REPEATED = 8,
    GPOM_WIRE_SCANS_REORDERED = 9,
    GPOM_WIRE_SCANS_TOO_OLD = 10,
    GPOM_WIRE_SCANS_TOO_NEW = 11,
    GPOM_WIRE_SCANS_JUMPED_BACK = 12,
    GPOM_WIRE_SCANS_NO_POSE = 13,
    GPOM_WIRE_SCANS_OVERRUN = 14,
    GPOM_WIRE_TIME_GAPS = 15,
    GPOM_WIRE_POSES_RECEIVED = 16,
    GPOM_WIRE_POSES_REFUSED = 17,
    GPOM_WIRE_FRAME_JUMPS = 18,
    GPOM_WIRE_SCANS_AT_JUMP = 19,
    GPOM_WIRE_POSES_AT_JUMP = 20,
    GPOM_WIRE_BEAMS_HIT = 24,
    GPOM_WIRE_BEAMS_NO_RETURN = 25,
    GPOM_WIRE_BEAMS_NAN = 26,
    GPOM_WIRE_BEAMS_NOT_POSITIVE = 27,
    GPOM_WIRE_BEAMS_TOO_NEAR = 28,
    GPOM_WIRE_BEAMS_MASKED = 29,
    GPOM_WIRE_BEAMS_FULL = 30,
    GPOM_WIRE_BEAMS_KNOWN = 31,
    GPOM_WIRE_BEAMS_CONTRADICTING = 32,
    GPOM_WIRE_BEAMS_IDS_SPENT = 33,
    GPOM_WIRE_KEPT_EVICTED = 34,
    GPOM_WIRE_MAPS_PUBLISHED = 40,
    GPOM_WIRE_TILES_PUBLISHED = 41,
    GPOM_WIRE_QUERIES_ANSWERED = 42,
    GPOM_WIRE_QUERIES_REFUSED = 43,
    GPOM_WIRE_SNAPSHOTS_WRITTEN = 44,
    GPOM_WIRE_SNAPSHOTS_FAILED = 45,
    GPOM_WIRE_GRIDS_NOT_SENT = 46,
    GPOM_WIRE_CAN_RECEIVED = 48,
    GPOM_WIRE_CAN_BAD_LENGTH = 49,
    GPOM_WIRE_CAN_BAD_CRC = 50,
    GPOM_WIRE_CAN_BAD_COUNTER = 51,
    GPOM_WIRE_CAN_BAD_VALUE = 52,
    GPOM_WIRE_CAN_LOST = 53,
    GPOM_WIRE_CAN_REORDERED = 54,
    GPOM_WIRE_CAN_ERRORS = 55,
    GPOM_WIRE_CAN_BUS_OFFS = 56,
    GPOM_WIRE_CAN_OVERFLOWS = 57,
    GPOM_WIRE_CAN_DOWNS = 58,
    GPOM_WIRE_CAN_SENT = 59,
    GPOM_WIRE_CAN_NOT_SENT = 60,
    GPOM_WIRE_ODOMETRY_GAPS = 61,
    GPOM_WIRE_MAVLINK_SENT = 62,
    GPOM_WIRE_MAVLINK_NOT_SENT = 63,
    GPOM_WIRE_FRAMES_RECEIVED = 64,
    GPOM_WIRE_FRAMES_SHORT = 65,
    GPOM_WIRE_FRAMES_LONG = 66,
    GPOM_WIRE_FRAMES_CORRUPT = 67,
    GPOM_WIRE_FRAMES_REPEATED = 68,
    GPOM_WIRE_FRAMES_LOST = 69,
    GPOM_WIRE_DATAGRAMS_REFUSED = 70,
    GPOM_WIRE_MESSAGES_INCOMPLETE = 71,
    GPOM_WIRE_MESSAGES_OTHER = 72,
    GPOM_WIRE_LINE_OVERRUNS = 73,
    GPOM_WIRE_WATCHDOG_RESETS = 74,
    GPOM_WIRE_DATAGRAMS_LOST = 75,
    GPOM_WIRE_DATAGRAMS_OTHER = 76,
    GPOM_WIRE_DATAGRAMS_MALFORMED = 77,
    GPOM_WIRE_FRAGMENTS_OVERLONG = 78,
    GPOM_WIRE_FRAGMENTS_INCONSISTENT = 79,
    GPOM_WIRE_FRAGMENTS_REPEATED = 80,
    GPOM_WIRE_FRAGMENTS_LATE = 81,
    GPOM_WIRE_MESSAGES_TIMED_OUT = 82,
    GPOM_WIRE_MESSAGES_EVICTED = 83,
    GPOM_WIRE_MESSAGES_NOT_SENT = 84,
    GPOM_WIRE_PROBLEMS = 87,
    GPOM_WIRE_COUNTS = 88
};

/** Bit numbers of gpom_wire_status_t.counts[GPOM_WIRE_PROBLEMS], from the lowest bit on.
 *  lcmtypes/gpom_status_t.lcm says what each one means. */
enum {
    GPOM_WIRE_PROBLEM_SCAN_TYPE = 0,
    GPOM_WIRE_PROBLEM_SCAN_CRC_ZERO = 1,
    GPOM_WIRE_PROBLEM_SCAN_CORRUPT = 2,
    GPOM_WIRE_PROBLEM_SCAN_LENGTH = 3,
    GPOM_WIRE_PROBLEM_SCAN_RANGES = 4,
    GPOM_WIRE_PROBLEM_SCAN_SENSOR_ID = 5,
    GPOM_WIRE_PROBLEM_SCAN_ANGLES = 6,
    GPOM_WIRE_PROBLEM_SCAN_BEAM_TIMES = 7,
    GPOM_WIRE_PROBLEM_STAMP_UNIT = 8,
    GPOM_WIRE_PROBLEM_STAMP_RANGE = 9,
    GPOM_WIRE_PROBLEM_SCAN_TOO_OLD = 10,
    GPOM_WIRE_PROBLEM_SCAN_TOO_NEW = 11,
    GPOM_WIRE_PROBLEM_SCAN_LOST = 12,
    GPOM_WIRE_PROBLEM_SCAN_REPEATED = 13,
    GPOM_WIRE_PROBLEM_SCAN_REORDERED = 14,
    GPOM_WIRE_PROBLEM_SCAN_BACK = 15,
    GPOM_WIRE_PROBLEM_SCAN_GAP = 16,
    GPOM_WIRE_PROBLEM_SCAN_OVERRUN = 17,
    GPOM_WIRE_PROBLEM_SCAN_BAD_POSE = 18,
    GPOM_WIRE_PROBLEM_SCAN_OUT_OF_REACH = 19,
    GPOM_WIRE_PROBLEM_SCAN_UNUSABLE = 20,
    GPOM_WIRE_PROBLEM_SCAN_NO_POSE = 21,
    GPOM_WIRE_PROBLEM_SCAN_POSE_GAP = 22,
    GPOM_WIRE_PROBLEM_SCAN_BEFORE_POSES = 23,
    GPOM_WIRE_PROBLEM_TWO_CLOCKS = 24,
    GPOM_WIRE_PROBLEM_LATENCY = 25,
    GPOM_WIRE_PROBLEM_POSE_TYPE = 26,
    GPOM_WIRE_PROBLEM_POSE_LENGTH = 27,
    GPOM_WIRE_PROBLEM_POSE_QUATERNION = 28,
    GPOM_WIRE_PROBLEM_POSE_NOT_FINITE = 29,
    GPOM_WIRE_PROBLEM_POSE_ORDER = 30,
    GPOM_WIRE_PROBLEM_POSE_TOO_NEW = 31,
    GPOM_WIRE_PROBLEM_POSE_WILD = 32,
    GPOM_WIRE_PROBLEM_SILENT = 33,
    GPOM_WIRE_PROBLEM_OTHER_CHANNEL = 34,
    GPOM_WIRE_PROBLEM_TWO_MAPPERS = 35,
    GPOM_WIRE_PROBLEM_QUERY_REFUSED = 36,
    GPOM_WIRE_PROBLEM_SNAPSHOT_FAILED = 37,
    GPOM_WIRE_PROBLEM_NOT_SENT = 38,
    GPOM_WIRE_PROBLEM_DATAGRAMS_LOST = 39,
    GPOM_WIRE_PROBLEM_DATAGRAMS_BAD = 40,
    GPOM_WIRE_PROBLEM_MESSAGES_INCOMPLETE = 41,
    GPOM_WIRE_PROBLEM_CAN_FRAMES = 42,
    GPOM_WIRE_PROBLEM_CAN_BUS = 43,
    GPOM_WIRE_PROBLEM_MAVLINK = 44,
    GPOM_WIRE_PROBLEM_KINDS = 45
};

/** lcmtypes/gpom_status_t.lcm. */
typedef struct {
    int64_t stamp_us;
    uint32_t sequence;
    uint8_t state; /**< gpom_wire_state_t. */
    int32_t version;
    int32_t map_format;
    int32_t frame_epoch;
    int64_t uptime_us;
    int64_t scan_stamp_us;
    int64_t scan_lag_us;
    int64_t scan_lag_us_max;
    float scan_rate_hz;
    float pose_rate_hz;
    float map_rate_hz;
    float query_rate_hz;
    int32_t n_beams;
    int32_t beam_max;
    int32_t n_cells_dirty;
    int64_t map_bytes;
    int64_t process_bytes;
    int64_t counts[GPOM_WIRE_COUNTS];
} gpom_wire_status_t;

/** Read a message. GPOM_WIRE_VALUE means an unknown state. After a fault nothing in `message` is
 *  valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_status_decode(gpom_wire_status_t *message,
                                                         const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit, a pointer is missing, or the
 *  state is not known. */
GPOM_NODISCARD size_t gpom_wire_status_encode(const gpom_wire_status_t *message, uint8_t *bytes,
                                              size_t n_bytes);

/** Copy the map's counters of beams to gpom_wire_status_t.counts. Each range of an inserted scan
 *  counts in one of GPOM_WIRE_BEAMS_.... */
void gpom_wire_count_beams(const gpom_stats_t *stats, int64_t *counts);

#ifdef __cplusplus
}
#endif
#endif
