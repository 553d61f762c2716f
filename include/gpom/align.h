/** \file align.h
 *  Scan alignment: which pose of the robot fits a scan best to the map? It needs a prediction, for
 *  example the last pose carried on by odometry. A robot with wheels and a lidar builds a map with
 *  it: predict, align, insert.
 *
 *  Each return is compared with a line through the kept hits nearest to it. Only hits count that
 *  stand and that a scan saw from the same side of the surface. The lines are searched again after
 *  each step of the pose, first in a wide circle and then in narrower ones. Returns that fit badly
 *  weigh little (Cauchy). This is point-to-line ICP (Censi 2008) against a map instead of a scan.
 *
 *  Threads: as for queries (map.h). The map is not changed. */
#ifndef GPOM_ALIGN_H
#define GPOM_ALIGN_H

#include "gpom/query.h"
#include "gpom/scan.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Flag: too few returns had kept hits near them. Pose and covariance are those predicted. */
#define GPOM_ALIGN_FEW 1u
/** Flag: the scan does not say where the robot is along one direction, for example in a corridor.
 *  The direction is weak_x, weak_y. The pose along it comes mostly from the prediction. */
#define GPOM_ALIGN_AMBIGUOUS 2u
/** Flag: the scan does not say how the robot is turned, for example in a round room. */
#define GPOM_ALIGN_AMBIGUOUS_YAW 4u
/** Flag: the last step was still large. The pose may be some steps away from the best one. */
#define GPOM_ALIGN_NOT_CONVERGED 8u
/** Flag: the scan does not fit the map at this pose: residual_m is greater than residual_max_m. The
 *  pose is probably wrong, or the surroundings changed. */
#define GPOM_ALIGN_POOR 16u
/** Flag: the pose is farther from the prediction than the covariance of the prediction allows. */
#define GPOM_ALIGN_FAR 32u
/** Any of these flags: the pose may be wrong. Do not insert the scan. */
#define GPOM_ALIGN_DOUBTFUL (GPOM_ALIGN_NOT_CONVERGED | GPOM_ALIGN_POOR | GPOM_ALIGN_FAR)

/** Most returns of one scan that are used. */
#define GPOM_ALIGN_RETURNS_MAX 4096u

/** Most iterations from one heading. */
#define GPOM_ALIGN_ITERATIONS_MAX 100u

/** Bytes of scratch for an alignment that uses at most n_returns returns. This is a constant
 *  expression, so it can size a static array. */
#define GPOM_ALIGN_BYTES(n_returns) ((size_t)512 + (size_t)64 * (size_t)(n_returns))

/** How to align. Fill with gpom_align_config_init(), then change. */
typedef struct {
    uint32_t struct_bytes;  /**< Set by gpom_align_config_init(); guards against a header
                                   mismatch. */
    uint16_t n_returns_max; /**< Most returns used; if a scan has more, they are taken evenly. 8 ..
                                   GPOM_ALIGN_RETURNS_MAX. Default 180. */
    uint16_t n_iterations;  /**< Most iterations from one heading; 1 ..
                                   GPOM_ALIGN_ITERATIONS_MAX. Default 30. */
    uint16_t n_independent; /**< The errors of neighbouring returns are alike, so that more returns
                                   do not make the pose better. The covariance counts this many of
                                   them; >= 1. Default 10. */
    float return_sd_m;      /**< Standard deviation of a return across its surface, error of the map
                                   included [m]; 1e-4 .. 10. Default 0.03. */
    float residual_good_m;  /**< With a greater residual, other starts are tried [m]; > 0. Default
                                   0.02. */
    float residual_max_m;   /**< With a greater residual, the scan does not fit: GPOM_ALIGN_POOR
                                   [m]; > 0. Default 0.033. */
    float heading_step_rad; /**< The other headings are one and two of these steps away on both
                                   sides [rad]; 0 .. 1. 0: none is tried. Default 0.17. */
    float ambiguous_sd_m;   /**< A direction is ambiguous if the scan alone knows the place along it
                                   worse than this standard deviation [m]; > 0. Default 0.05. */
    float ambiguous_sd_rad; /**< The same for the yaw [rad]; > 0. Default 0.1. */
    float matched_share_min; /**< With a smaller share of the returns matched, the scan is refused:
                                   GPOM_ALIGN_FEW; 0 .. 1. Default 0.3. */
} gpom_align_config_t;

