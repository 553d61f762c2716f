/** \file scan.h
 *  Range scans with poses: the only thing that goes into a map.
 *
 *  Frames: map (fixed, right-handed, yaw counter-clockwise from x), robot (x forward), sensor
 *  (bearing 0 along its x axis). */
#ifndef GPOM_SCAN_H
#define GPOM_SCAN_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most ranges in one scan. */
#define GPOM_RANGES_MAX 65536u

/** Bearings that see the vehicle itself: from `from_rad` counter-clockwise to `to_rad`, both
 *  included, in the scan's own bearings. May cross pi. */
typedef struct {
    float from_rad; /**< First bearing that is masked [rad]; finite. */
    float to_rad;   /**< Last one, counter-clockwise of the first [rad]; finite. */
} gpom_mask_t;

/** A range sensor and its place on the robot. Fill with gpom_sensor_init(), then change. */
typedef struct {
    double x_m;         /**< Mount, robot frame [m]. Default 0. */
    double y_m;         /**< Mount, robot frame [m]. Default 0. */
    double yaw_rad;     /**< Mount, robot frame [rad]. Default 0. */
    float range_min_m;  /**< Readings below are the housing, dust or an error [m]; >= 0. Default
                                   0.02: usual lidars measure no nearer, so that none is lost. */
    float range_max_m;  /**< Usable maximum: at or beyond it a reading is "no return", free up
                                   to here [m]; > range_min_m. Default 30. */
    float range_var_m2; /**< Variance of a range [m2]; raises the beam's noise. Default 0. */
    const gpom_mask_t *masks;  /**< n_masks finite masks, or NULL; read during insertion only. */
    uint16_t n_masks;          /**< Default 0. */
    uint8_t upside_down;       /**< 1: mounted upside down, bearings run clockwise. Default 0. */
    uint8_t zero_is_no_return; /**< 1: a reading of 0 is "no return", as many drivers send it.
                                    Warning: some sensors also read 0 when they are covered. The map
                                    then shows free space there. 0, the default: ignored. */
    uint8_t too_near_is_no_return; /**< 1: a reading above 0 and below range_min_m is "no return".
                                         Default 0. */
} gpom_sensor_t;

/** A robot pose in the map frame. */
typedef struct {
    double x_m;       /**< [m], within GPOM_PLACE_MAX_M (map.h) */
    double y_m;       /**< [m], likewise */
    double yaw_rad;   /**< [rad], any number of turns up to 1e6 rad */
    const float *cov; /**< 3 x 3 covariance of (x, y, yaw) by rows [m2, m rad, rad2], symmetric and
                           positive semidefinite, variances at most 1e12; NULL: known exactly. */
} gpom_pose_t;

/** One planar scan, all beams at one time and from one pose; else gpom_sweep_t. */
typedef struct {
    int64_t stamp_us;      /**< Time of measurement [us]; kept with the beams. */
    double angle_min_rad;  /**< Bearing of the first range, sensor frame [rad]. */
    double angle_step_rad; /**< Bearing step, negative if clockwise [rad]. */
    const float *ranges_m; /**< n_ranges ranges [m]; NaN: ignore; +inf: no return; 0 and less than
                            range_min_m: see gpom_sensor_t. Any bits allowed. */
    uint32_t n_ranges;     /**< 0 .. GPOM_RANGES_MAX. */
} gpom_scan_t;

/** A scan of a sensor that turns while the robot moves: every beam has a bearing and a pose of its
 *  own. To the map it is one scan of one time. */
typedef struct {
    int64_t stamp_us;          /**< As in gpom_scan_t: one for all beams. */
    const float *ranges_m;     /**< n_ranges ranges [m], as in gpom_scan_t. */
    const float *bearings_rad; /**< n_ranges bearings in the sensor frame [rad], finite. */
    const gpom_pose_t *poses;  /**< n_ranges poses of the robot, each at the time of its beam. */
    uint32_t n_ranges;         /**< 0 .. GPOM_RANGES_MAX; 0: the arrays may be NULL. */
} gpom_sweep_t;

/** Fill with the documented defaults.
 *
 *  Cost: O(1). */
GPOM_API void gpom_sensor_init(gpom_sensor_t *sensor);

/** Insert a scan. A query right after sees every beam that was kept and is not provisional
 *  (live.h). Readings that cannot be used are counted by cause in
 *  gpom_stats_t and ignored. A full map takes every scan: less useful beams are evicted
 *  (gpom_stats_evicted()), or a new beam that is not more useful is not kept (beams_redundant).
 *
 *  Position uncertainty at the hit raises the noise of the beam's points: with standard deviation d
 *  and rho the prior correlation over the distance d, y = f(x) + e seen at an unsure place has
 *  noise (sn2 + (1 - rho^2) k(x, x)) / rho^2. d^2 is the range variance plus the pose covariance
 *  carried to the hit, as the mean over directions: half of its sum over x and y.
 *
 *  Errors  GPOM_ERR_ARG    null, or a field of sensor or scan out of range; map unchanged.
 *          GPOM_ERR_ARG    pose not finite or beyond GPOM_PLACE_MAX_M, or covariance not valid;
 *                          counted, map unchanged.
 *          GPOM_ERR_REACH  sensor beyond GPOM_REACH_M of the origin; counted, map unchanged.
 *                          If the origin follows the robot (rebase_m) and beams are kept, a pose
 *                          out of reach of the old origin is refused until the 10th in a row, each
 *                          near the one before. gpom_map_jump() is for real jumps of the map frame.
 *  Cost: O(n_ranges (1 + n_masks)), and walks of the trees: docs/costs.md has the bound. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_scan_insert(gpom_map_t *map, const gpom_scan_t *scan,
                                                       const gpom_sensor_t *sensor,
                                                       const gpom_pose_t *pose);

/** Insert a scan whose beams have poses of their own. With equal poses and evenly spaced bearings
 *  it is gpom_scan_insert(), bit for bit.
 *
 *  pose    the robot at stamp_us: where the low-resolution map and the origin follow it. The beams
 *          do not use it.
 *  Errors  as gpom_scan_insert(), of `pose` or of any beam's; the map is unchanged.
 *  Cost: as gpom_scan_insert(), and 60 operations more a beam, half of them in double. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_sweep_insert(gpom_map_t *map, const gpom_sweep_t *sweep,
                                                        const gpom_sensor_t *sensor,
                                                        const gpom_pose_t *pose);

#ifdef __cplusplus
}
#endif
#endif
