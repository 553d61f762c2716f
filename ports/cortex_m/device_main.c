/* The image of a real device. Scans come over UART 0, and the map goes back over it
 * (ports/uart/device.h). With DEVICE_MAVLINK an autopilot at UART 1 learns how far all is free
 * (ports/mavlink/device.h). */
#include "gpom/presets/street.h"
#include "ports/cortex_m/device_limits.h"
#include "ports/cortex_m/mps2.h"
#include "street.h"

#ifndef DEVICE_MAVLINK
#define DEVICE_MAVLINK 0
#endif
#if DEVICE_MAVLINK
#include "ports/mavlink/device.h"
#endif

static uint64_t memory[GPOM_DEVICE_BYTES(DEVICE_BEAM_MAX, DEVICE_NX *DEVICE_NY, DEVICE_RANGES_MAX,
                                         DEVICE_POINTS, 1) /
                           8 +
                       1];
static gpom_device_t device;

static gpom_device_config_t configure(void)
{
    gpom_device_config_t config;
    gpom_device_config_init(&config);
    config.map.params = gpom_params_street;
    config.map.beam_max = DEVICE_BEAM_MAX;
    config.map.keep_m = 0.1f;
    config.map.clear_scans = 3;
    config.map.lowres_nx = DEVICE_NX;
    config.map.lowres_ny = DEVICE_NY;
    config.map.lowres_cell_m = DEVICE_CELL_M;
    config.map.lowres_x0_m = DEVICE_X0_M;
    config.map.lowres_y0_m = DEVICE_Y0_M;
    config.sensor.range_max_m = street_range_max_m;
    config.ranges_max = DEVICE_RANGES_MAX;
    return config;
}

#if DEVICE_MAVLINK
static gpom_mavlink_device_t mavlink;

static gpom_status_t begin_mavlink(void)
{
    mps2_init_uart1();
    gpom_mavlink_device_config_t config;
    gpom_mavlink_device_config_init(&config);
    config.range_m = DEVICE_MAVLINK_RANGE_M;
    config.bytes_write = mps2_write_uart1;
    return gpom_mavlink_device_init(&mavlink, &config);
}

/* True if bytes are waiting for UART 1. */
static bool send_mavlink(void) { return gpom_mavlink_device_tick(&mavlink, &device); }
#else
static gpom_status_t begin_mavlink(void) { return GPOM_OK; }
static bool send_mavlink(void) { return false; }
#endif

/* Returns only if the configuration is wrong, which a test of a changed configuration shows. The
 * watchdog then restarts the device again and again. */
int main(void)
{
    mps2_init();
    const gpom_device_config_t config = configure();
    const gpom_port_t port = mps2_port();
    if (gpom_device_init(&device, &config, &port, memory, sizeof memory) != GPOM_OK ||
        begin_mavlink() != GPOM_OK) {
        return 1;
    }
    for (;;) {
        const bool has_worked = gpom_device_tick(&device);
        if (!send_mavlink() && !has_worked) {
            mps2_sleep();
        }
    }
}
