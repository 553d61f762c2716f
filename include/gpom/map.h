/** \file map.h
 *  A map: beams and their index, inside memory that the caller hands over once.
 *
 *  Threads: any number of queries may run at once on one map. While a call with a non-const map
 *  runs, no other call may run on this map, except gpom_lowres_copy(), gpom_lowres_info() and
 *  gpom_sectors(): these may run in any thread at any time (lowres.h). Different maps are
 *  independent, because the library has no global state. */
#ifndef GPOM_MAP_H
#define GPOM_MAP_H

#include "gpom/params.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Beams and queries stay within this distance of the origin [m]. The resolution of float32 is 1 mm
 *  there. */
#define GPOM_REACH_M 8000.0

/** Poses and origins stay within this distance of the map frame's zero, in x and in y [m]. No grid
 *  coordinates on Earth are greater. The resolution of double is 15 nm there. */
#define GPOM_PLACE_MAX_M 1e8

/** Largest beam_max of a map. */
#define GPOM_BEAM_MAX 20000000u

/** Most cells of the low-resolution map, coarse and focus layer together. */
#define GPOM_CELL_MAX 268435456u

/** Default of walk_max: how often a query may walk down a search tree. A map of B beams never needs
 *  more than B / 8 + 1 walks. So this default cuts no query on a map of less than 131,000 beams. */
#define GPOM_WALK_MAX 16384u

/** Bytes of memory for a map of `beam_max` beams and `cell_max` low-resolution cells, cell_max =
 *  lowres_nx lowres_ny + focus_cell_max. Never less than gpom_map_bytes(). This is a constant
 *  expression, so it can size a static array. A beam takes 62 bytes: 36 for the beam, 8 in each of
 *  two trees, 8 in the tree that is being built, 2 in lists. A cell takes 8 bytes. */
#define GPOM_MAP_BYTES(beam_max, cell_max)                                                         \
    ((size_t)3136 + (size_t)61 * (size_t)(beam_max) + (size_t)(beam_max) / 32 * 9 +                \
     (size_t)8 * (size_t)(cell_max))

/** Configuration of a map. Fill with gpom_config_init(), then change. */
typedef struct {
    uint32_t struct_bytes; /**< Set by gpom_config_init(); guards against a header mismatch. */
    uint32_t beam_max;     /**< Most beams kept; 1 .. GPOM_BEAM_MAX. Default 1024. */
    uint32_t clear_scans;  /**< A hit is given up when this many scans in a row, of different
                                times, saw through it: 0 (never) or 2 .. 4. Needs keep_m > 0.
                                Default 0. */
    float keep_m;          /**< A return this near to a kept hit is not kept; it confirms that
                                hit. >= 1e-3 [m]. With 0, the default, every beam is kept. */
    float far_m;           /**< When the map is full, a beam this far from the robot is worth half
                                as much; >= 0 [m]. Default 0: distance does not count. */
    float old_s;           /**< When the map is full, a beam of this age is worth half as much;
                                >= 0 [s]. Default 0: age does not count. */
    float rebase_m;        /**< When the robot is farther than this from the origin, the origin
                                moves to the robot by whole metres; 0 .. GPOM_REACH_M / 2 [m].
                                Must be 0 in frame "map". Default 0: the origin never moves.
                                Choose 20 m or more, because each move restarts the building of
                                trees. A move forgets beams beyond GPOM_REACH_M of the new origin.
                                A pose beyond GPOM_REACH_M of the old origin is refused, except in
                                two cases: the map is empty, or it is the 10th such pose in a row,
                                each within GPOM_REACH_M of the one before. In the second case the
                                kept beams came from a wrong pose. */
    double origin_x_m;     /**< Origin, map frame x (east) [m]. Beams are kept relative to the
                               origin. Within GPOM_PLACE_MAX_M. Default 0. */
    double origin_y_m;     /**< Origin, map frame y (north) [m]. Within GPOM_PLACE_MAX_M.
                                Default 0. */
    gpom_params_t params;  /**< Hyperparameters; the map copies them. Default gpom_params_init(). */
    uint32_t walk_max;     /**< Most walks of one query down each of the two search trees; >= 1. A
                               walk reaches at most one leaf of 8 beams. A query that needs more
                               walks is cut (GPOM_ANSWER_CUT). Default GPOM_WALK_MAX. */

    /* The low-resolution map (lowres.h). Defaults 0: the map has none. */

    double lowres_cell_m;    /**< Side of a coarse cell [m]; 1e-3 .. 1e6 if there are cells. */
    double lowres_x0_m;      /**< Lower left corner of a fixed raster, x in the map frame [m]. */
    double lowres_y0_m;      /**< Lower left corner of a fixed raster, y in the map frame [m]. */
    uint32_t focus_cell_max; /**< Most cells of the focus layer; >= 4, or 0: no focus layer. Needs a
                               coarse layer. */
    float lowres_reach_m;    /**< A scan marks a cell if the cell's centre is within this distance
                                  of a beam: of its free part or of its hit [m]. 0 ..
                                  GPOM_REACH_M; 0 means two cells. A beam can also change cells
                                  farther away, when it becomes one of their nearest. Those cells
                                  are evaluated when no cell is dirty (lowres.h, item 4). */
    float lowres_unknown;    /**< A cell is unknown if its variance exceeds this part of the prior
                               variance; 0 .. 1. Default 0.95. */
    uint16_t lowres_nx;      /**< Coarse cells along x. lowres_nx = lowres_ny = 0: no raster. */
    uint16_t lowres_ny;      /**< Coarse cells along y. */
    uint8_t lowres_rolling;  /**< 1: the raster follows the robot by whole cells. The robot stays
                                 within lowres_nx / 8 and lowres_ny / 8 cells of the middle. Cell
                                 edges are at whole multiples of lowres_cell_m in the map frame.
                                 Cells that leave the raster are lost; cells that enter it are
                                 unknown. 0: the raster is fixed. */
} gpom_config_t;

