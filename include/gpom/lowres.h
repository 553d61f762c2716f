/** \file lowres.h
 *  The low-resolution map: rasters of cells for planners, kept up to date in slices.
 *
 *  There are two layers (paper, sec. III.F). The coarse layer covers a fixed rectangle, or follows
 *  the robot (gpom_config_t, fields lowres_...). The focus layer has finer cells and covers a band
 *  around a path.
 *
 *  A scan marks the cells that it can change as dirty. gpom_map_step() evaluates cells: it asks the
 *  map at the centre of each cell. It evaluates up to GPOM_LANES_MAX cells together; these are a
 *  batch. It takes cells in this order:
 *
 *  1. Dirty coarse cells near the robot, nearest first. Near means at most GPOM_LOWRES_NEAR_CELLS
 *     cells from the robot's cell (Chebyshev distance).
 *  2. The other dirty cells of the coarse layer, in rounds: first the cells that were looked at
 *     longest ago.
 *  3. The dirty cells of the focus layer, in rounds too.
 *  4. If no cell is dirty: every cell of both layers once more after the last change, in rounds
 *     too. This is needed because a beam can change a cell farther away than lowres_reach_m, when
 *     the beam becomes one of the nearest to the cell.
 *
 *  When all these cells are done, every cell equals the answer of gpom_query_points() for its
 *  centre, rounded as described below, whatever the budgets were. The exception is a cell whose
 *  search was cut (gpom_stats_t::cells_cut).
 *
 *  No cell waits forever when new scans arrive. Of eight batches, four start with cells of kind 1,
 *  three with kind 2 and one with kind 3. Each batch is then filled in the order above.
 *
 *  Let c be the number of cells of a layer, with both sides rounded up to multiples of 4. If each
 *  step has a budget of GPOM_STEP_OPS_MIN (live.h), a coarse cell is evaluated within 8 + c / 6
 *  steps after it was marked. A focus cell is evaluated within 8 + c / 2 steps. Up to half of this
 *  budget may go to the building of trees. With a smaller budget, all cells wait while trees are
 *  being built. */
#ifndef GPOM_LOWRES_H
#define GPOM_LOWRES_H

#include "gpom/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Dirty cells up to this far from the robot's cell are evaluated first [cells]. */
#define GPOM_LOWRES_NEAR_CELLS 16u

/** Operations that one cell counts in a budget, for n = n_hits + n_free: n^3 / 6 multiply-adds for
 *  the factor, 32 for each of n^2 / 2 covariances, and 1024 for the search and the rest. This is a
 *  nominal count, the same on every build. To look whether a cell is dirty counts 1. */
#define GPOM_LOWRES_CELL_OPS(n)                                                                    \
    ((uint64_t)(n) * (uint64_t)(n) * (uint64_t)(n) / 6u +                                          \
     (uint64_t)16 * (uint64_t)(n) * (uint64_t)(n) + (uint64_t)1024)

/** A batch of cells starts only if the budget has this many operations left: enough for all cells
 *  of the batch and 64 looks. A smaller budget evaluates nothing. */
#define GPOM_LOWRES_BATCH_OPS(n) (GPOM_LANES_MAX * GPOM_LOWRES_CELL_OPS(n) + (uint64_t)64)

/** The rasters of a map: the argument `layer` of the functions below. */
typedef enum {
    GPOM_LAYER_COARSE = 0, /**< Covers a fixed rectangle, or follows the robot. */
    GPOM_LAYER_FOCUS = 1   /**< Finer cells in a band around a path (gpom_lowres_focus()). */
} gpom_layer_t;

/** A cell. 8 bytes. */
typedef struct {
    uint16_t probability; /**< Probability of occupancy at the centre [1 / 65535], rounded to the
                               nearest. */
    uint8_t variance;     /**< Variance at the centre [1 / 255 of gpom_params_prior_variance()],
                            rounded up, at most 255. */
    uint8_t cls;          /**< gpom_class_t, from the probability before rounding. The class is
                            GPOM_UNKNOWN in two cases. Either the variance exceeds lowres_unknown
                            times the prior variance and the class is not occupied. Or the cell
                            was never evaluated: then stamp_ms is 0, probability is that of the
                            prior, and variance is 255. */
    uint32_t stamp_ms;    /**< Stamp of the newest scan at the time of evaluation, counted from
                            gpom_lowres_info_t::stamp0_us [ms]. The age of the cell is
                            newest_ms - stamp_ms. If stamp_ms is greater than newest_ms, the
                            clock was set back and the age is unknown. */
} gpom_cell_t;

