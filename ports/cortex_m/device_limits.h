/* Limits of the device in device_main.c. They determine the size of its memory. */
#ifndef GPOM_PORTS_CORTEX_M_DEVICE_LIMITS_H
#define GPOM_PORTS_CORTEX_M_DEVICE_LIMITS_H

#define DEVICE_BEAM_MAX 476   /* the paper's street: 28 scans of 17 beams */
#define DEVICE_RANGES_MAX 361 /* most ranges of a scan */
#define DEVICE_POINTS 16      /* n_hits + n_free of the hyperparameters */
#define DEVICE_NX 32          /* cells of the low-resolution map */
#define DEVICE_NY 32
#define DEVICE_CELL_M 4.0 /* with these cells the map covers the whole street */
#define DEVICE_X0_M 0.0   /* lower left corner of the map */
#define DEVICE_Y0_M (-4.0)
#define DEVICE_MAVLINK_RANGE_M 40.0f /* ten cells */

#endif
