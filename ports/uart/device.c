#include "ports/uart/device.h"

#include "ports/uart/device_parts.h"

#include <string.h>

/* Channels that the device listens to. */
static const char scan_channel[] = "GPOM_SCAN";
static const char request_channel[] = "GPOM_MAP_REQUEST";

#define FRAGMENT_TIMEOUT_US 1000000

/* No sender has greater bearings, steps or stamps than these. */
#define BEARING_MAX_RAD 100.0
#define STEP_MAX_RAD 10.0
#define STAMP_MAX_US (INT64_MAX / 4)

/* No sensor scans more often than SCAN_PERIOD_MIN_US. Besides, LOST_MAX numbers may be missing at
 * once. A number that is farther ahead comes from a sender that started to count again. */
#define SCAN_PERIOD_MIN_US 100
#define LOST_MAX 1000

/* If this many scans in a row come in order but are older than the newest, the sender's clock was
 * set back. The device follows it. */
enum { SET_BACK_SCANS = 10 };

void gpom_device_config_init(gpom_device_config_t *config)
{
    memset(config, 0, sizeof *config);
    gpom_config_init(&config->map);
    gpom_sensor_init(&config->sensor);
    config->ranges_max = 361;
    config->map_period_us = 200000;
    config->keyframe_period_us = 5000000;
    config->status_period_us = 1000000;
    config->stale_after_us = 1000000;
}

/* Cuts the caller's memory into pieces whose sizes are multiples of 8 bytes. */
typedef struct {
    uint8_t *at;
    size_t n_left;
} memory_t;

static void *cut(memory_t *memory, size_t n_bytes)
{
    const size_t n_whole = GPOM_DEVICE_WHOLE(n_bytes);
    if (memory->at == NULL || n_whole > memory->n_left) {
        memory->at = NULL;
        return NULL;
    }
    void *const piece = memory->at;
    memory->at += n_whole;
    memory->n_left -= n_whole;
    return piece;
}

static bool has_hooks(const gpom_port_t *port)
{
    return port->now_us != NULL && port->bytes_read != NULL && port->bytes_write != NULL &&
           port->watchdog_feed != NULL && port->line_overruns != NULL &&
           port->watchdog_resets != NULL;
}

static gpom_status_t make_map(gpom_device_t *device, memory_t *memory)
{
    const gpom_device_config_t *const config = &device->config;
    const size_t map_bytes = gpom_map_bytes(&config->map);
    void *const map_memory = cut(memory, map_bytes);
    const gpom_status_t status = gpom_map_init(&device->map, &config->map, map_memory, map_bytes);
    if (status != GPOM_OK) {
        return status;
    }
    device->scratch.mem_bytes = gpom_scratch_bytes(device->map);
    device->scratch.mem = cut(memory, device->scratch.mem_bytes);
    device->ranges_m = cut(memory, sizeof(float) * config->ranges_max);
    return memory->at != NULL ? GPOM_OK : GPOM_ERR_MEM;
}

static gpom_status_t make_receiver(gpom_device_t *device, memory_t *memory)
{
    const uint32_t ranges_max = device->config.ranges_max;
    const gpom_wire_receiver_config_t config = {1, (uint32_t)GPOM_WIRE_SCAN_BYTES(ranges_max),
                                                (uint32_t)GPOM_DEVICE_FRAGMENTS(ranges_max),
                                                FRAGMENT_TIMEOUT_US};
    return gpom_wire_receiver_init(&device->receiver, &config, memory->at, memory->n_left);
}

