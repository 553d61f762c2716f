/** \file live.h
 *  A map that lives on a vehicle for long: work in slices, forgetting, jumps of the map frame.
 *
 *  What happens to the beams of a scan while keep_m > 0:
 *  - A return within keep_m of a kept hit is not kept; it counts for that hit, up to 15 times. A
 *    hit without counts has the noise sn2_once (params.h), one with counts sn2.
 *  - A scan sees through a kept hit if one of its beams passes the hit within 0.15 keep_m. A scan
 *    also sees through the hit if two neighbours in the scan pass it, one on either side, and are
 *    keep_m apart or less at the hit. Each such scan of a different time takes counts from the hit:
 *    the first in a row takes 1, the next ones 2, 4 and 8. The hit becomes past when it has no
 *    count left and at least clear_scans scans in a row saw through it. The beams of the last of
 *    these scans are kept.
 *  - A beam that passes within 0.15 keep_m of a hit that stands is refused: it is not kept, and
 *    counts as beams_contradicting. Some hits refuse nothing: a hit nearer than 2 keep_m to the
 *    sensor that saw it, and a hit that three or more scans in a row saw through. At one time in
 *    eight no hit refuses a beam. So a beam that ends behind a hit is kept after at most 13 times.
 *    This holds even if the hit is confirmed in between, for scans of one sensor or of up to three
 *    sensors in turn.
 *  - A past hit tells queries that something may stand there. Its noise is 2 sn2 + k**, as if its
 *    place were uncertain with rho^2 = 1/2 (scan.h). Only queries use a past hit: returns near it
 *    are new, and beams that pass it are kept. If an older past hit is within keep_m, a hit is
 *    dropped instead of becoming past.
 *  - A return is marked as arrived if free segments of earlier scans pass it within 0.6 keep_m and
 *    no hit within 2 keep_m was known before its scan. Later returns beside it are marked, too.
 *    After scans of three more times returned from it and no beam passed it, the free segments
 *    that pass it within 0.6 keep_m, or cross its depth_m, are dropped: something stands there now.
 *  - A return is provisional if free segments pass it within 0.15 keep_m and no hit at all is
 *    within 2 keep_m. A return is also provisional if its own scan looks past it: the beams before
 *    and after it in the scan pass it keep_m away or nearer, and reach 2 keep_m beyond it. Then it
 *    is thin, or wrong. Queries do not see a provisional hit until a scan of another time returns
 *    from within keep_m of it; then the free segments there are dropped at once. A provisional beam
 *    is dropped if a beam passes it within 0.15 keep_m, or if beam_max / 16 + 8 younger ones wait.
 *  - A return from a kept hit whose beam has no free segment replaces that beam.
 *  - A beam whose end is known worse than 2 keep_m (standard deviation) sees through nothing, and
 *    never becomes provisional. With clear_scans 0 no hit is past, arrived or provisional.
 *  - A beam without return is kept if its end is 4 keep_m or more from every free segment.
 *  - In a full map the less useful of the next two beams in turn is evicted, if the new beam is
 *    more useful; else the new beam is dropped. The worth of a beam is the squared distance from
 *    its hit to the nearest other hit, at most that of 16 keep_m. A free segment without a hit, or
 *    with a past hit, is worth as much as a hit whose nearest one is 2 keep_m away. A provisional
 *    beam and a past hit alone are worth nothing. The usefulness is the worth divided by 1 +
 *    (distance from the robot / far_m)^2 + age / old_s + scans in a row that saw through the hit.
 *    The eviction is counted under its greatest cause: a distance below 2 keep_m, or no cause at
 *    all (beams_evicted_redundant), or a term of the divisor (_far, _old, _contradicted). A past
 *    hit alone counts as contradicted, a provisional beam as beams_not_confirmed.
 *
 *  \verbatim
 *  a return on known free space,        any other return
 *  or one that its scan looks past      that is kept
 *            |                              |  .--. confirmed: + 1 count
 *            v                              v  |  v seen through: - 1, 2, 4, 8
 *     +-------------+  confirmed by     +----------+  no count is left and    +------+
 *     | provisional |------------------>| standing |------------------------->| past |
 *     +-------------+  another time     +----------+  clear_scans in a row    +------+
 *            |                               |        saw through it           |  |
 *            |      cleared within keep_m of |                                 |  |
 *            |      a past hit, or forgotten |                                 |  |
 *            |                               v                                 |  |
 *            |  a beam without return    +------+   its end is forgotten       |  |
 *            |  ------------------------>| none |<-----------------------------'  |
 *            |                           +------+ only the free segment is known  |
 *            | a beam passes it, or          | the free segment gives way         |
 *            | too many younger ones wait    v                                    |
 *            |                           +------+                                 |
 *            '-------------------------->| gone |<--------------------------------'
 *                                        +------+  evicted, forgotten, out of reach:
 *                                                  from every state
 *  \endverbatim
 *
 *  Margins shrink towards a beam's end: 0.15 keep_m, and keep_m for neighbours on either side, to
 *  0.05 of the way it has still to go, 0.6 keep_m to 0.2 of it. Neighbours are beams that come one
 *  after the other in the scan's order, in the same group of 16. */
