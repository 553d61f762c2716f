/** \file gpom_scan.h
 *  gpom.scan_t: a scan with its pose. */
#ifndef GPOM_CODEC_GPOM_SCAN_H
#define GPOM_CODEC_GPOM_SCAN_H

#include "ports/codec/wire.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GPOM_WIRE_SCAN_FINGERPRINT UINT64_C(0x1543f68f9b5f9666)

/** Bytes of an encoded scan. */
#define GPOM_WIRE_SCAN_BYTES(n_ranges) ((size_t)106 + (size_t)4 * (size_t)(n_ranges))

/** lcmtypes/gpom_scan_t.lcm. pose_cov has the layout of the array that gpom_pose_t.cov points to.
 */
typedef struct {
    int64_t stamp_us;
    uint32_t sequence;
    uint16_t sensor_id;
    double pose[3]; /**< x [m], y [m], yaw [rad], map frame. */
    float pose_cov[9];
    double angle_min_rad;
    double angle_step_rad;
    gpom_wire_floats_t ranges_m;
} gpom_wire_scan_t;

/** Read a message. Set ranges_m.values and ranges_m.n_max of `message` before. After a fault only
 *  these two are valid. */
GPOM_NODISCARD gpom_wire_fault_t gpom_wire_scan_decode(gpom_wire_scan_t *message,
                                                       const uint8_t *bytes, size_t n_bytes);

/** Write a message. Returns the bytes written. 0 if they do not fit or a pointer is missing. */
GPOM_NODISCARD size_t gpom_wire_scan_encode(const gpom_wire_scan_t *message, uint8_t *bytes,
                                            size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
