/** \file scan.h
 *  Range scans with poses: the only input of a map.
 *
 *  Frames:
 *  - map: fixed, right-handed; yaw is counter-clockwise from x.
 *  - robot: x points forward.
 *  - sensor: bearing 0 is along its x axis. */
#ifndef GPOM_SCAN_H
#define GPOM_SCAN_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most ranges in one scan. */
#define GPOM_RANGES_MAX 65536u

/** An interval of bearings at which the sensor sees the vehicle itself. It goes counter-clockwise
 *  from `from_rad` to `to_rad`, both included, and may cross pi. The bearings are those of the
 *  scan. */
typedef struct {
    float from_rad; /**< First masked bearing [rad]; finite. */
    float to_rad;   /**< Last masked bearing, counter-clockwise of the first [rad]; finite. */
} gpom_mask_t;

/** A range sensor and its place on the robot. Fill with gpom_sensor_init(), then change. */
typedef struct {
    double x_m;         /**< Mount, robot frame [m]. Default 0. */
    double y_m;         /**< Mount, robot frame [m]. Default 0. */
    double yaw_rad;     /**< Mount, robot frame [rad]. Default 0. */
    float range_min_m;  /**< Readings below this are the housing, dust or an error [m]; >= 0.
                             Default 0.02: usual lidars measure nothing nearer, so no reading is
                             lost. */
    float range_max_m;  /**< Usable maximum [m]; > range_min_m. A reading at or beyond it is "no
                             return": free up to here. Default 30. */
    float range_var_m2; /**< Variance of a range [m2]; raises the noise of the beam. Default 0. */
    const gpom_mask_t *masks;  /**< n_masks finite masks, or NULL. Read only during insertion. */
    uint16_t n_masks;          /**< Default 0. */
    uint8_t upside_down;       /**< 1: mounted upside down, so bearings run clockwise. Default 0. */
    uint8_t zero_is_no_return; /**< 1: a reading of 0 is "no return"; many drivers send it so.
                                    Warning: some sensors also read 0 when they are covered. The
                                    map then shows free space there. 0, the default: a reading of
                                    0 is ignored. */
    uint8_t too_near_is_no_return; /**< 1: a reading above 0 and below range_min_m is "no return".
                                         Default 0. */
} gpom_sensor_t;

/** A robot pose in the map frame. */
typedef struct {
    double x_m;       /**< [m], within GPOM_PLACE_MAX_M (map.h) */
    double y_m;       /**< [m], within GPOM_PLACE_MAX_M */
    double yaw_rad;   /**< [rad], any angle from -1e6 to 1e6, so also more than one turn. */
    const float *cov; /**< 3 x 3 covariance of (x, y, yaw) by rows [m2, m rad, rad2]. It is
                           symmetric and positive semidefinite, with variances of at most 1e12.
                           NULL: the pose is exact. */
} gpom_pose_t;

/** One planar scan: all beams are measured at one time and from one pose. For other scans use
 *  gpom_sweep_t. */
typedef struct {
    int64_t stamp_us;      /**< Time of measurement [us]; kept with the beams. */
    double angle_min_rad;  /**< Bearing of the first range, sensor frame [rad]. */
    double angle_step_rad; /**< Bearing step, negative if clockwise [rad]. */
    const float *ranges_m; /**< n_ranges ranges [m]. NaN: ignored. +inf: no return. 0, and ranges
                                below range_min_m: see gpom_sensor_t. Any bits are allowed. */
    uint32_t n_ranges;     /**< 0 .. GPOM_RANGES_MAX. */
} gpom_scan_t;

/** A scan of a sensor that turns while the robot moves. Every beam has its own bearing and its own
 *  pose. The map treats it as one scan of one time. */
typedef struct {
    int64_t stamp_us;          /**< Time of measurement [us], as in gpom_scan_t; one for all
                                    beams. */
    const float *ranges_m;     /**< n_ranges ranges [m], as in gpom_scan_t. */
    const float *bearings_rad; /**< n_ranges bearings in the sensor frame [rad], finite. */
    const gpom_pose_t *poses;  /**< n_ranges poses of the robot, each at the time of its beam. */
    uint32_t n_ranges;         /**< 0 .. GPOM_RANGES_MAX. With 0 the arrays may be NULL. */
} gpom_sweep_t;

/** Fill with the documented defaults.
 *
 *  Cost: O(1). */
GPOM_API void gpom_sensor_init(gpom_sensor_t *sensor);

/** Insert a scan. A query right after the call sees every beam that was kept and is not provisional
 *  (live.h). Readings that cannot be used are ignored, and counted by cause in gpom_stats_t. A full
 *  map still takes every scan: it evicts less useful beams (gpom_stats_evicted()). A new beam that
 *  is not more useful is not kept (beams_redundant).
 *
 *  Position uncertainty at the hit raises the noise of the beam's points. Let d be its standard
 *  deviation, and rho the prior correlation over the distance d. A measurement y = f(x) + e at an
 *  uncertain place has the noise (sn2 + (1 - rho^2) k(x, x)) / rho^2. d^2 is the range variance
 *  plus the pose covariance carried to the hit. Of this covariance d^2 takes the mean over all
 *  directions: half of the sum of the variances in x and y.
 *
 *  Errors  GPOM_ERR_ARG    null, or a field of sensor or scan is out of range. The map is
 *                          unchanged.
 *          GPOM_ERR_ARG    the pose is not finite or beyond GPOM_PLACE_MAX_M, or its covariance is
 *                          not valid. The scan is counted; the map is unchanged.
 *          GPOM_ERR_REACH  the sensor is beyond GPOM_REACH_M of the origin. The scan is counted;
 *                          the map is unchanged. If the origin follows the robot (rebase_m) and
 *                          beams are kept, a pose out of reach of the old origin is refused too.
 *                          The 10th such pose in a row, each near the one before, is accepted.
 *                          For real jumps of the map frame, use gpom_map_jump().
 *  Cost: O(n_ranges (1 + n_masks)), and traversals of the trees: docs/costs.md has the bound. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_scan_insert(gpom_map_t *map, const gpom_scan_t *scan,
                                                       const gpom_sensor_t *sensor,
                                                       const gpom_pose_t *pose);

/** Insert a scan whose beams have their own poses. With equal poses and evenly spaced bearings, the
 *  result is that of gpom_scan_insert(), bit for bit.
 *
 *  pose    pose of the robot at stamp_us. The low-resolution map and the origin follow it. The
 *          beams do not use it.
 *  Errors  as gpom_scan_insert(), for `pose` and for the pose of any beam; the map is unchanged.
 *  Cost: as gpom_scan_insert(), and 60 operations more for each beam, half of them in double. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_sweep_insert(gpom_map_t *map, const gpom_sweep_t *sweep,
                                                        const gpom_sensor_t *sensor,
                                                        const gpom_pose_t *pose);

#ifdef __cplusplus
}
#endif
#endif