/** What an alignment starts from. */
typedef struct {
    const gpom_sensor_t *sensor;       /**< The sensor of the scan. */
    gpom_pose_t predicted;             /**< Pose of the robot that is expected. It must have a
                                            covariance. It is the prior of the result: give it the
                                            true errors of the prediction, and rather too much. */
    const gpom_align_config_t *config; /**< How to align. */
} gpom_align_task_t;

/** The result of an alignment. */
typedef struct {
    double x_m;          /**< Pose of the robot, map frame [m]. */
    double y_m;          /**< [m] */
    double yaw_rad;      /**< [rad], the predicted yaw plus a turn, so it may exceed one turn. */
    float cov[9];        /**< Covariance of (x, y, yaw) by rows, as in gpom_pose_t. It holds what
                              scan and prediction say together. */
    float residual_m;    /**< Mean distance of the returns from their lines [m]. A return without a
                              line counts 0.05 m if it ends where the map knows free space;
                              otherwise it does not count. */
    float weak_x;        /**< Unit vector, map frame: the direction along which the scan says least
                              about the place. */
    float weak_y;        /**< Component along y. */
    float weak_sd_m;     /**< Standard deviation of the place along it, from the scan alone [m]. */
    float weak_sd_rad;   /**< Standard deviation of the yaw, from the scan alone [rad]. */
    uint16_t n_returns;  /**< Returns used. */
    uint16_t n_matched;  /**< Returns with a line. */
    uint16_t n_new;      /**< Returns at places of which the map knows nothing. */
    uint32_t n_searches; /**< Searches for the nearest hits. */
    uint8_t flags;       /**< 0, or GPOM_ALIGN_… bits. */
} gpom_alignment_t;

/** Fill with the documented defaults.
 *
 *  Cost: O(1). */
GPOM_API void gpom_align_config_init(gpom_align_config_t *config);

/** Align a scan.
 *
 *  scratch  GPOM_ALIGN_BYTES(n_returns_max) bytes of any alignment.
 *  Errors   GPOM_ERR_ARG (null, a field of sensor, scan or config is out of range, or the predicted
 *           pose is not valid or has no covariance), GPOM_ERR_MEM (scratch), GPOM_ERR_REACH (the
 *           sensor would be beyond GPOM_REACH_M of the origin). After an error the alignment is
 *           not written.
 *  Cost: at most 14 n_iterations n_returns_max searches for the 6 nearest hits: from each of 7
 *  starts 2 for each return in each iteration; and one traversal of the free segments for each
 *  return without a line. In practice 2 to 3 searches for each return, and 10 to 40 if the fit is
 *  poor and other starts are tried. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_scan_align(const gpom_map_t *map,
                                                      const gpom_scan_t *scan,
                                                      const gpom_align_task_t *task,
                                                      gpom_alignment_t *alignment,
                                                      const gpom_scratch_t *scratch);

/** Align a scan whose beams have their own poses. All poses move together: the result is where the
 *  predicted pose moves to. task->predicted is the pose of the robot at stamp_us, as in
 *  gpom_sweep_insert().
 *
 *  Errors  as gpom_scan_align(), for the poses of the beams too.
 *  Cost: as gpom_scan_align(). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_sweep_align(const gpom_map_t *map,
                                                       const gpom_sweep_t *sweep,
                                                       const gpom_align_task_t *task,
                                                       gpom_alignment_t *alignment,
                                                       const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
