/* Sends the tiles of the low-resolution map and the status of the device. */
#include "gpom/crc32.h"
#include "ports/uart/device_parts.h"

#include <string.h>

static const char map_channel[] = "GPOM_MAP";
static const char status_channel[] = "GPOM_STATUS";

/* Least time between keyframes that were asked for. More of them would fill the line. */
#define REQUEST_PERIOD_US 1000000

static uint32_t ceil_div(uint32_t a, uint32_t b) { return (a + b - 1) / b; }

static uint32_t min_u32(uint32_t a, uint32_t b) { return a < b ? a : b; }

uint32_t gpom_device_tile_count(const gpom_config_t *config)
{
    return ceil_div(config->lowres_nx, GPOM_DEVICE_TILE_NX) *
           ceil_div(config->lowres_ny, GPOM_DEVICE_TILE_NY);
}

/* The stamp of the newest scan plus the time since it came. */
static int64_t stamp_of(const gpom_device_t *device, int64_t now_us)
{
    return device->counts[GPOM_WIRE_SCANS_INSERTED] > 0
               ? device->stamp_us + (now_us - device->arrived_us)
               : 0;
}

/* Write the header of a datagram. Returns its bytes. */
static size_t begin(gpom_device_t *device, const char *channel)
{
    return gpom_wire_datagram_begin(device->datagram, sizeof device->datagram, channel,
                                    device->datagram_sequence++);
}

/* Put the datagram of n_bytes into a frame, and begin to send the frame. */
static void end(gpom_device_t *device, size_t n_bytes)
{
    const gpom_uart_frame_t frame = {device->datagram, (uint32_t)n_bytes, device->frame_number};
    device->n_frame = (uint32_t)gpom_uart_frame_write(&frame, device->frame, sizeof device->frame);
    device->i_frame = 0;
    device->frame_number = gpom_uart_frame_next_number(device->frame_number);
}

/* A tile's place in the raster. */
typedef struct {
    uint32_t ix0, iy0, nx, ny;
} tile_t;

static tile_t tile_of(const gpom_device_t *device, uint32_t i_tile)
{
    const gpom_raster_t *const raster = &device->info.raster;
    const uint32_t n_tiles_x = ceil_div(raster->nx, GPOM_DEVICE_TILE_NX);
    const uint32_t ix0 = i_tile % n_tiles_x * GPOM_DEVICE_TILE_NX;
    const uint32_t iy0 = i_tile / n_tiles_x * GPOM_DEVICE_TILE_NY;
    const tile_t tile = {ix0, iy0, min_u32(GPOM_DEVICE_TILE_NX, raster->nx - ix0),
                         min_u32(GPOM_DEVICE_TILE_NY, raster->ny - iy0)};
    return tile;
}

/* Write the codes of a tile's cells: first all probabilities, then all variances and classes.
 * Returns the CRC-32 of the codes. */
static uint32_t encode_cells(gpom_device_t *device, const tile_t *tile)
{
    const uint32_t n = tile->nx * tile->ny;
    for (uint32_t i = 0; i < n; ++i) {
        gpom_cell_t cell;
        if (gpom_lowres_cell(device->map, GPOM_LAYER_COARSE, tile->ix0 + i % tile->nx,
                             tile->iy0 + i / tile->nx, &cell) != GPOM_OK) {
            return 0; /* never happens, because tiles lie within the raster */
        }
        device->codes[i] = gpom_wire_probability_code(cell.probability, cell.cls);
        device->codes[n + i] = gpom_wire_variance_class_code(cell.variance, cell.cls);
    }
    return gpom_crc32(device->codes, 2 * (size_t)n);
}

static void send_tile(gpom_device_t *device, uint32_t i_tile, int64_t now_us)
{
    const gpom_raster_t *const raster = &device->info.raster;
    const tile_t place = tile_of(device, i_tile);
    device->sent_crc[i_tile] = encode_cells(device, &place);
    gpom_wire_map_t tile;
    tile.stamp_us = stamp_of(device, now_us);
    tile.map_sequence = device->map_sequence;
    tile.i_tile = device->n_sent;
    tile.n_tiles = device->n_to_send;
    tile.keyframe = device->is_keyframe ? 1 : 0;
    tile.frame_epoch = (int32_t)device->info.frame_epoch;
    memcpy(tile.pose, device->pose, sizeof tile.pose);
    tile.corner_m[0] = raster->x0_m + place.ix0 * raster->cell_m;
    tile.corner_m[1] = raster->y0_m + place.iy0 * raster->cell_m;
    tile.cell_m = (float)raster->cell_m;
    tile.prior_variance = gpom_params_prior_variance(&device->config.map.params);
    tile.map_nx = (uint16_t)raster->nx;
    tile.map_ny = (uint16_t)raster->ny;
    tile.ix0 = (uint16_t)place.ix0;
    tile.iy0 = (uint16_t)place.iy0;
    tile.nx = (uint16_t)place.nx;
    tile.ny = (uint16_t)place.ny;
    tile.probability = device->codes;
    tile.variance_class = device->codes + (size_t)place.nx * place.ny;
    const size_t n_head = begin(device, map_channel);
    const size_t n_bytes =
        gpom_wire_map_encode(&tile, device->datagram + n_head, sizeof device->datagram - n_head);
    end(device, n_head + n_bytes);
    device->tiles_left &= ~(UINT64_C(1) << i_tile);
    ++device->counts[GPOM_WIRE_TILES_PUBLISHED];
    ++device->n_sent;
    if (device->tiles_left == 0) {
        ++device->map_sequence;
        ++device->counts[GPOM_WIRE_MAPS_PUBLISHED];
    }
}

