/** \file map.h
 *  A map: beams and their index inside memory that the caller hands over once.
 *
 *  Threads: any number of queries may run at once on one map. Nothing may run at the same time as a
 *  call that takes a non-const map, except gpom_lowres_copy() and gpom_lowres_info(), which may run
 *  in any thread (lowres.h). Different maps are independent: the library has no global state. */
#ifndef GPOM_MAP_H
#define GPOM_MAP_H

#include "gpom/params.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Beams and queries stay within this distance of the origin [m] (float32 keeps 1 mm there). */
#define GPOM_REACH_M 8000.0

/** Poses and origins stay within this many metres of the map frame's zero in x and in y: no grid of
 *  the Earth has greater numbers, and double keeps 15 nm there. */
#define GPOM_PLACE_MAX_M 1e8

/** Most beams a map may be configured for. */
#define GPOM_BEAM_MAX 20000000u

/** Most cells of the low-resolution map, coarse and focus layer together. */
#define GPOM_CELL_MAX 268435456u

/** Walks down a search tree that a query may take, unless configured otherwise. A map of B beams
 *  never needs more than B / 8 + 1: this cuts no query of a map of less than 131,000 beams. */
#define GPOM_WALK_MAX 16384u

/** Bytes of memory for a map of `beam_max` beams and `cell_max` = lowres_nx lowres_ny +
 *  focus_cell_max low-resolution cells: a constant expression for a static array, never less than
 *  gpom_map_bytes(). 62 bytes a beam: 36 the beam, 8 in each of two trees and in the one being
 *  built, 2 in lists; 8 bytes a cell. */
#define GPOM_MAP_BYTES(beam_max, cell_max)                                                         \
    ((size_t)3136 + (size_t)61 * (size_t)(beam_max) + (size_t)(beam_max) / 32 * 9 +                \
     (size_t)8 * (size_t)(cell_max))

/** What a map is made for. Fill with gpom_config_init(), then change. */
typedef struct {
    uint32_t struct_bytes; /**< Set by gpom_config_init(); guards against a header mismatch. */
    uint32_t beam_max;     /**< Most beams kept; 1 .. GPOM_BEAM_MAX. Default 1024. */
    uint32_t clear_scans;  /**< Scans of different times in a row that must see through a hit before
                                it is given up: 0 (never) or 2 .. 4. Needs keep_m > 0. Default 0. */
    float keep_m;          /**< A return this near to a kept hit confirms it instead of being kept;
                                >= 1e-3 [m], or 0, the default: every beam is kept. */
    float far_m;           /**< When full, a beam this far from the robot is worth half; >= 0 [m].
                                Default 0: distance does not count. */
    float old_s;           /**< When full, a beam this old is worth half; >= 0 [s]. Default 0: age
                                does not count. */
    float rebase_m;        /**< The origin moves to the robot, by whole metres, when that is farther
                                away; 0 .. GPOM_REACH_M / 2 [m]; 0 in frame "map". Default 0: it
                                stays. Each move starts the building of trees anew: 20 m or more.
                                It forgets beams beyond GPOM_REACH_M of the new origin; a pose
                                beyond that of the old one is refused unless the map is empty, or
                                it is the 10th in a row, each within GPOM_REACH_M of the one before:
                                then what is kept came of a wrong pose. */
    double origin_x_m;    /**< Map frame's east of the origin [m]; beams are kept relative to it. */
    double origin_y_m;    /**< Map frame's north of the origin [m]. Both within GPOM_PLACE_MAX_M;
                               defaults 0, 0. */
    gpom_params_t params; /**< Hyperparameters, copied. Default gpom_params_init(). */
    uint32_t walk_max;    /**< Walks down each of the two search trees that one query may take, each
                               to at most one leaf of 8 beams; a query that needs more is cut
                               (GPOM_ANSWER_CUT). >= 1. Default GPOM_WALK_MAX. */

    /* The low-resolution map (lowres.h). Defaults 0: there is none. */

    double lowres_cell_m; /**< Side of a coarse cell [m]; 1e-3 .. 1e6 if there are cells. */
    double lowres_x0_m;   /**< Lower left corner of a fixed raster, map frame [m]. */
    double lowres_y0_m;   /**< Likewise. */
    uint32_t
        focus_cell_max;   /**< Most cells of the focus layer, which needs a coarse one: >= 4, or 0:
                               none. */
    float lowres_reach_m; /**< A scan marks the cells whose centres are within this distance of a
                                 beam, free or hit [m]; 0 .. GPOM_REACH_M, 0: two cells. A beam can
                                 change farther cells, too, by becoming one of their nearest: they
                                 follow once nothing is dirty (lowres.h, 4). */
    float lowres_unknown; /**< A cell whose variance exceeds this part of the prior variance is
                                 unknown; 0 .. 1. Default 0.95. */
    uint16_t lowres_nx;   /**< Coarse cells along x; both 0: no raster. */
    uint16_t lowres_ny;   /**< Coarse cells along y. */
    uint8_t lowres_rolling; /**< 1: the raster's cells begin at whole multiples of lowres_cell_m in
                                 the map frame, and it moves by whole cells so that the robot stays
                                 within lowres_nx / 8, lowres_ny / 8 cells of its middle; cells that
                                 it leaves are lost, those it gains unknown. 0: fixed. */
} gpom_config_t;

