/** \file live.h
 *  Keeping a map alive on a vehicle: work in slices, forgetting, jumps of the map frame.
 *
 *  What happens to the beams of a scan while keep_m > 0:
 *  - A return within keep_m of a kept hit is not kept; it counts for that hit, up to 15 times. A
 *    hit without counts has the noise sn2_once (params.h), one with counts sn2.
 *  - A beam that passes within 0.15 keep_m of a kept hit speaks against it, and so do two
 *    neighbours in a scan, keep_m apart or less at the hit, that pass on either side of it. The
 *    first of different times in a row takes one count from the hit, then two, four, eight; when
 *    none is left and clear_scans were in a row, the hit is past, and the beams that did it are
 *    kept.
 *  - Beams that pass within 0.15 keep_m of hits that stand are refused: not kept, and counted as
 *    beams_contradicting. A hit nearer than 2 keep_m to the sensor that saw it refuses nothing, nor
 *    does one from the third scan in a row on that sees through it. At one time in eight no hit
 *    refuses a beam, so that what is behind one that is confirmed in between is kept after 13 times
 *    at most (scans of one sensor; of up to three in turn, too).
 *  - A past hit tells queries that something may stand there: as one whose place is so uncertain
 *    that half its say is left (rho^2 = 1/2 in scan.h), noise 2 sn2 + k**. Nothing else minds it:
 *    returns from there are new, beams past it are kept. If another that was past before is within
 *    keep_m of it, it goes: what comes and goes often is told of once.
 *  - A return that free segments of earlier scans pass within 0.6 keep_m, with no hit within
 *    2 keep_m that was known before its scan, is marked as arrived, and so are those beside it
 *    later. When scans of three more times returned from it and no beam passed it, the free
 *    segments go that pass it within 0.6 keep_m or cross its depth_m: what stands there now hides
 *    what was seen before.
 *  - One that free segments pass within 0.15 keep_m, with no hit within 2 keep_m at all, is
 *    provisional: queries do not see it until a scan of another time returns from within keep_m of
 *    it. Then the free segments go at once. It is gone itself once a beam passes within 0.15 keep_m
 *    of it, or when beam_max / 16 + 8 younger ones wait.
 *  - So is one that its own scan looks past: the beams before and after it in the scan's order are
 *    keep_m beside it, or nearer, and reach 2 keep_m beyond it. It is thin, or it is wrong.
 *  - A return from a kept hit without free segment is kept in its place.
 *  - Beams whose end is not known to 2 keep_m (standard deviation) speak against nothing and are
 *    not made to wait. With clear_scans 0 no hit is past, arrived or provisional.
 *  - A beam without return is kept if its end is 4 keep_m or more from any free segment.
 *  - When the map is full, of the next two beams in turn the less useful makes room; if the new
 *    beam is no more useful, it is dropped. A beam is worth its squared gap, from its hit to the
 *    nearest other one, up to 16 keep_m; a free segment without hit, or with a past one, like one
 *    with a gap of 2 keep_m; provisional, or a past hit alone, nothing. That is divided by
 *    1 + (distance from the robot / far_m)^2 + age / old_s + scans in a row that saw through its
 *    hit. What lowers it by the greatest factor is the cause that the eviction is counted under: a
 *    gap of less than 2 keep_m (beams_evicted_redundant, also if nothing does), or a term of the
 *    divisor (_far, _old, _contradicted); a past hit alone is contradicted, and a provisional one
 *    counts as beams_not_confirmed.
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

/** The least budget of gpom_map_step() with which trees and raster both go on in every step, for
 *  n = n_hits + n_free. */
#define GPOM_STEP_OPS_MIN(n) ((uint64_t)2 * GPOM_LOWRES_GROUP_OPS(n))

/** Do a slice of the work that scans leave behind: index recent beams, and evaluate dirty cells of
 *  the low-resolution map (lowres.h). Answers of queries are the same before and after; queries are
 *  faster and cells fresher. Call it once a control period, more often when the vehicle is idle.
 *
 *  Building starts when 32 beams are recent, or an eighth of the map vanished, and has half of the
 *  budget while there are dirty cells.
 *
 *  budget   operations, each a handful of instructions: GPOM_INDEX_ITEM_OPS an item of an index,
 *           GPOM_LOWRES_CELL_OPS() a cell. That counts 1024 for a cell's search whatever it takes,
 *           which for a watchdog is bounded as a query's: budget / GPOM_LOWRES_CELL_OPS() of them.
 *  scratch  as for a query; NULL: no cells are evaluated.
 *  used     operations done, never more than budget; 0: nothing was left to do, or budget was too
 *           small to do it. NULL allowed.
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

/** Forget what is known inside a disc: hits in it, and the stretch in it of every free segment. Of
 *  a beam that ends in it, its free segment remains up to it; of one that crosses it and has a hit
 *  the part behind remains, without a hit the part before. Nothing becomes free that was not.
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

/** The localiser's map frame jumped: begin a new frame epoch, which readers of the low-resolution
 *  map see, by a rule.
 *
 *  disc    what to forget with GPOM_JUMP_FORGET; else ignored, NULL allowed.
 *  Errors  GPOM_ERR_ARG (null, no such rule, disc as in gpom_map_forget()); then nothing changed.
 *  Cost: GPOM_JUMP_KEEP O(1); _FORGET as gpom_map_forget(); _CLEAR as gpom_map_clear(). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_jump(gpom_map_t *map, gpom_jump_t rule,
                                                    const gpom_disc_t *disc);

/** The map frame's point that beams are kept relative to; it moves with the robot if rebase_m is
 *  set. Errors: GPOM_ERR_ARG.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_origin(const gpom_map_t *map, gpom_point_t *origin);

#ifdef __cplusplus
}
#endif
#endif