/** What a raster covers and how fresh it is. */
typedef struct {
    gpom_raster_t raster;  /**< Geometry, map frame. nx = ny = 0: the map has no such raster. The
                                centre of cell (ix, iy) is at (x0_m + (ix + 0.5) cell_m, y0_m +
                                (iy + 0.5) cell_m). */
    int64_t stamp0_us;     /**< Zero of stamp_ms: the stamp of the map's first scan [us]. It moves
                                if two scans in a row are outside of the span of stamp_ms. Too
                                early: both are before stamp0_us, the second by more than a
                                minute. Too late: both are 2^32 - 1 ms (49 days) or more after it.
                                Then stamp0_us becomes 2^31 ms (24 days) before the second scan.
                                Stamps before the new stamp0_us count as equal to it. */
    uint32_t newest_ms;    /**< Stamp of the newest scan, counted from stamp0_us and limited to 32
                                bits [ms]. A scan more than a minute older than the newest sets
                                newest_ms back, because the clock was ahead before. */
    uint32_t map_sequence; /**< Number of scans and other changes so far, modulo 2^32. */
    uint32_t frame_epoch;  /**< Grows by one at each jump of the map frame (gpom_map_jump()). */
    uint32_t n_dirty;      /**< Cells that were marked and not evaluated since. */
} gpom_lowres_info_t;

/** Geometry and freshness of a layer. May run in any thread, like gpom_lowres_copy(). raster,
 *  stamp0_us and frame_epoch belong together. Each other field is from some moment during the call.
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer), GPOM_ERR_BUSY as for gpom_lowres_copy().
 *  Cost: O(1) for each try, at most GPOM_LOWRES_TRIES tries. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_info(const gpom_map_t *map, uint32_t layer,
                                                       gpom_lowres_info_t *info);

/** Copy a raster while another thread inserts and steps. There is no lock, and neither side waits.
 *  Safe in any thread and in an interrupt.
 *
 *  What the copy guarantees:
 *  - All cells lie in info->raster, in the frame of info->frame_epoch. Raster and frame did not
 *    change during the copy.
 *  - Probability, variance and class of a cell come from one evaluation, made before or during the
 *    copy.
 *  - The stamp of a cell is from the same evaluation or from an earlier one. So no cell looks
 *    fresher than it is.
 *  - info->newest_ms, map_sequence and n_dirty are values from before the first cell was read.
 *
 *  What it does not guarantee: cells may come from different moments, and a dirty cell still has
 *  its old content.
 *
 *  cells     nx * ny cells, row by row from the lowest y: cell (ix, iy) is at iy * nx + ix.
 *  cell_max  room in `cells`, in cells; at least nx * ny of the raster.
 *  Errors    GPOM_ERR_ARG (null, no such layer), GPOM_ERR_MEM (cell_max too small; *info is valid),
 *            GPOM_ERR_BUSY (the raster moved during each of GPOM_LOWRES_TRIES tries: call again;
 *            *cells and *info are unspecified).
 *  Cost: O(nx ny) for each try, at most GPOM_LOWRES_TRIES tries. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_copy(const gpom_map_t *map, uint32_t layer,
                                                       gpom_cell_t *cells, uint32_t cell_max,
                                                       gpom_lowres_info_t *info);

/** Most tries of one call of gpom_lowres_copy() or gpom_lowres_info(). */
#define GPOM_LOWRES_TRIES 4u

/** Read cell (ix, iy) of the raster that gpom_lowres_info() reports. Like a query, it must not run
 *  at the same time as a call that changes the map.
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer or cell).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_cell(const gpom_map_t *map, uint32_t layer,
                                                       uint32_t ix, uint32_t iy, gpom_cell_t *cell);

/** Read the cell that contains a point of the map frame. A cell includes its left and lower edges.
 *  Like a query, it must not run at the same time as a call that changes the map.
 *
 *  Errors  GPOM_ERR_ARG (null, no such layer), GPOM_ERR_REACH (outside of the raster, or NaN).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_at(const gpom_map_t *map, uint32_t layer,
                                                     const gpom_point_t *point, gpom_cell_t *cell);

/** Look closer along a path: place the focus layer around a polyline. The old content of the focus
 *  layer is lost. So call this when the path changes, not each time the robot drives it.
 *
 *  The new raster covers the bounding box of all points within half_width_m of the polyline. Its
 *  cells have the side cell_m. If that raster does not fit into focus_cell_max cells, the side is
 *  doubled until it fits. The corner of the raster is at a whole multiple of the cell side in the
 *  map frame.
 *
 *  Only cells whose centre lies in the band are evaluated. Near corners of the polyline, cells
 *  within sqrt(2) half_width_m may be evaluated, too. All other cells stay unknown.
 *
 *  points  n_points >= 1 points, read only during the call; n_points = 0 (points may be NULL): end
 *          the focus.
 *  Errors  GPOM_ERR_ARG (null; half_width_m not in 0 .. GPOM_REACH_M; cell_m not in 1e-3 .. 1e6),
 *          GPOM_ERR_REACH (a point not finite or beyond GPOM_REACH_M of the origin), GPOM_ERR_MEM
 *          (focus_cell_max is 0). The layer is unchanged after an error.
 *  Cost: O(cells of the raster + cells within the band of each stretch). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_lowres_focus(gpom_map_t *map, const gpom_point_t *points,
                                                        size_t n_points, double half_width_m,
                                                        double cell_m);

#ifdef __cplusplus
}
#endif
#endif
