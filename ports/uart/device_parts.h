/* What the parts of the device offer each other: device.c takes, publish.c sends. */
#ifndef GPOM_UART_DEVICE_PARTS_H
#define GPOM_UART_DEVICE_PARTS_H

#include "ports/uart/device.h"

/** Send what is due, at most one frame. True: something was sent or is still on its way. */
bool gpom_device_publish(gpom_device_t *device, int64_t now_us);

/** Number of tiles of the configured raster. */
uint32_t gpom_device_tile_count(const gpom_config_t *config);

#endif