#ifndef GPOM_LIVE_H
#define GPOM_LIVE_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Operations that one item of index building counts in a budget. */
#define GPOM_INDEX_ITEM_OPS 4u

/** Least budget of gpom_map_step() with which both trees and raster make progress in every step,
 *  for n = n_hits + n_free. */
#define GPOM_STEP_OPS_MIN(n) ((uint64_t)2 * GPOM_LOWRES_BATCH_OPS(n))

/** Do a slice of the work that scans leave behind: index recent beams, and evaluate dirty cells of
 *  the low-resolution map (lowres.h). Answers of queries are the same before and after. Queries
 *  become faster and cells fresher. Call it once a control period, and more often when the vehicle
 *  is idle.
 *
 *  The building of the index starts when 32 beams are recent, or when many hits and free segments
 *  have vanished since the last one was built: 32, and one more for every 8 beams of the map. It
 *  gets half of the budget while there are dirty cells.
 *
 *  budget   operations; each takes a handful of instructions. An item of an index counts
 *           GPOM_INDEX_ITEM_OPS, a cell counts GPOM_LOWRES_CELL_OPS(). The search of a cell always
 *           counts 1024 operations, whatever it really costs. For a watchdog: one call does at most
 *           budget / GPOM_LOWRES_CELL_OPS() searches, each bounded like the search of a query.
 *  scratch  as for a query; NULL: no cells are evaluated.
 *  used     output: the operations done, never more than budget. 0: nothing was left to do, or
 *           budget was too small for it. NULL is allowed.
 *  Errors   GPOM_ERR_ARG, GPOM_ERR_MEM (scratch).
 *  Cost: at most `budget` operations. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_step(gpom_map_t *map, uint64_t budget,
                                                    const gpom_scratch_t *scratch, uint64_t *used);

/** A disc in the map frame [m]. */
typedef struct {
    double x_m;      /**< Centre, map frame [m]. */
    double y_m;      /**< Centre, map frame [m]. */
    double radius_m; /**< > 0, at most 2 GPOM_REACH_M. */
} gpom_disc_t;

/** Forget what is known inside a disc: hits in it, and the part of every free segment in it. A
 *  beam that ends in the disc keeps the part before the disc. A beam that crosses the disc keeps
 *  the part behind it if it has a hit, else the part before it. Nothing becomes free that was not.
 *
 *  Errors  GPOM_ERR_ARG (null, not finite, radius out of range).
 *  Cost: O(beams kept + beams in the disc * low-resolution cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_forget(gpom_map_t *map, const gpom_disc_t *disc);

/** What becomes of the map when its frame jumps. */
typedef enum {
    GPOM_JUMP_KEEP = 0,   /**< Keep all: the localiser corrected itself by little. */
    GPOM_JUMP_FORGET = 1, /**< Forget a disc, where old and new beams would contradict. */
    GPOM_JUMP_CLEAR = 2   /**< Forget all: poses before and after have nothing in common. */
} gpom_jump_t;

/** Tell the map that the localiser's map frame jumped. A new frame epoch begins; readers of the
 *  low-resolution map see it. `rule` says what becomes of the map.
 *
 *  disc    what to forget with GPOM_JUMP_FORGET. Other rules ignore it; then NULL is allowed.
 *  Errors  GPOM_ERR_ARG (null, no such rule, disc as in gpom_map_forget()); then nothing changed.
 *  Cost: GPOM_JUMP_KEEP O(1); _FORGET as gpom_map_forget(); _CLEAR as gpom_map_clear(). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_jump(gpom_map_t *map, gpom_jump_t rule,
                                                    const gpom_disc_t *disc);

/** Let the free segments of new beams begin late where others already crowd. Searches of dense maps
 *  then look at fewer free segments.
 *
 *  A new beam that is kept is walked back from the end of its free segment, in cells of late_m. A
 *  cell is crowded if two kept free segments pass its centre nearer than late_m / 2. The beam
 *  begins where the first crowded cell ends, but keeps at least its last 12 late_m and its last
 *  2 keep_m. If none of the last 2048 cells is crowded, it begins at the sensor.
 *  Its end and its hit stay. gpom_map_beam() tells where it begins. The setting belongs to the map
 *  in memory: it outlasts gpom_map_clear() and gpom_snapshot reads, but is not part of a snapshot.
 *
 *  Half of keep_m suits live maps, with parameters learnt on such a map; what it costs otherwise is
 *  in docs/decisions/late-starts.md. A program that does not call this does not contain it.
 *
 *  late_m  side of a cell; 1e-3 .. 1e3 [m]. 0: beams begin at the sensor, as in a new map.
 *  Errors  GPOM_ERR_ARG (null, not finite, out of range); then nothing changed.
 *  Cost: O(1). Each beam that is kept later takes one traversal of the free segments for each 32
 *  cells that it is walked back. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_begin_late(gpom_map_t *map, float late_m);

/** Origin of the map: beams are kept relative to this point of the map frame. It moves with the
 *  robot if rebase_m is set.
 *
 *  Errors  GPOM_ERR_ARG.
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_origin(const gpom_map_t *map, gpom_point_t *origin);

#ifdef __cplusplus
}
#endif
#endif