static uint32_t tile_of_robot(const gpom_device_t *device)
{
    const gpom_raster_t *const raster = &device->info.raster;
    const double ix = (device->pose[0] - raster->x0_m) / raster->cell_m;
    const double iy = (device->pose[1] - raster->y0_m) / raster->cell_m;
    const bool is_inside = ix >= 0.0 && iy >= 0.0 && ix < raster->nx && iy < raster->ny;
    const uint32_t n_tiles_x = ceil_div(raster->nx, GPOM_DEVICE_TILE_NX);
    return is_inside
               ? (uint32_t)iy / GPOM_DEVICE_TILE_NY * n_tiles_x + (uint32_t)ix / GPOM_DEVICE_TILE_NX
               : 0;
}

static uint16_t count_bits(uint64_t bits)
{
    uint16_t n = 0;
    for (; bits != 0; bits &= bits - 1) {
        ++n;
    }
    return n;
}

/* True if a keyframe was asked for and may be sent now. */
static bool has_request(const gpom_device_t *device, int64_t now_us)
{
    return device->is_requested && now_us >= device->request_due_us;
}

/* Begin a publication: choose the tiles to send. If scans came but no tile changed, the robot's
 * tile is sent, because its stamp shows that the map is fresh. */
static void begin_map(gpom_device_t *device, int64_t now_us)
{
    const gpom_raster_t before = device->info.raster;
    const uint32_t epoch = device->info.frame_epoch;
    if (device->counts[GPOM_WIRE_SCANS_INSERTED] == 0 ||
        gpom_lowres_info(device->map, GPOM_LAYER_COARSE, &device->info) != GPOM_OK) {
        return; /* there is nothing to send yet */
    }
    const bool is_same = device->has_sent && before.x0_m == device->info.raster.x0_m &&
                         before.y0_m == device->info.raster.y0_m &&
                         epoch == device->info.frame_epoch;
    const bool is_requested = has_request(device, now_us);
    device->is_keyframe = !is_same || is_requested || now_us >= device->keyframe_due_us;
    device->request_due_us = is_requested ? now_us + REQUEST_PERIOD_US : device->request_due_us;
    device->tiles_left = 0;
    for (uint32_t i = 0; i < device->n_tiles; ++i) {
        const tile_t tile = tile_of(device, i);
        if (device->is_keyframe || encode_cells(device, &tile) != device->sent_crc[i]) {
            device->tiles_left |= UINT64_C(1) << i;
        }
    }
    if (device->is_keyframe) {
        device->keyframe_due_us = now_us + device->config.keyframe_period_us;
        device->is_requested = false;
    } else if (device->tiles_left == 0 && device->stamp_us != device->sent_stamp_us) {
        device->tiles_left = UINT64_C(1) << tile_of_robot(device);
    }
    device->has_sent = true;
    device->sent_stamp_us = device->stamp_us;
    device->n_sent = 0;
    device->n_to_send = count_bits(device->tiles_left);
}

/* True if the raster moved since the publication began. Then its tiles no longer fit together. */
static bool has_moved(const gpom_device_t *device)
{
    gpom_lowres_info_t info;
    return gpom_lowres_info(device->map, GPOM_LAYER_COARSE, &info) != GPOM_OK ||
           info.raster.x0_m != device->info.raster.x0_m ||
           info.raster.y0_m != device->info.raster.y0_m ||
           info.frame_epoch != device->info.frame_epoch;
}

/* Send the next tile if there is one to send. True if a tile was sent. */
static bool send_map(gpom_device_t *device, int64_t now_us)
{
    if (device->tiles_left != 0 && has_moved(device)) {
        device->tiles_left = 0;
        ++device->map_sequence;
    }
    if (device->tiles_left == 0 && (now_us >= device->map_due_us || has_request(device, now_us))) {
        device->map_due_us = now_us + device->config.map_period_us;
        begin_map(device, now_us);
    }
    for (uint32_t i = 0; i < device->n_tiles; ++i) {
        if ((device->tiles_left >> i & 1) != 0) {
            send_tile(device, i, now_us);
            return true;
        }
    }
    return false;
}

