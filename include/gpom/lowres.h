/** \file lowres.h
 *  The low-resolution map: rasters of cells that are kept up to date in slices, for planners.
 *
 *  The coarse layer covers a fixed rectangle or follows the robot (gpom_config_t, lowres_…); the
 *  focus layer is finer and covers a band about a path of interest (paper, sec. III.F). A scan
 *  marks the cells it can change as dirty; gpom_map_step() evaluates cells at their centres, at
 *  most GPOM_LANES_MAX at a time:
 *
 *  1. dirty cells within GPOM_LOWRES_NEAR_CELLS cells of the robot's (Chebyshev), nearest first;
 *  2. the other dirty cells of the coarse layer, those looked at longest ago first;
 *  3. the dirty cells of the focus layer, likewise;
 *  4. when none is dirty, all cells once more after the last change, likewise: a beam can change
 *     cells beyond lowres_reach_m by becoming one of their nearest. After that round every cell
 *     equals, rounded as below, what gpom_query_points() says of its centre, whatever the budgets
 *     (unless its search was cut: gpom_stats_t::cells_cut).
 *
 *  Of eight groups of cells four begin with 1, three with 2 and one with 3, and then take what
 *  comes next in this order: new scans starve no cell. With a budget of GPOM_STEP_OPS_MIN a step
 *  (live.h), half of which trees may use, a coarse cell is evaluated within 8 + c / 6 steps after
 *  it was marked, c counting the layer's cells with both sides rounded up to multiples of 4, and a
 *  focus cell within 8 + c / 2. With less, trees that are being built keep all cells waiting. */
#ifndef GPOM_LOWRES_H
#define GPOM_LOWRES_H

#include "gpom/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Radius of the zone about the robot's cell whose dirty cells come first [cells]. */
#define GPOM_LOWRES_NEAR_CELLS 16u

/** Operations that one cell counts in a budget, for n = n_hits + n_free: n^3 / 6 multiply-adds of
 *  the factor, 32 for each of n^2 / 2 covariances, 1024 for the search and the rest. A nominal
 *  count, the same on every build; looking at a cell to see whether it is dirty counts 1. */
#define GPOM_LOWRES_CELL_OPS(n)                                                                    \
    ((uint64_t)(n) * (uint64_t)(n) * (uint64_t)(n) / 6u +                                          \
     (uint64_t)16 * (uint64_t)(n) * (uint64_t)(n) + (uint64_t)1024)

/** Operations that a budget must leave for a group of cells to be begun: all of its cells and 64
 *  looks. A smaller budget evaluates nothing. */
#define GPOM_LOWRES_GROUP_OPS(n) (GPOM_LANES_MAX * GPOM_LOWRES_CELL_OPS(n) + (uint64_t)64)

/** The rasters of a map: argument `layer` below. */
typedef enum {
    GPOM_LAYER_COARSE = 0, /**< Covers the place, or follows the robot. */
    GPOM_LAYER_FOCUS = 1   /**< Finer cells, in a band about a path (gpom_lowres_focus()). */
} gpom_layer_t;

/** A cell. 8 bytes. */
typedef struct {
    uint16_t probability; /**< Of occupancy at the centre [1 / 65535], rounded to nearest. */
    uint8_t variance;  /**< [1 / 255 of gpom_params_prior_variance()], rounded up, at most 255. */
    uint8_t cls;       /**< gpom_class_t by the probability before it was rounded. GPOM_UNKNOWN:
                           the variance exceeds lowres_unknown of the prior variance and the class
                           is not occupied, or the cell was never evaluated (then stamp_ms is 0,
                           probability the prior's, variance 255). */
    uint32_t stamp_ms; /**< Stamp of the newest scan when it was evaluated, from
                           gpom_lowres_info_t::stamp0_us on [ms]. Its age is newest_ms less this; if
                           this is greater, the clock was set back since: age unknown. */
} gpom_cell_t;