/** A map in the caller's memory. Opaque. */
typedef struct gpom_map gpom_map_t;

/** What happened to every scan and beam ever offered. Counters only rise (gpom_map_clear() keeps
 *  them); each has one cause. */
typedef struct {
    uint64_t scans_inserted;      /**< Scans taken. */
    uint64_t scans_bad_pose;      /**< Refused: pose not finite or beyond GPOM_PLACE_MAX_M, or its
                                       covariance not valid. */
    uint64_t scans_out_of_reach;  /**< Refused: sensor farther than GPOM_REACH_M from the origin. */
    uint64_t beams_hit;           /**< Kept: a return. */
    uint64_t beams_no_return;     /**< Kept: free up to the usable maximum, no hit. */
    uint64_t beams_nan;           /**< Ignored: range is NaN. */
    uint64_t beams_not_positive;  /**< Ignored: range <= 0, minus infinity included. Not a 0
                                       that is no return (scan.h). */
    uint64_t beams_too_near;      /**< Ignored: range below the sensor's minimum. Not one that
                                       is no return (scan.h). */
    uint64_t beams_masked;        /**< Ignored: bearing inside one of the sensor's masks. */
    uint64_t beams_known;         /**< Not kept: confirms what is known (keep_m). */
    uint64_t beams_contradicting; /**< Not kept: runs past hits that stand so far (live.h). */
    uint64_t beams_redundant;     /**< Not kept: the map was full of more useful ones. */
    uint64_t beams_ids_spent;     /**< Not kept: 2^31 beams were kept since the map was
                                       last made, cleared or read from a snapshot. */
    uint64_t beams_evicted_redundant; /**< Removed, least useful when the map was full (live.h):
                                           its hit was near to another. */
    uint64_t beams_not_confirmed;     /**< Removed: provisional, and not seen a second time before a
                                       beam passed it or the room was needed. */
    uint64_t hits_cleared;    /**< Past, or removed: scans of several times saw through the hit. */
    uint64_t beams_forgotten; /**< Removed: gpom_map_forget(), or out of reach of a new origin. */
    uint64_t free_cleared;    /**< Removed: scans of several times saw a hit on the segment. */
    uint64_t cells_cut;       /**< Low-resolution cells evaluated by a cut search (walk_max). */
    uint64_t beams_evicted_far; /**< Removed when the map was full: far from the robot (far_m). */
    uint64_t beams_evicted_old; /**< Removed when the map was full: old (old_s). */
    uint64_t beams_evicted_contradicted; /**< Removed when the map was full: its hit was seen
                                              through; if it was past, nothing else was known. */
} gpom_stats_t;

