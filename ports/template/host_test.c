/* An example of a unit test on the PC. The test moves the clock of the device, and the line is in
 * memory. So nothing waits, and each run is the same. Returns 0 if all is as expected. */
#include "ports/uart/device.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { BEAM_MAX = 256, N_SIDE = 16, RANGES_MAX = 91, LINE_BYTES = 65536 };

/* Clock, line and watchdog that the hooks use in this test. */
typedef struct {
    int64_t now_us;
    uint8_t in[LINE_BYTES], out[LINE_BYTES];
    size_t n_in, n_taken, n_out;
    uint32_t n_fed;
} bench_t;

static bench_t bench;
static gpom_device_t device;
static uint64_t
    memory[GPOM_DEVICE_BYTES(BEAM_MAX, N_SIDE *N_SIDE, RANGES_MAX, 16, GPOM_LANES_MAX) / 8 + 1];
static int n_failed;

static void expect(int is_true, const char *what)
{
    if (!is_true) {
        ++n_failed;
        fprintf(stderr, "host_test: failed: %s\n", what);
    }
}

static int64_t now_us(void *ctx) { return ((bench_t *)ctx)->now_us; }

static size_t bytes_read(void *ctx, uint8_t *bytes, size_t n_max)
{
    bench_t *const here = ctx;
    const size_t n_left = here->n_in - here->n_taken;
    const size_t n = n_left < n_max ? n_left : n_max;
    memcpy(bytes, here->in + here->n_taken, n);
    here->n_taken += n;
    return n;
}

static size_t bytes_write(void *ctx, const uint8_t *bytes, size_t n_bytes)
{
    bench_t *const here = ctx;
    const size_t n_left = LINE_BYTES - here->n_out;
    const size_t n = n_left < n_bytes ? n_left : n_bytes;
    memcpy(here->out + here->n_out, bytes, n);
    here->n_out += n;
    return n;
}

static void watchdog_feed(void *ctx) { ++((bench_t *)ctx)->n_fed; }

static uint32_t none(void *ctx)
{
    (void)ctx;
    return 0;
}

static gpom_port_t bench_port(void)
{
    const gpom_port_t port = {&bench, now_us, bytes_read, bytes_write, watchdog_feed, none, none};
    return port;
}

static void make_device(void)
{
    gpom_device_config_t config;
    gpom_device_config_init(&config);
    config.map.beam_max = BEAM_MAX;
    config.map.keep_m = 0.1f;
    config.map.lowres_cell_m = 0.5;
    config.map.lowres_nx = config.map.lowres_ny = N_SIDE;
    config.map.lowres_y0_m = -4.0;
    config.ranges_max = RANGES_MAX;
    memset(&bench, 0, sizeof bench);
    const gpom_port_t port = bench_port();
    expect(gpom_device_init(&device, &config, &port, memory, 1000) == GPOM_ERR_MEM,
           "short memory is refused");
    expect(gpom_device_init(&device, &config, &port, memory, sizeof memory) == GPOM_OK,
           "the device is made");
}

/* Let n_ms pass. Each turn of the device takes a millisecond. */
static void run_ms(int n_ms)
{
    for (int i = 0; i < n_ms; ++i) {
        bench.now_us += 1000;
        (void)gpom_device_tick(&device);
    }
}

/* Put a scan onto the line. It was taken at x_m, and all its ranges are range_m. */
static void send_ranges(uint32_t sequence, double x_m, float range_m)
{
    static uint16_t number;
    static uint8_t datagram[GPOM_WIRE_DATAGRAM_BYTES];
    float ranges_m[RANGES_MAX];
    for (int i = 0; i < RANGES_MAX; ++i) {
        ranges_m[i] = range_m;
    }
    gpom_wire_scan_t scan;
    memset(&scan, 0, sizeof scan);
    scan.stamp_us = 100000 * (int64_t)(sequence + 1);
    scan.sequence = sequence;
    scan.pose[0] = x_m;
    scan.angle_min_rad = -0.45;
    scan.angle_step_rad = 0.01;
    scan.ranges_m.values = ranges_m;
    scan.ranges_m.n = RANGES_MAX;
    const size_t n_head = gpom_wire_datagram_begin(datagram, sizeof datagram, "GPOM_SCAN", 0);
    const size_t n_bytes =
        gpom_wire_scan_encode(&scan, datagram + n_head, sizeof datagram - n_head);
    const gpom_uart_frame_t frame = {datagram, (uint32_t)(n_head + n_bytes), number};
    number = gpom_uart_frame_next_number(number);
    bench.n_in += gpom_uart_frame_write(&frame, bench.in + bench.n_in, LINE_BYTES - bench.n_in);
}

/* Put a scan of a wall 5 m ahead onto the line. */
static void send_scan(uint32_t sequence) { send_ranges(sequence, 0.0, 5.0f); }