/** What a raster covers and how fresh it is. */
typedef struct {
    gpom_raster_t raster;  /**< Geometry, map frame. nx = ny = 0: there is none. Cell (ix, iy) has
                                its centre at (x0_m + (ix + 0.5) cell_m, likewise y). */
    int64_t stamp0_us;     /**< stamp_ms counts from here: the stamp of the map's first scan [us].
                                When two scans in a row are before it, the second by more than a
                                minute, or both 2^32 - 1 ms (49 days) or more after it, it moves to
                                2^31 ms (24 days) before the second; what was longer ago counts as
                                of then. */
    uint32_t newest_ms;    /**< Stamp of the newest scan, from stamp0_us on, held within 32 bits
                                [ms]. One more than a minute older than the newest sets it back: the
                                clock was ahead. */
    uint32_t map_sequence; /**< Scans and other changes so far, modulo 2^32. */
    uint32_t frame_epoch;  /**< Grows by one when the map frame jumps (gpom_map_…). */
    uint32_t n_dirty;      /**< Cells marked and not evaluated since. */
} gpom_lowres_info_t;

/** Geometry and freshness of a layer. May run in any thread, like gpom_lowres_copy(): raster,
 *  stamp0_us and frame_epoch belong together; the other fields are of some moment of the call.
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer), GPOM_ERR_BUSY as gpom_lowres_copy().
 *  Cost: O(1) a try, at most GPOM_LOWRES_TRIES tries. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_info(const gpom_map_t *map, uint32_t layer,
                                                       gpom_lowres_info_t *info);

/** Copy a raster while another thread inserts and steps: no lock, no waiting for either side.
 *
 *  What is promised: all cells lie in info->raster and in the frame of info->frame_epoch, which
 *  held during the whole copy. Probability, variance and class of a cell are of one evaluation,
 *  made before or during the copy; its stamp is of that one or of an earlier one, so that no cell
 *  looks fresher than it is. Cells may be of different evaluations: the copy is no instant, and a
 *  cell that was dirty holds what it held before. info->newest_ms, map_sequence and n_dirty are
 *  those before the first cell was read. Safe in any thread and in an interrupt.
 *
 *  cells     nx * ny cells, row by row from the lowest y: cell (ix, iy) at iy * nx + ix.
 *  cell_max  room in cells; the raster's nx * ny at least.
 *  Errors    GPOM_ERR_ARG (null, no such layer), GPOM_ERR_MEM (cell_max; *info is valid),
 *            GPOM_ERR_BUSY (the raster moved during each of GPOM_LOWRES_TRIES tries: call again;
 *            *cells and *info are unspecified).
 *  Cost: O(nx ny) a try, at most GPOM_LOWRES_TRIES tries. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_copy(const gpom_map_t *map, uint32_t layer,
                                                       gpom_cell_t *cells, uint32_t cell_max,
                                                       gpom_lowres_info_t *info);

/** Tries of gpom_lowres_copy() and gpom_lowres_info(). */
#define GPOM_LOWRES_TRIES 4u

/** Read cell (ix, iy) of the raster that gpom_lowres_info() tells; as a query, not beside a call
 *  that changes the map.
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer or cell).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_cell(const gpom_map_t *map, uint32_t layer,
                                                       uint32_t ix, uint32_t iy, gpom_cell_t *cell);

/** The same for the cell that contains a point of the map frame (its left and lower edges belong
 *  to a cell).
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer), GPOM_ERR_REACH (outside of the raster, or NaN).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_at(const gpom_map_t *map, uint32_t layer,
                                                     const gpom_point_t *point, gpom_cell_t *cell);

/** Look closer along a path: the focus layer becomes the raster over the bounding box of all that
 *  is within half_width_m of the polyline, with cells of cell_m, or of the smallest 2^k cell_m
 *  whose raster fits focus_cell_max; its corner at a whole multiple of that in the map frame. Only
 *  cells whose centre lies in the band, or about its corners within sqrt(2) half_width_m, are
 *  evaluated; the others stay unknown. What the layer held is dropped: call it when the path
 *  changes, not each time it is driven.
 *
 *  points  n_points >= 1 points, read during the call only; 0 (NULL allowed): end the focus.
 *  Errors  GPOM_ERR_ARG (null; half_width_m not in 0 .. GPOM_REACH_M; cell_m not in 1e-3 .. 1e6),
 *          GPOM_ERR_REACH (a point not finite or beyond GPOM_REACH_M of the origin),
 *          GPOM_ERR_MEM (focus_cell_max is 0). The layer is unchanged then.
 *  Cost: O(cells of the raster + cells within the band of each stretch). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_focus(gpom_map_t *map, const gpom_point_t *points,
                                                        size_t n_points, double half_width_m,
                                                        double cell_m);

#ifdef __cplusplus
}
#endif
#endif
