/** \file mbot.h
 *  MBot's types: mbot_lcm_msgs.lidar_t, pose2D_t and occupancy_grid_t. */
#ifndef GPOM_CODEC_MBOT_H
#define GPOM_CODEC_MBOT_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_LIDAR_FINGERPRINT UINT64_C(0x89dc5b879a5056cf)
#define GPOM_WIRE_POSE2D_FINGERPRINT UINT64_C(0x1f317af1246276ac)
#define GPOM_WIRE_OCCUPANCY_GRID_FINGERPRINT UINT64_C(0xd5447e494a66cc92)

/** lcmtypes/mbot_lcm_msgs_lidar_t.lcm. All four arrays have the same number of elements. */
typedef struct {
    int64_t stamp_us;
    gpom_wire_floats_t ranges_m;
    gpom_wire_floats_t bearings_rad;
    gpom_wire_times_t stamps_us;
    gpom_wire_floats_t intensities;
} gpom_wire_lidar_t;

/** lcmtypes/mbot_lcm_msgs_pose2D_t.lcm. */
typedef struct {
    int64_t stamp_us;
    float x_m;
    float y_m;
    float yaw_rad;
} gpom_wire_pose2d_t;

/** lcmtypes/mbot_lcm_msgs_occupancy_grid_t.lcm. */
typedef struct {
    int64_t stamp_us;
    float corner_x_m;
    float corner_y_m;
    float cell_m;
    uint32_t nx;
    uint32_t ny;
    const uint8_t *cells; /**< nx * ny log-odds as two's complement. A view after decoding. */
} gpom_wire_occupancy_grid_t;

/** Read a message. Set `values` and `n_max` of its arrays before. After a fault only these fields
 *  are valid. If num_cells of a grid is not width * height, the fault is GPOM_WIRE_COUNT. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_lidar_decode(gpom_wire_lidar_t *message,
                                                        const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_pose2d_decode(gpom_wire_pose2d_t *message,
                                                         const uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_occupancy_grid_decode(
    gpom_wire_occupancy_grid_t *message, const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit, a pointer is missing, or
 *  counts that must agree differ. */
GPOM_NODISCARD size_t gpom_wire_lidar_encode(const gpom_wire_lidar_t *message, uint8_t *bytes,
                                             size_t n_bytes);
GPOM_NODISCARD size_t gpom_wire_pose2d_encode(const gpom_wire_pose2d_t *message, uint8_t *bytes,
                                              size_t n_bytes);
GPOM_NODISCARD size_t gpom_wire_occupancy_grid_encode(const gpom_wire_occupancy_grid_t *message,
                                                      uint8_t *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