gpom_status_t gpom_device_init(gpom_device_t *device, const gpom_device_config_t *config,
                               const gpom_port_t *port, void *mem, size_t mem_bytes)
{
    if (device == NULL || config == NULL || port == NULL || !has_hooks(port)) {
        return GPOM_ERR_ARG;
    }
    const uint32_t n_tiles = gpom_device_tile_count(&config->map);
    if (n_tiles == 0 || n_tiles > GPOM_DEVICE_TILES_MAX || config->ranges_max == 0 ||
        config->ranges_max > GPOM_RANGES_MAX) {
        return GPOM_ERR_ARG;
    }
    if (mem == NULL || (uintptr_t)mem % 8 != 0) {
        return GPOM_ERR_MEM;
    }
    memset(device, 0, sizeof *device);
    device->config = *config;
    device->port = *port;
    device->n_tiles = n_tiles;
    if (config->step_ops == 0) {
        device->config.step_ops =
            GPOM_STEP_OPS_MIN(config->map.params.n_hits + (uint32_t)config->map.params.n_free);
    }
    gpom_uart_frame_reader_init(&device->reader, device->body, sizeof device->body);
    memory_t memory = {mem, mem_bytes};
    const gpom_status_t status = make_map(device, &memory);
    device->started_us = device->status_us = port->now_us(port->ctx);
    device->keyframe_due_us = device->started_us + config->keyframe_period_us;
    return status == GPOM_OK ? make_receiver(device, &memory) : status;
}

/* False for NaN. */
static bool is_within(double value, double max) { return value >= -max && value <= max; }

static uint32_t place_of(gpom_wire_fault_t fault)
{
    return fault == GPOM_WIRE_TYPE  ? GPOM_WIRE_SCANS_OTHER_TYPE
           : fault == GPOM_WIRE_CRC ? GPOM_WIRE_SCANS_CORRUPT
                                    : GPOM_WIRE_SCANS_MALFORMED;
}

/* Note a scan that is older than the newest. True if it is the last of SET_BACK_SCANS such scans in
 * a row and in order. Then the sender's clock was set back. */
static bool is_set_back(gpom_device_t *device, int64_t stamp_us)
{
    const bool is_in_order = device->n_behind > 0 && stamp_us > device->behind_us;
    device->n_behind = is_in_order ? device->n_behind + 1 : 1;
    device->behind_us = stamp_us;
    return device->n_behind >= SET_BACK_SCANS;
}

/* True if a scan has a later stamp than the newest one, or if the sender's clock was set back. The
 * number may be lower, because the sender may have started to count again. */
static bool is_next(gpom_device_t *device, const gpom_wire_scan_t *scan, int64_t now_us)
{
    const int32_t ahead = (int32_t)(scan->sequence - device->sequence);
    if (device->has_sequence && (ahead == 0 || scan->stamp_us == device->newest_us)) {
        ++device->counts[GPOM_WIRE_SCANS_REPEATED];
        return false;
    }
    if (device->has_sequence && scan->stamp_us < device->newest_us &&
        !is_set_back(device, scan->stamp_us)) {
        ++device->counts[ahead < 0 ? GPOM_WIRE_SCANS_REORDERED : GPOM_WIRE_SCANS_JUMPED_BACK];
        return false;
    }
    const int64_t since_us = now_us - device->sequence_us;
    if (device->has_sequence && ahead > 1 && ahead <= LOST_MAX + since_us / SCAN_PERIOD_MIN_US) {
        device->counts[GPOM_WIRE_SCANS_LOST] += ahead - 1;
    }
    device->has_sequence = true;
    device->sequence = scan->sequence;
    device->sequence_us = now_us;
    device->newest_us = scan->stamp_us;
    device->n_behind = 0;
    return true;
}

/* Number of readings so far that say nothing about the surroundings. All readings of a covered
 * sensor are of this kind. */
static uint64_t unusable_readings(const gpom_device_t *device)
{
    gpom_stats_t stats;
    return gpom_map_stats(device->map, &stats) == GPOM_OK
               ? stats.beams_nan + stats.beams_not_positive + stats.beams_too_near +
                     stats.beams_masked
               : 0;
}

