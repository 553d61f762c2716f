/* Functions that the parts of the device share. device.c takes messages, publish.c sends them. */
#ifndef GPOM_UART_DEVICE_PARTS_H
#define GPOM_UART_DEVICE_PARTS_H

#include "ports/uart/device.h"

/** Send at most one frame of what is due. True if a frame was begun or bytes were sent. */
bool gpom_device_publish(gpom_device_t *device, int64_t now_us);

/** Number of tiles of the configured raster. */
uint32_t gpom_device_tile_count(const gpom_config_t *config);

#endif