/* Find the newest message of a channel that the device sent. False if there is none. */
static bool find_message(const char *channel, gpom_wire_message_t *found)
{
    static uint8_t body[GPOM_WIRE_DATAGRAM_BYTES + GPOM_UART_BODY_BYTES];
    static uint8_t kept[GPOM_WIRE_DATAGRAM_BYTES];
    gpom_uart_frame_reader_t reader;
    gpom_wire_receiver_t receiver;
    const gpom_wire_receiver_config_t config = {0, 0, 1, 1};
    bool is_found = false;
    gpom_uart_frame_reader_init(&reader, body, sizeof body);
    if (gpom_wire_receiver_init(&receiver, &config, NULL, 0) != GPOM_OK) {
        return false;
    }
    for (size_t i = 0; i < bench.n_out; ++i) {
        gpom_uart_frame_t frame;
        gpom_wire_message_t message;
        if (gpom_uart_frame_read(&reader, bench.out[i], &frame)) {
            const gpom_wire_arrival_t arrival = {frame.datagram, frame.n_bytes, 0, 0};
            if (gpom_wire_receive(&receiver, &arrival, &message) &&
                strcmp(message.channel, channel) == 0) {
                memcpy(kept, message.payload, message.payload_bytes);
                *found = message;
                found->payload = kept;
                is_found = true;
            }
        }
    }
    return is_found;
}

static gpom_wire_status_t newest_status(void)
{
    gpom_wire_message_t message;
    gpom_wire_status_t status;
    memset(&status, 0, sizeof status);
    expect(find_message("GPOM_STATUS", &message) &&
               gpom_wire_status_decode(&status, message.payload, message.payload_bytes) ==
                   GPOM_WIRE_OK,
           "a status came");
    return status;
}

/* Class of the cell at a place, as a planner at the other end of the line sees it. -1 if no map
 * came. */
static int class_at(double x_m, double y_m)
{
    gpom_wire_message_t message;
    gpom_wire_map_t tile;
    if (!find_message("GPOM_MAP", &message) ||
        gpom_wire_map_decode(&tile, message.payload, message.payload_bytes) != GPOM_WIRE_OK) {
        return -1;
    }
    const int ix = (int)((x_m - tile.corner_m[0]) / (double)tile.cell_m);
    const int iy = (int)((y_m - tile.corner_m[1]) / (double)tile.cell_m);
    return gpom_wire_class(tile.variance_class[iy * tile.nx + ix]);
}

static void test_silence(void)
{
    make_device();
    run_ms(3000);
    expect(newest_status().state == GPOM_WIRE_STATE_STARTING, "without a scan it is starting");
    expect(bench.n_fed == 3000, "each turn feeds the watchdog");
    expect(class_at(5.1, 0.0) == -1, "there is no map yet");
}

static void test_wall(void)
{
    make_device();
    for (uint32_t i = 0; i < 10; ++i) {
        send_scan(i);
        run_ms(100);
    }
    run_ms(100);
    gpom_wire_status_t status = newest_status();
    expect(status.state == GPOM_WIRE_STATE_MAPPING, "scans come: it is mapping");
    expect(status.counts[GPOM_WIRE_SCANS_INSERTED] == 10, "all ten are in the map");
    expect(status.counts[GPOM_WIRE_BEAMS_HIT] + status.counts[GPOM_WIRE_BEAMS_KNOWN] ==
               10 * RANGES_MAX,
           "each range is in one counter: kept, or known already");
    expect(class_at(5.1, 0.0) == GPOM_OCCUPIED, "the wall is occupied");
    expect(class_at(3.1, 0.0) == GPOM_FREE, "the way to it is free");
    run_ms(2500);
    status = newest_status();
    expect(status.state == GPOM_WIRE_STATE_STALE, "no scan for a second: it is stale");
}

static void test_lost_and_repeated(void)
{
    make_device();
    send_scan(0);
    send_scan(4);
    send_scan(4);
    send_scan(2000000000); /* no sensor sends so many: its numbers started again */
    run_ms(1500);
    const gpom_wire_status_t status = newest_status();
    expect(status.counts[GPOM_WIRE_SCANS_LOST] == 3, "three scans between are lost");
    expect(status.counts[GPOM_WIRE_SCANS_REPEATED] == 1, "one came twice");
    expect(status.counts[GPOM_WIRE_SCANS_INSERTED] == 3, "the others are in the map");
}

/* After a good scan, scans come for two seconds that tell nothing about the surroundings. The map
 * refuses them because of their x_m, or their readings are not usable. */
static void test_stale(double x_m, float range_m)
{
    make_device();
    send_scan(0);
    for (uint32_t i = 1; i < 25; ++i) {
        send_ranges(i, x_m, range_m);
        run_ms(100);
    }
    run_ms(100);
    const gpom_wire_status_t status = newest_status();
    const int64_t n_refused = status.counts[GPOM_WIRE_SCANS_BAD_POSE];
    const int64_t n_received = status.counts[GPOM_WIRE_SCANS_RECEIVED];
    expect(n_received > 15, "scans go on coming");
    expect(status.counts[GPOM_WIRE_SCANS_INSERTED] + n_refused == n_received,
           "each is counted once");
    expect(n_refused == 0 || status.scan_stamp_us == 100000, "the newest is the last inserted");
    expect(status.state == GPOM_WIRE_STATE_STALE, "the map is stale");
}

int main(void)
{
    test_silence();
    test_wall();
    test_lost_and_repeated();
    test_stale(NAN, 5.0f);
    test_stale(0.0, 0.0f);
    printf("host_test: %d failed\n", n_failed);
    return n_failed > 0;
}
