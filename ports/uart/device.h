/** \file device.h
 *  A microcontroller that maps. LCM messages come over a serial line (frame.h). Scans go into the
 *  live map. Tiles of the low-resolution map and a status go back over the line.
 *
 *  The application is the same on every processor. It uses the processor through the hooks of
 *  gpom_port_t. All memory is the caller's and fixed at the start. A main loop or a timer calls
 *  gpom_device_tick() for ever. The work of one call is bounded.
 *
 *      in   GPOM_SCAN          gpom.scan_t of the one sensor
 *           GPOM_MAP_REQUEST   any bytes: asks for a keyframe; at most one per second is sent
 *      out  GPOM_MAP           gpom.map_t: changed tiles, and all tiles from time to time
 *           GPOM_STATUS        gpom.status_t
 *
 *  The device has no calendar clock. A stamp that it sends is the stamp of the newest scan in the
 *  map plus the time since that scan came, or 0 before the first scan. The lag in the status is
 *  measured from the last byte of a scan. */
#ifndef GPOM_UART_DEVICE_H
#define GPOM_UART_DEVICE_H

#include "gpom/gpom.h"
#include "ports/codec/codec.h"
#include "ports/uart/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Cells along the sides of a tile. Tiles in the last column and row may be smaller. */
#define GPOM_DEVICE_TILE_NX 32u
#define GPOM_DEVICE_TILE_NY 16u

/** Most tiles of a device's raster. */
#define GPOM_DEVICE_TILES_MAX 64u

/** Most bytes taken from the line in one tick. */
#define GPOM_DEVICE_TICK_BYTES 512u

/** Functions that the processor must offer. No hook may wait. */
typedef struct {
    void *ctx;
    /** Monotonic time [us]. It never decreases. */
    int64_t (*now_us)(void *ctx);
    /** Get up to n_max bytes that came over the line since the last call. Returns their number. */
    size_t (*bytes_read)(void *ctx, uint8_t *bytes, size_t n_max);
    /** Send bytes over the line. Returns the number that was taken. The others are offered again.
     */
    size_t (*bytes_write)(void *ctx, const uint8_t *bytes, size_t n_bytes);
    /** Restart the time of the watchdog. Called in each turn of the main loop. */
    void (*watchdog_feed)(void *ctx);
    /** How often the line lost bytes so far. */
    uint32_t (*line_overruns)(void *ctx);
    /** How often the watchdog restarted the device so far. */
    uint32_t (*watchdog_resets)(void *ctx);
} gpom_port_t;

/** Configuration of a device. Fill it with gpom_device_config_init(), then change it. */
typedef struct {
    gpom_config_t map;          /**< Needs a coarse layer of at most GPOM_DEVICE_TILES_MAX tiles. */
    gpom_sensor_t sensor;       /**< The one sensor. */
    uint16_t sensor_id;         /**< Its number in gpom.scan_t. Default 0. */
    uint32_t ranges_max;        /**< Most ranges of a scan. Default 361. */
    uint64_t step_ops;          /**< Budget of gpom_map_step() in a tick. Default
                                    GPOM_STEP_OPS_MIN() of the hyperparameters. */
    int64_t map_period_us;      /**< Time between publications of changed tiles. Default 200,000. */
    int64_t keyframe_period_us; /**< Time between publications of all tiles. Default 5,000,000. */
    int64_t status_period_us;   /**< Time between publications of the status. Default 1,000,000. */
    int64_t stale_after_us;     /**< State STALE begins when no scan with a usable reading was
                                    inserted for this long. Default 1,000,000. */
} gpom_device_config_t;

/** Bytes of memory for a device. A constant expression, which can size a static array.
 *  n_points = n_hits + n_free. lanes: GPOM_LANES_MAX is enough for every build of the library. */
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

/** State of a device. The caller may read `map`, `counts` and `reader.stats`. The other fields are
 *  internal. */
typedef struct {
    gpom_map_t *map;
    int64_t counts[GPOM_WIRE_COUNTS]; /**< As in gpom.status_t, but without beams and frames. */
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
    /* the newest scan that came in order, whether the map took or refused it */
    int64_t newest_us;
    uint32_t sequence;
    int64_t sequence_us; /* when it came */
    bool has_sequence;
    uint32_t n_behind; /* scans in a row that are older than the newest */
    int64_t behind_us; /* stamp of the last of these scans */
    /* the frame that is being sent */
    uint32_t n_frame, i_frame; /* bytes of the frame, and bytes of it that were taken */
    uint32_t datagram_sequence;
    uint16_t frame_number;
    /* the publication that is being sent */
    gpom_lowres_info_t info;
    uint64_t tiles_left;                      /* bit i: tile i must still be sent */
    uint32_t sent_crc[GPOM_DEVICE_TILES_MAX]; /* CRC-32 of the codes that the subscriber has */
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

/** Fill a configuration with the documented defaults. It has no raster yet. */
void gpom_device_config_init(gpom_device_config_t *config);

/** Make a device with an empty map in `mem`. `mem` must be 8-byte aligned and have at least
 *  GPOM_DEVICE_BYTES() of the configuration. `mem` and `device` belong to the caller and must stay
 *  for ever. Configuration and hooks are copied.
 *  Errors: GPOM_ERR_ARG (null, a missing hook, no raster or a raster of too many tiles),
 *  GPOM_ERR_MEM, and the errors of gpom_map_init(). */
GPOM_NODISCARD gpom_status_t gpom_device_init(gpom_device_t *device,
                                              const gpom_device_config_t *config,
                                              const gpom_port_t *port, void *mem, size_t mem_bytes);

/** One turn of the main loop. Takes bytes, but at most one whole scan. Does step_ops of the map's
 *  work. Sends at most one frame of what is due. True if something was done. If false, the
 *  processor may sleep until bytes come or a millisecond has passed. */
bool gpom_device_tick(gpom_device_t *device);

/** State of the map at a time: STARTING, MAPPING or STALE (gpom_device_config_t.stale_after_us). */
static inline gpom_wire_state_t gpom_device_state(const gpom_device_t *device, int64_t now_us)
{
    if (device->counts[GPOM_WIRE_SCANS_INSERTED] == 0) {
        return GPOM_WIRE_STATE_STARTING;
    }
    return now_us - device->fresh_us > device->config.stale_after_us ? GPOM_WIRE_STATE_STALE
                                                                     : GPOM_WIRE_STATE_MAPPING;
}

#ifdef __cplusplus
}
#endif
#endif