/* Add the counters that the map, the frame reader, the receiver and the hooks keep. */
static void add_counts(const gpom_device_t *device, int64_t *counts)
{
    const gpom_uart_frame_stats_t *const frames = &device->reader.stats;
    const gpom_wire_receiver_stats_t *const datagrams = &device->receiver.stats;
    gpom_stats_t beams;
    if (gpom_map_stats(device->map, &beams) == GPOM_OK) {
        gpom_wire_count_beams(&beams, counts);
    }
    counts[GPOM_WIRE_FRAMES_RECEIVED] = (int64_t)frames->frames_received;
    counts[GPOM_WIRE_FRAMES_SHORT] = (int64_t)frames->frames_short;
    counts[GPOM_WIRE_FRAMES_LONG] = (int64_t)frames->frames_long;
    counts[GPOM_WIRE_FRAMES_CORRUPT] = (int64_t)frames->frames_corrupt;
    counts[GPOM_WIRE_FRAMES_REPEATED] = (int64_t)frames->frames_repeated;
    counts[GPOM_WIRE_FRAMES_LOST] = (int64_t)frames->frames_lost;
    counts[GPOM_WIRE_DATAGRAMS_REFUSED] =
        (int64_t)(datagrams->datagrams_other + datagrams->datagrams_malformed +
                  datagrams->fragments_overlong + datagrams->fragments_inconsistent +
                  datagrams->fragments_repeated + datagrams->fragments_late);
    counts[GPOM_WIRE_MESSAGES_INCOMPLETE] =
        (int64_t)(datagrams->messages_timed_out + datagrams->messages_evicted);
    counts[GPOM_WIRE_LINE_OVERRUNS] = device->port.line_overruns(device->port.ctx);
    counts[GPOM_WIRE_WATCHDOG_RESETS] = device->port.watchdog_resets(device->port.ctx);
}

/* n events in a span of time, as a rate per second. */
static float rate_hz(int64_t n, int64_t span_us)
{
    return span_us > 0 ? 1e6f * (float)n / (float)span_us : 0.0f;
}

static void send_status(gpom_device_t *device, int64_t now_us)
{
    const int64_t n_scans = device->counts[GPOM_WIRE_SCANS_INSERTED];
    const int64_t n_maps = device->counts[GPOM_WIRE_MAPS_PUBLISHED];
    gpom_lowres_info_t info;
    gpom_wire_status_t status;
    memset(&info, 0, sizeof info);
    memset(&status, 0, sizeof status);
    (void)!gpom_lowres_info(device->map, GPOM_LAYER_COARSE, &info);
    status.stamp_us = stamp_of(device, now_us);
    status.sequence = device->status_sequence++;
    status.state = (uint8_t)gpom_device_state(device, now_us);
    status.version = (int32_t)gpom_version();
    status.map_format = GPOM_MAP_FORMAT;
    status.frame_epoch = (int32_t)info.frame_epoch;
    status.uptime_us = now_us - device->started_us;
    status.scan_stamp_us = device->stamp_us;
    status.scan_lag_us = device->lag_us;
    status.scan_lag_us_max = device->lag_us_max;
    status.scan_rate_hz = rate_hz(n_scans - device->scans_then, now_us - device->status_us);
    status.map_rate_hz = rate_hz(n_maps - device->maps_then, now_us - device->status_us);
    status.n_beams = (int32_t)gpom_map_beam_count(device->map);
    status.beam_max = (int32_t)device->config.map.beam_max;
    status.n_cells_dirty = (int32_t)info.n_dirty;
    status.map_bytes = (int64_t)gpom_map_bytes(&device->config.map);
    memcpy(status.counts, device->counts, sizeof status.counts);
    add_counts(device, status.counts);
    device->lag_us_max = 0;
    device->scans_then = n_scans;
    device->maps_then = n_maps;
    device->status_us = now_us;
    device->status_due_us = now_us + device->config.status_period_us;
    const size_t n_head = begin(device, status_channel);
    const size_t n_bytes = gpom_wire_status_encode(&status, device->datagram + n_head,
                                                   sizeof device->datagram - n_head);
    end(device, n_head + n_bytes);
}

bool gpom_device_publish(gpom_device_t *device, int64_t now_us)
{
    const gpom_port_t *const port = &device->port;
    bool has_begun = false;
    if (device->i_frame == device->n_frame) {
        if (now_us >= device->status_due_us) {
            send_status(device, now_us);
            has_begun = true;
        } else {
            has_begun = send_map(device, now_us);
        }
    }
    const uint32_t n_left = device->n_frame - device->i_frame;
    const size_t n_taken =
        n_left > 0 ? port->bytes_write(port->ctx, device->frame + device->i_frame, n_left) : 0;
    device->i_frame += (uint32_t)n_taken;
    return has_begun || n_taken > 0;
}
