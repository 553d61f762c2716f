/** \file bot_core.h
 *  libbot's types: bot_core.planar_lidar_t and bot_core.pose_t. */
#ifndef GPOM_CODEC_BOT_CORE_H
#define GPOM_CODEC_BOT_CORE_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT UINT64_C(0xe3d17423180b5e8d)
#define GPOM_WIRE_BOT_POSE_FINGERPRINT UINT64_C(0x2e16efb052b0105e)

/** lcmtypes/bot_core_planar_lidar_t.lcm. */
typedef struct {
    int64_t stamp_us;
    gpom_wire_floats_t ranges_m;
    gpom_wire_floats_t intensities;
    float angle_min_rad;
    float angle_step_rad;
} gpom_wire_planar_lidar_t;

/** lcmtypes/bot_core_pose_t.lcm. */
typedef struct {
    int64_t stamp_us;
    double position_m[3];
    double velocity_mps[3];
    double orientation[4]; /**< w, x, y, z. */
    double rotation_rate_rps[3];
    double acceleration_mps2[3];
} gpom_wire_bot_pose_t;

/** Read a message. Set `values` and `n_max` of its arrays before. After a fault only these fields
 *  are valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_planar_lidar_decode(gpom_wire_planar_lidar_t *message,
                                                               const uint8_t *bytes,
                                                               size_t n_bytes);
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_bot_pose_decode(gpom_wire_bot_pose_t *message,
                                                           const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit or a pointer is missing. */
GPOM_NODISCARD size_t gpom_wire_planar_lidar_encode(const gpom_wire_planar_lidar_t *message,
                                                    uint8_t *bytes, size_t n_bytes);
GPOM_NODISCARD size_t gpom_wire_bot_pose_encode(const gpom_wire_bot_pose_t *message, uint8_t *bytes,
                                                size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