/** One kept beam, for inspection. */
typedef struct {
    double x_m;          /**< Sensor position, map frame [m]. */
    double y_m;          /**< Sensor position, map frame [m]. */
    int64_t stamp_us;    /**< Time of the scan, or since when the hit is past, to a millisecond
                              [us]. */
    float dir_x;         /**< Unit direction, map frame. */
    float dir_y;         /**< Unit direction, map frame. */
    float range_m;       /**< Raw range; the usable maximum for a beam without return [m]. */
    float hit_noise;     /**< Noise variance of its hit: sn2, or sn2_once, or a past hit's (live.h),
                              raised by position uncertainty [1]. */
    float free_noise;    /**< Noise variance of its free points: sn2_free, raised likewise [1]. */
    uint32_t id;         /**< Order of insertion; from 0 again when a map is cleared or read. */
    uint8_t is_hit;      /**< 1: its hit at range_m is known. 0: none, or no longer. */
    uint8_t is_free;     /**< 1: it is known free from the sensor up to the gap before range_m. */
    uint8_t returned;    /**< 1: range_m is that of a return, and a gap is left before it. */
    uint8_t provisional; /**< 1: against what was known, or what its scan saw beside it; queries do
                              not see it until confirmed. */
    uint8_t past;        /**< 1: scans of several times saw through its hit (live.h). */
    uint8_t n_agreed;    /**< Scans of other times that saw the hit again, up to 15. */
} gpom_beam_t;

/** Fill with the documented defaults.
 *
 *  Cost: O(1). */
GPOM_API void gpom_config_init(gpom_config_t *config);

/** Check every field, hyperparameters included.
 *
 *  problem  NULL, or where a static one-line text "field: what is wrong" is put; NULL text if OK,
 *           or if config is NULL.
 *  Errors   GPOM_ERR_ARG (null, not from gpom_config_init, or a value out of range),
 *           GPOM_ERR_PARAMS (of `params`; the text is that of gpom_params_check()).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_config_check(const gpom_config_t *config,
                                                        const char **problem);

/** Exact bytes gpom_map_init() needs; 0 if config is NULL or a capacity is out of range.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_map_bytes(const gpom_config_t *config);

/** Build an empty map inside caller memory; `*map` points into `mem`. Nothing to destroy.
 *
 *  mem        8-byte aligned, outlives the map, owned by the caller, not moved while in use.
 *  mem_bytes  at least gpom_map_bytes(config); GPOM_MAP_BYTES(beam_max, cell_max) suffices.
 *  Errors     GPOM_ERR_ARG, GPOM_ERR_PARAMS (gpom_config_check() names the field), GPOM_ERR_MEM.
 *             *map is NULL on any error.
 *  Cost: O(low-resolution cells + beam_max / 128). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_init(gpom_map_t **map, const gpom_config_t *config,
                                                    void *mem, size_t mem_bytes);

/** Forget all beams; low-resolution cells become unknown. Ids start again at 0; counters stay.
 *
 *  Cost: O(low-resolution cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_clear(gpom_map_t *map);

/** Index all beams in the two static KD-trees. Answers are the same before and after: beams that
 *  are not indexed yet are searched one by one, so that this only makes queries faster.
 *
 *  Cost: typically 24 n log2(n) comparisons for n beams, at most 66 n log2(n). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_build(gpom_map_t *map);

/** Copy the counters.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_stats(const gpom_map_t *map, gpom_stats_t *stats);

/** Sum of the four beams_evicted_... counters; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint64_t gpom_stats_evicted(const gpom_stats_t *stats);

/** Beams kept now; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_map_beam_count(const gpom_map_t *map);

/** Slots of the beam store in use, from 0 on; some may be empty. 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_map_slot_count(const gpom_map_t *map);

/** Copy the beam in slot `i_slot` (0 .. gpom_map_slot_count() - 1); one that is neither hit nor
 *  free is an empty slot, and all 0. While nothing was removed, slots are in order of insertion.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_map_beam(const gpom_map_t *map, uint32_t i_slot,
                                                    gpom_beam_t *beam);

#ifdef __cplusplus
}
#endif
#endif
