/** \file device.h
 *  A microcontroller that maps: LCM messages come over a serial line (frame.h), scans go into the
 *  live map, tiles of the low-resolution map and a status go back.
 *
 *  The application is the same on every processor; what it needs of one are the hooks of
 *  gpom_port_t. All memory is the caller's and fixed at the start. gpom_device_tick() is called for
 *  ever, by a main loop or a timer; what one call does is bounded.
 *
 *      in   GPOM_SCAN          gpom.scan_t of the one sensor
 *           GPOM_MAP_REQUEST   any bytes: a keyframe, please; at most one a second is sent
 *      out  GPOM_MAP           gpom.map_t: changed tiles, and all tiles now and then
 *           GPOM_STATUS        gpom.status_t
 *
 *  The device knows no calendar: a stamp that it gives is that of the newest scan in the map plus
 *  the time since that came, and 0 before the first; the status' lag is from a scan's last byte on.
 */
#ifndef GPOM_UART_DEVICE_H
#define GPOM_UART_DEVICE_H

#include "gpom/gpom.h"
#include "ports/codec/codec.h"
#include "ports/uart/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Cells of a tile; the last column and row of tiles may be smaller. */
#define GPOM_DEVICE_TILE_NX 32u
#define GPOM_DEVICE_TILE_NY 16u

/** Most tiles of a device's raster. */
#define GPOM_DEVICE_TILES_MAX 64u

/** Bytes taken from the line in one tick. */
#define GPOM_DEVICE_TICK_BYTES 512u

/** What the processor must offer. No hook may wait. */
typedef struct {
    void *ctx;
    /** Monotonic time [us]; never decreases. */
    int64_t (*now_us)(void *ctx);
    /** Up to n_max bytes that came over the line since the last call; 0: none. */
    size_t (*bytes_read)(void *ctx, uint8_t *bytes, size_t n_max);
    /** Send bytes over the line. How many were taken; the rest is offered again. */
    size_t (*bytes_write)(void *ctx, const uint8_t *bytes, size_t n_bytes);
    /** The main loop goes round: restart the watchdog. */
    void (*watchdog_feed)(void *ctx);
    /** How often the line lost bytes, and the watchdog restarted the device, so far. */
    uint32_t (*line_overruns)(void *ctx);
    uint32_t (*watchdog_resets)(void *ctx);
} gpom_port_t;

/** What a device is made for. Fill with gpom_device_config_init(), then change. */
typedef struct {
    gpom_config_t map;          /**< With a coarse layer of at most GPOM_DEVICE_TILES_MAX tiles. */
    gpom_sensor_t sensor;       /**< The one sensor. */
    uint16_t sensor_id;         /**< Its number in gpom.scan_t. Default 0. */
    uint32_t ranges_max;        /**< Most ranges of a scan. Default 361. */
    uint64_t step_ops;          /**< Budget of gpom_map_step() in a tick. Default
                                    GPOM_STEP_OPS_MIN() of the hyperparameters. */
    int64_t map_period_us;      /**< Between publications of what changed. Default 200,000. */
    int64_t keyframe_period_us; /**< Between publications of all tiles. Default 5,000,000. */
    int64_t status_period_us;   /**< Default 1,000,000. */
    int64_t stale_after_us;     /**< No scan with a usable reading inserted for so long: state
                                    STALE. Default 1,000,000. */
} gpom_device_config_t;

/** Bytes of memory for a device: a constant expression for a static array. n_points = n_hits +
 *  n_free; lanes: GPOM_LANES_MAX fits every build of the library. */
#define GPOM_DEVICE_BYTES(beam_max, cell_max, ranges_max, n_points, lanes)                         \
    (GPOM_DEVICE_WHOLE(GPOM_MAP_BYTES(beam_max, cell_max)) +                                       \
     GPOM_DEVICE_WHOLE(GPOM_SCRATCH_BYTES(n_points, lanes)) +                                      \
     GPOM_DEVICE_WHOLE((size_t)4 * (ranges_max)) +                                                 \
     GPOM_WIRE_RECEIVER_BYTES(1, GPOM_WIRE_SCAN_BYTES(ranges_max),                                 \
                              GPOM_DEVICE_FRAGMENTS(ranges_max)))