/** A map in the caller's memory. Opaque. */
typedef struct gpom_map gpom_map_t;

/** What happened to all scans and beams so far. Counters only rise, and gpom_map_clear() keeps
 *  them. Each counter stands for one cause. */
typedef struct {
    uint64_t scans_inserted;      /**< Scans inserted. */
    uint64_t scans_bad_pose;      /**< Refused: the pose is not finite or beyond GPOM_PLACE_MAX_M,
                                       or its covariance is not valid. */
    uint64_t scans_out_of_reach;  /**< Refused: the sensor is farther than GPOM_REACH_M from the
                                       origin. */
    uint64_t beams_hit;           /**< Kept: a return. */
    uint64_t beams_no_return;     /**< Kept: no return. The beam is free up to the usable maximum
                                       and has no hit. */
    uint64_t beams_nan;           /**< Ignored: the range is NaN. */
    uint64_t beams_not_positive;  /**< Ignored: the range is <= 0, minus infinity included. A 0
                                       that means "no return" (scan.h) is not counted here. */
    uint64_t beams_too_near;      /**< Ignored: the range is below the sensor's minimum. A range
                                       that means "no return" (scan.h) is not counted here. */
    uint64_t beams_masked;        /**< Ignored: the bearing is inside one of the sensor's masks. */
    uint64_t beams_known;         /**< Not kept: the beam confirms what is known (keep_m). */
    uint64_t beams_contradicting; /**< Not kept: the beam passes hits that still stand (live.h). */
    uint64_t beams_redundant;     /**< Not kept: the map was full of more useful beams. */
    uint64_t beams_ids_spent;     /**< Not kept: 2^31 beams were kept since the map was last made,
                                       cleared or read from a snapshot. */
    uint64_t beams_evicted_redundant; /**< Removed, as the least useful when the map was full
                                           (live.h): its hit was near another hit. */
    uint64_t beams_not_confirmed;     /**< Removed: provisional, and no second scan saw it before
                                           a beam passed it or its room was needed. */
    uint64_t hits_cleared;    /**< Hits that became past or were removed: scans of several times
                                   saw through them. */
    uint64_t beams_forgotten; /**< Removed by gpom_map_forget(), or out of reach of a new origin. */
    uint64_t free_cleared;    /**< Removed: scans of several times saw a hit on the free segment. */
    uint64_t cells_cut;       /**< Evaluations of low-resolution cells whose search was cut
                                   (walk_max). */
    uint64_t beams_evicted_far; /**< Removed when the map was full: far from the robot (far_m). */
    uint64_t beams_evicted_old; /**< Removed when the map was full: old (old_s). */
    uint64_t beams_evicted_contradicted; /**< Removed when the map was full: scans saw through its
                                              hit. If the hit was past, the beam held nothing
                                              else. */
} gpom_stats_t;

