/** \file exchange.h
 *  Beams leave a map and enter another one with their history: two robots make one map, a stored
 *  map joins a running one, or a robot hands a region to another.
 *
 *  What a hit knows goes along: how often scans agreed on it, and whether it waits or is past. So a
 *  hit that five scans agreed on is not cleared by two scans of the receiver.
 *
 *  The receiver's rules hold. A hit that stands within keep_m of a kept hit confirms it: the kept
 *  hit gets the counts of both, and one more. If the map is full, the less useful beam goes
 *  (live.h). Beams that contradict each other are both kept; the next scans decide. */
#ifndef GPOM_EXCHANGE_H
#define GPOM_EXCHANGE_H

#include "gpom/live.h"
#include "gpom/scan.h"

#ifdef __cplusplus
extern "C" {
#endif

/** How far an export has come. Set `disc`, and the rest to 0. */
typedef struct {
    const gpom_disc_t *disc; /**< Only beams that start or end in the disc; NULL: all. */
    uint32_t i_slot;         /**< The next slot; the call moves it. All beams were copied when it
                                  reaches gpom_map_slot_count(). */
    uint32_t n;              /**< Output: beams that the last call copied. */
} gpom_export_t;

/** Copy kept beams out of a map, some at each call. The map does not change. If it changes between
 *  two calls, a beam may be missing or come twice.
 *
 *  beams     output: progress->n beams, at most beam_max.
 *  beam_max  room in `beams`; at least 1.
 *  Errors    GPOM_ERR_ARG (null, beam_max is 0, the disc as in gpom_map_forget()).
 *  Cost: O(slots passed). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_export_beams(const gpom_map_t *map,
                                                            gpom_export_t *progress,
                                                            gpom_beam_t *beams, size_t beam_max);

/** The same pose in the frames of two maps, for example a predicted and an aligned pose. Best near
 *  the beams: turned coordinates are exact to 1e-7 of the distance from it. `cov` is not read. */
typedef struct {
    gpom_pose_t from; /**< In the frame of the other map. */
    gpom_pose_t to;   /**< In the frame of this map. */
} gpom_frames_t;

/** What gpom_map_import_beams() did with the beams. The sum of all is their number. */
typedef struct {
    uint32_t n_kept;         /**< Kept. */
    uint32_t n_known;        /**< Not kept: the hit confirms a kept hit, or another past hit is near
                                  and there is no free segment. */
    uint32_t n_not_useful;   /**< Not kept: the map is full of more useful beams, or ids are spent
                                  (beams_ids_spent in gpom_stats_t). */
    uint32_t n_out_of_reach; /**< Not kept: the sensor is beyond GPOM_REACH_M from the origin. */
    uint32_t n_damaged;      /**< Not kept: a number is not finite, a direction is no unit vector,
                                  or the parts do not fit together. */
} gpom_import_report_t;

/** Put beams of another map into a map. They are not counted as beams of scans in gpom_stats_t.
 *  The low-resolution cells near them become dirty.
 *
 *  beams     n beams, as gpom_map_export_beams() gives them. Any bits are allowed. A stamp before
 *            stamp0_us of the low-resolution map (lowres.h) moves it back, by up to 2^31 ms.
 *  frames    a pose in both frames; NULL: the frames are the same.
 *  report    output, or NULL.
 *  Errors    GPOM_ERR_ARG (null, a pose is not finite); then nothing changed.
 *  Cost: for each beam as for a new beam of a scan (scan.h); where stamp0_us moves, also
 *        O(slots + cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_import_beams(gpom_map_t *map,
                                                            const gpom_beam_t *beams, size_t n,
                                                            const gpom_frames_t *frames,
                                                            gpom_import_report_t *report);

#ifdef __cplusplus
}
#endif
#endif