static void insert(gpom_device_t *device, const gpom_wire_scan_t *wire, int64_t arrived_us)
{
    bool is_exact = true;
    for (int i = 0; i < 9; ++i) {
        is_exact = is_exact && wire->pose_cov[i] == 0.0f;
    }
    const gpom_pose_t pose = {wire->pose[0], wire->pose[1], wire->pose[2],
                              is_exact ? NULL : wire->pose_cov};
    const gpom_scan_t scan = {wire->stamp_us, wire->angle_min_rad, wire->angle_step_rad,
                              device->ranges_m, wire->ranges_m.n};
    const uint64_t n_unusable = unusable_readings(device);
    const gpom_status_t status =
        gpom_scan_insert(device->map, &scan, &device->config.sensor, &pose);
    if (status != GPOM_OK) { /* the pose is wrong: the other fields of the scan were checked */
        ++device->counts[status == GPOM_ERR_REACH ? GPOM_WIRE_SCANS_OUT_OF_REACH
                                                  : GPOM_WIRE_SCANS_BAD_POSE];
        return;
    }
    ++device->counts[GPOM_WIRE_SCANS_INSERTED];
    device->stamp_us = wire->stamp_us;
    device->arrived_us = arrived_us;
    if (unusable_readings(device) - n_unusable < scan.n_ranges) {
        device->fresh_us = arrived_us;
    }
    memcpy(device->pose, wire->pose, sizeof device->pose);
    device->lag_us = device->port.now_us(device->port.ctx) - arrived_us;
    device->lag_us_max = device->lag_us > device->lag_us_max ? device->lag_us : device->lag_us_max;
}

static void take_scan(gpom_device_t *device, const gpom_wire_message_t *message, int64_t now_us)
{
    ++device->counts[GPOM_WIRE_SCANS_RECEIVED];
    gpom_wire_scan_t scan;
    scan.ranges_m.values = device->ranges_m;
    scan.ranges_m.n_max = device->config.ranges_max;
    gpom_wire_fault_t fault =
        gpom_wire_scan_decode(&scan, message->payload, message->payload_bytes);
    if (fault == GPOM_WIRE_OK &&
        (scan.sensor_id != device->config.sensor_id || scan.stamp_us < 0 ||
         scan.stamp_us > STAMP_MAX_US || !is_within(scan.angle_min_rad, BEARING_MAX_RAD) ||
         !is_within(scan.angle_step_rad, STEP_MAX_RAD))) {
        fault = GPOM_WIRE_VALUE;
    }
    if (fault != GPOM_WIRE_OK) {
        ++device->counts[place_of(fault)];
    } else if (is_next(device, &scan, now_us)) {
        insert(device, &scan, now_us);
    }
}

static bool is_channel(const char *name, const char *channel)
{
    for (; *name == *channel; ++name, ++channel) {
        if (*name == '\0') {
            return true;
        }
    }
    return false;
}

/* Take the datagram of a frame. True if it completed a scan, which is enough work for one tick. */
static bool take_frame(gpom_device_t *device, const gpom_uart_frame_t *frame, int64_t now_us)
{
    const gpom_wire_arrival_t arrival = {frame->datagram, frame->n_bytes, 0, now_us};
    gpom_wire_message_t message;
    if (!gpom_wire_receive(&device->receiver, &arrival, &message)) {
        return false;
    }
    if (is_channel(message.channel, scan_channel)) {
        take_scan(device, &message, now_us);
        return true;
    }
    if (is_channel(message.channel, request_channel)) {
        device->is_requested = true;
    } else {
        ++device->counts[GPOM_WIRE_MESSAGES_OTHER];
    }
    return false;
}

/* Take bytes from the line. True if something came. */
static bool take_bytes(gpom_device_t *device, int64_t now_us)
{
    const gpom_port_t *const port = &device->port;
    uint32_t n_taken = 0;
    for (; n_taken < GPOM_DEVICE_TICK_BYTES; ++n_taken) {
        uint8_t byte;
        gpom_uart_frame_t frame;
        if (port->bytes_read(port->ctx, &byte, 1) == 0) {
            break;
        }
        if (gpom_uart_frame_read(&device->reader, byte, &frame) &&
            take_frame(device, &frame, now_us)) {
            return true;
        }
    }
    return n_taken > 0;
}

bool gpom_device_tick(gpom_device_t *device)
{
    const gpom_port_t *const port = &device->port;
    const int64_t now_us = port->now_us(port->ctx);
    const bool has_taken = take_bytes(device, now_us);
    uint64_t n_used = 0;
    const gpom_status_t status =
        gpom_map_step(device->map, device->config.step_ops, &device->scratch, &n_used);
    const bool has_sent = gpom_device_publish(device, now_us);
    port->watchdog_feed(port->ctx);
    return has_taken || has_sent || (status == GPOM_OK && n_used > 0);
}