#define GPOM_DEVICE_WHOLE(n_bytes) (((n_bytes) + (size_t)7) / 8 * 8)
/** Most datagrams that a scan may come in. */
#define GPOM_DEVICE_FRAGMENTS(ranges_max)                                                          \
    (GPOM_WIRE_SCAN_BYTES(ranges_max) / (GPOM_WIRE_DATAGRAM_BYTES / 2) + 2)

/** What the device does now: all of it internal but `map`, `counts` and `reader.stats`, which are
 *  for reading. */
typedef struct {
    gpom_map_t *map;
    int64_t counts[GPOM_WIRE_COUNTS]; /**< As in gpom.status_t, but those of beams and frames. */
    gpom_uart_frame_reader_t reader;
    gpom_wire_receiver_t receiver;
    gpom_device_config_t config;
    gpom_port_t port;
    gpom_scratch_t scratch;
    float *ranges_m;
    int64_t started_us;
    /* the newest scan in the map, and when the last one with a usable reading came */
    int64_t stamp_us, arrived_us, lag_us, lag_us_max, fresh_us;
    double pose[3];
    /* the newest scan that came in order, in the map or refused by it */
    int64_t newest_us;
    uint32_t sequence;
    int64_t sequence_us; /* when it came */
    bool has_sequence;
    uint32_t n_behind; /* scans in a row behind the newest, and the last one's stamp */
    int64_t behind_us;
    /* the line's way out: one frame at a time */
    uint32_t n_frame, i_frame; /* bytes of the frame, and of them taken */
    uint32_t datagram_sequence;
    uint16_t frame_number;
    /* the publication that is on its way */
    gpom_lowres_info_t info;
    uint64_t tiles_left;                      /* bit i: tile i is still to be sent */
    uint32_t sent_crc[GPOM_DEVICE_TILES_MAX]; /* of the codes that the subscriber has */
    uint32_t n_tiles;
    uint16_t n_sent, n_to_send;
    uint32_t map_sequence;
    int64_t sent_stamp_us;
    bool is_keyframe, is_requested, has_sent;
    int64_t map_due_us, keyframe_due_us, request_due_us;
    /* the status */
    uint32_t status_sequence;
    int64_t status_due_us, status_us;
    int64_t scans_then, maps_then; /* counts at the last status */
    /* memory of the line */
    uint8_t body[GPOM_WIRE_DATAGRAM_BYTES + GPOM_UART_BODY_BYTES];
    uint8_t datagram[GPOM_WIRE_DATAGRAM_BYTES];
    uint8_t frame[GPOM_UART_FRAME_BYTES(GPOM_WIRE_DATAGRAM_BYTES)];
    uint8_t codes[2 * GPOM_DEVICE_TILE_NX * GPOM_DEVICE_TILE_NY];
} gpom_device_t;

/** Fill with the documented defaults; there is no raster yet. */
void gpom_device_config_init(gpom_device_config_t *config);

/** Make a device with an empty map in `mem`: 8-byte aligned, GPOM_DEVICE_BYTES() of the
 *  configuration at least, the caller's for ever; so is `device`. Configuration and hooks are
 *  copied.
 *  Errors: GPOM_ERR_ARG (null, no hook, no raster or one of too many tiles), GPOM_ERR_MEM, and
 *  those of gpom_map_init(). */
GPOM_NODISCARD gpom_status_t gpom_device_init(gpom_device_t *device,
                                              const gpom_device_config_t *config,
                                              const gpom_port_t *port, void *mem, size_t mem_bytes);

/** One turn of the main loop: take bytes, and of the scans that are whole at most one; do step_ops
 *  of the map's work; send what is due, at most one frame. True: something was done; false: the
 *  processor may sleep until bytes come or a millisecond went by. */
bool gpom_device_tick(gpom_device_t *device);

#ifdef __cplusplus
}
#endif
#endif