/** One kept beam, for inspection. */
typedef struct {
    double x_m;       /**< Sensor position, map frame [m]. A beam that begins late
                              (gpom_map_begin_late()) or behind a forgotten disc has its own
                              beginning here, and range_m counts from it. */
    double y_m;       /**< The same, y [m]. */
    int64_t stamp_us; /**< Time of its scan, to a millisecond [us]. */
    float dir_x;      /**< Unit direction, map frame. */
    float dir_y;      /**< Unit direction, map frame. */
    float range_m;    /**< Raw range [m]. For a beam without return: the usable maximum. */
    float hit_noise;  /**< Noise variance of its hit [1]: sn2, sn2_once, or that of a past hit
                              (live.h). Position uncertainty raises it. */
    float free_noise; /**< Noise variance of its free points [1]: sn2_free. Position
                              uncertainty raises it. */
    float excess;     /**< How much an uncertain place raises both: sn2 becomes
                              sn2 + excess (sn2 + k(x, x)); >= 0. */
    uint32_t id;      /**< Order of insertion. Starts again at 0 when a map is cleared or read. */
    uint8_t is_hit;   /**< 1: its hit at range_m is known. 0: it has no hit, or the hit was
                              given up. */
    uint8_t is_free;  /**< 1: it is known to be free from the sensor to the gap before range_m. */
    uint8_t returned; /**< 1: range_m is the range of a return, and the free segment ends a gap
                              before it. */
    uint8_t provisional; /**< 1: the hit contradicts what was known, or what its own scan saw
                              beside it. Queries do not see the beam until the hit is confirmed. */
    uint8_t past;        /**< 1: scans of several times saw through its hit (live.h). */
    uint8_t n_agreed;    /**< Number of scans of other times that saw the hit again, up to 15. */
    uint8_t n_against;   /**< Scans in a row that saw through the hit, up to 3. */
    uint8_t arrived;     /**< 1: the hit came where free segments of earlier scans ran (live.h). */
    uint16_t scan;       /**< Number of its scan, modulo 2^16. */
} gpom_beam_t;

/** Fill with the documented defaults.
 *
 *  Cost: O(1). */
GPOM_API void gpom_config_init(gpom_config_t *config);

/** Check every field, hyperparameters included.
 *
 *  problem  NULL, or where to put a static one-line text "field: what is wrong". The text is NULL
 *           if all is well, or if config is NULL.
 *  Errors   GPOM_ERR_ARG (null, not from gpom_config_init(), or a value out of range),
 *           GPOM_ERR_PARAMS (a field of `params` is refused; the text is that of
 *           gpom_params_check()).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_config_check(const gpom_config_t *config,
                                                        const char **problem);

/** Exact bytes that gpom_map_init() needs; 0 if config is NULL or a capacity is out of range.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_map_bytes(const gpom_config_t *config);

/** Build an empty map inside memory of the caller. `*map` points into `mem`. There is nothing to
 *  destroy.
 *
 *  mem        8-byte aligned. The caller owns it, keeps it longer than the map, and does not move
 *             it.
 *  mem_bytes  at least gpom_map_bytes(config); GPOM_MAP_BYTES(beam_max, cell_max) is always enough.
 *  Errors     GPOM_ERR_ARG, GPOM_ERR_PARAMS (gpom_config_check() names the field), GPOM_ERR_MEM.
 *             *map is NULL after any error.
 *  Cost: O(low-resolution cells + beam_max / 128). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_init(gpom_map_t **map, const gpom_config_t *config,
                                                    void *mem, size_t mem_bytes);

/** Forget all beams. All low-resolution cells become unknown. Ids start again at 0; counters keep
 *  their values.
 *
 *  Cost: O(low-resolution cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_clear(gpom_map_t *map);

/** Index all beams in the two static KD-trees. This only makes queries faster: answers are the same
 *  before and after, because beams that are not indexed are searched one by one.
 *
 *  Cost: typically 24 n log2(n) comparisons for n beams, at most 66 n log2(n). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_build(gpom_map_t *map);

/** Copy the counters.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_stats(const gpom_map_t *map, gpom_stats_t *stats);

/** Sum of the four counters beams_evicted_...; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint64_t gpom_stats_evicted(const gpom_stats_t *stats);

/** Number of beams kept now; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_map_beam_count(const gpom_map_t *map);

/** Number of slots of the beam store in use, counted from slot 0; some may be vacant. 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_map_slot_count(const gpom_map_t *map);

/** Copy the beam in slot `i_slot` (0 .. gpom_map_slot_count() - 1). A vacant slot gives all zeros:
 *  neither is_hit nor is_free is set. Slots are in the order of insertion until a beam is removed.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_beam(const gpom_map_t *map, uint32_t i_slot,
                                                    gpom_beam_t *beam);

#ifdef __cplusplus
}
#endif
#endif
