/* A device of your own. First come the limits, which determine the memory, then the main loop. */
#include "ports/template/port.h"

/* POINTS is n_hits + n_free of your hyperparameters. LANES is gpom_lanes() of your library: 1 on a
 * microcontroller. */
enum { BEAM_MAX = 476, NX = 32, NY = 32, RANGES_MAX = 361, POINTS = 16, LANES = 1 };

static uint64_t memory[GPOM_DEVICE_BYTES(BEAM_MAX, NX *NY, RANGES_MAX, POINTS, LANES) / 8 + 1];
static gpom_device_t device;

int main(void)
{
    gpom_device_config_t config;
    gpom_device_config_init(&config);
    config.map.beam_max = BEAM_MAX;
    config.map.keep_m = 0.1f;
    config.map.clear_scans = 3;
    config.map.lowres_cell_m = 0.5;
    config.map.lowres_nx = NX;
    config.map.lowres_ny = NY;
    config.map.lowres_rolling = 1; /* the raster follows the robot */
    config.sensor.range_max_m = 30.0f;
    const gpom_port_t port = template_port();
    if (gpom_device_init(&device, &config, &port, memory, sizeof memory) != GPOM_OK) {
        return 1;
    }
    for (;;) {
        (void)gpom_device_tick(&device); /* if false, you may sleep until the next interrupt */
    }
}
