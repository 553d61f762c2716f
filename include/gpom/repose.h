/** \file repose.h
 *  A map that follows its poses: a SLAM corrects the past, and kept beams move with their scans.
 *
 *  Poses drift. When a SLAM closes a loop, it corrects the poses of the past. A grid is then wrong
 *  for ever, because it no longer knows which scan filled which cell. This map keeps beams, and
 *  each beam keeps the stamp of its scan, so that the beams can move.
 *
 *  A beam of stamp t moves rigidly. Let p(t) and q(t) be the pose of the robot before and after the
 *  correction, each interpolated linearly between the corrections around t. A point x of the beam
 *  goes to q + R (x - p), where R turns by the difference of the yaw angles. A beam older than the
 *  first correction moves like the first one, a beam newer than the last one like the last one.
 *
 *  Hits that are past or provisional stand again. In a frame that drifted, later scans missed these
 *  hits because the poses were wrong. That says nothing of the place. Hits keep how often scans
 *  agreed on them; scans in a row that saw through them no longer count. What really left is
 *  cleared again by the next scans that see through it. */
#ifndef GPOM_REPOSE_H
#define GPOM_REPOSE_H

#include "gpom/scan.h"

#ifdef __cplusplus
extern "C" {
#endif

/** One corrected pose of the robot. */
typedef struct {
    int64_t stamp_us; /**< Time of the pose [us], by the clock of the scans' stamps. */
    gpom_pose_t from; /**< The pose with which scans of this time were inserted, or the pose to
                           which the last correction moved them. `cov` is not read. */
    gpom_pose_t to;   /**< The corrected pose. `cov` is not read. */
} gpom_correction_t;

/** What gpom_map_repose() did. */
typedef struct {
    uint32_t n_moved;     /**< Beams that moved; the next two are among them. */
    uint32_t n_before;    /**< Beams older than the first correction. */
    uint32_t n_after;     /**< Beams newer than the last correction. */
    uint32_t n_restored;  /**< Hits that were past or provisional and stand now. */
    uint32_t n_forgotten; /**< Beams that would be out of reach of the origin; they are removed
                               (beams_forgotten in gpom_stats_t). */
} gpom_repose_report_t;

/** Move the kept beams with their scans. A new frame epoch begins. All cells of the low-resolution
 *  map become unknown in one change, because their values belong to the old frame; gpom_map_step()
 *  evaluates them again, nearest the robot first.
 *
 *  Queries are exact at once. Until gpom_map_step() has built the trees anew (GPOM_INDEX_ITEM_OPS
 *  per item, both trees), each search looks at all beams one by one: O(beams) for a packet of
 *  queries, and O(beams) for each new beam of a scan. So call gpom_map_step() before the next scan
 *  if time allows. The robot's place moves, too; the origin does not.
 *
 *  corrections  n corrections with strictly rising stamps and poses as in gpom_scan_insert().
 *  report       output, or NULL.
 *  Errors       GPOM_ERR_ARG (null, n is 0, stamps do not rise, a pose is not finite),
 *               GPOM_ERR_REACH (a correction moves a pose that is within reach of the origin out
 *               of reach: it is wrong, or a new map must begin). After an error nothing changed.
 *  Cost: O(n + beams log n + low-resolution cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_repose(gpom_map_t *map,
                                                      const gpom_correction_t *corrections,
                                                      size_t n, gpom_repose_report_t *report);

#ifdef __cplusplus
}
#endif
#endif
