/** \file distances.h
 *  Distances in the coarse layer (lowres.h): for each cell the exact Euclidean distance to the
 *  nearest occupied cell and to the nearest cell that is not free, and its gradient, kept up in
 *  slices as cells change.
 *
 *  Distances are between centres of cells. A cell is occupied if its class is GPOM_OCCUPIED, and
 *  not free if its class is any but GPOM_FREE. Cells outside of the raster count for neither.
 *
 *  The field is an object of its own in memory of the caller. It compares the raster with what it
 *  has seen of it. So a program that has no field pays nothing for it, and the field may live in
 *  another thread than the map. Calls on one field must not run at the same time.
 *
 *  A field is kept up like this: once a control period, after gpom_map_step(), call
 *  gpom_distances_step() with what is left of the budget.
 *
 *  The method: for each column the nearest cell of the same column, then for each row the lower
 *  envelope of parabolas over the columns (A. Meijster, J. Roerdink, W. Hesselink, "A general
 *  algorithm for computing distance transforms in linear time", 2000). Only columns with a changed
 *  cell are swept again, and only rows in which a sweep changed something. Both only as far as the
 *  change can reach. */
#ifndef GPOM_DISTANCES_H
#define GPOM_DISTANCES_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Longest side of a raster that can have distances [cells]. */
#define GPOM_DISTANCES_SIDE_MAX 32767u

/** Bytes of a field for a coarse layer of nx x ny cells: 8 a cell, 16 a column and a row, and a
 *  header. This is a constant expression. */
#define GPOM_DISTANCES_BYTES(nx, ny)                                                               \
    ((size_t)176 + (size_t)8 * (size_t)(nx) * (size_t)(ny) + (size_t)16 * ((size_t)(nx) + (ny)))

/** Least budget with which a call of gpom_distances_step() makes progress. */
#define GPOM_DISTANCES_OPS_MIN(nx, ny) ((uint64_t)9 * ((uint64_t)(nx) + (uint64_t)(ny)))

/** A field in the caller's memory. Opaque. */
typedef struct gpom_distances gpom_distances_t;

/** In place of an offset: there is no such cell in the raster. */
#define GPOM_OFFSET_NONE (-32768)

/** Where the nearest cells are, from a cell [cells]. 8 bytes. If several are equally near, it is
 *  one of them. */
typedef struct {
    int16_t occupied_dx; /**< To the nearest occupied cell, along x. GPOM_OFFSET_NONE: none. */
    int16_t occupied_dy; /**< The same along y. */
    int16_t not_free_dx; /**< To the nearest cell that is not free, along x. GPOM_OFFSET_NONE:
                              none. */
    int16_t not_free_dy; /**< The same along y. */
} gpom_offsets_t;

/** A distance and its gradient. */
typedef struct {
    float distance_m; /**< Distance between the centres of the two cells [m]. Infinity: there is no
                           such cell. */
    float grad_x;     /**< Derivative of the distance by x: a unit vector away from the nearest such
                           cell. 0 at distance 0 and where there is none. */
    float grad_y;     /**< Derivative by y. */
} gpom_distance_t;

/** What a field covers and how far it has come. */
typedef struct {
    gpom_raster_t raster;  /**< As in gpom_lowres_info_t. */
    uint32_t frame_epoch;  /**< As in gpom_lowres_info_t. */
    uint32_t map_sequence; /**< As in gpom_lowres_info_t, when the last whole comparison of raster
                                 and field began. */
    uint32_t n_left;       /**< Columns and rows that must be swept again. While it is not 0, some
                                 distances are those of earlier cells. If it is 0, every distance is
                                 exact for the classes that the field saw last. */
} gpom_distances_info_t;

/** Make a field for the map's coarse layer in `mem`. It knows no cell yet. There is nothing to
 *  destroy.
 *
 *  mem        8-byte aligned. The caller owns it, keeps it longer than the field, and does not move
 *             it.
 *  mem_bytes  at least GPOM_DISTANCES_BYTES() of lowres_nx and lowres_ny.
 *  Errors     GPOM_ERR_ARG (null, no coarse layer, a side above GPOM_DISTANCES_SIDE_MAX),
 *             GPOM_ERR_MEM (null, misaligned or short). *field is NULL after any error.
 *  Cost: O(cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_init(gpom_distances_t **field,
                                                          const gpom_map_t *map, void *mem,
                                                          size_t mem_bytes);

/** Keep the field up: compare the raster with it, sweep columns and then rows that changed. The
 *  next call goes on where this one stopped. A call ends when it has swept all that the comparison
 *  found. So a call with an unlimited budget makes all distances exact. May run beside calls that
 *  change the map, like gpom_lowres_copy().
 *
 *  When the raster moves by a cell, all columns and rows are swept again.
 *
 *  map     the map that the field was made for.
 *  budget  operations, as in gpom_map_step(): to compare a cell counts 1, to sweep it 8, to look
 *          for the next column or row 1 for each that it passes.
 *  used    output: the operations done, never more than budget. NULL is allowed.
 *  Errors  GPOM_ERR_ARG (null, or a map with another raster), GPOM_ERR_BUSY as for
 *          gpom_lowres_copy(): nothing was done.
 *  Cost: at most `budget` operations. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_step(gpom_distances_t *field,
                                                          const gpom_map_t *map, uint64_t budget,
                                                          uint64_t *used);

/** What the field covers and how far it has come.
 *
 *  Errors  GPOM_ERR_ARG (null).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_info(const gpom_distances_t *field,
                                                          gpom_distances_info_t *info);

/** Offsets of cell (ix, iy) of the raster that gpom_distances_info() reports.
 *
 *  Errors  GPOM_ERR_ARG (null, no such cell).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_cell(const gpom_distances_t *field,
                                                          uint32_t ix, uint32_t iy,
                                                          gpom_offsets_t *offsets);

/** Distances and gradients of the cell that contains a point of the map frame.
 *
 *  occupied  output: to the nearest occupied cell. NULL is allowed.
 *  not_free  output: to the nearest cell that is not free. NULL is allowed.
 *  Errors    GPOM_ERR_ARG (null), GPOM_ERR_REACH (outside of the raster, or NaN).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_at(const gpom_distances_t *field,
                                                        const gpom_point_t *point,
                                                        gpom_distance_t *occupied,
                                                        gpom_distance_t *not_free);

/** Copy the offsets of all cells.
 *
 *  offsets   nx * ny cells, row by row from the lowest y: cell (ix, iy) is at iy * nx + ix.
 *  cell_max  room in `offsets`, in cells; at least nx * ny.
 *  Errors    GPOM_ERR_ARG (null), GPOM_ERR_MEM (cell_max too small; *info is valid).
 *  Cost: O(cells). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distances_copy(const gpom_distances_t *field,
                                                          gpom_offsets_t *offsets,
                                                          uint32_t cell_max,
                                                          gpom_distances_info_t *info);

/** Most points at which gpom_distance_query() asks the map. */
#define GPOM_DISTANCE_POINTS_MAX 448u

/** Flag: nothing was found within range_m. distance_m is range_m, and the direction is 0. */
#define GPOM_DISTANCE_NONE 1u
/** Flag: the point itself has a probability of at least 1/2. The distance is 0. */
#define GPOM_DISTANCE_INSIDE 2u
/** Flag: no place of probability 1/2 was found before the nearest hit. The answer is for the hit.
 */
#define GPOM_DISTANCE_HIT 4u
/** Flag: the map answered some points with GPOM_ANSWER_... flags. */
#define GPOM_DISTANCE_FLAGGED 8u

/** The nearest place of probability 1/2, from a point. */
typedef struct {
    float distance_m;  /**< Distance to the place [m]. */
    float deviation_m; /**< Standard deviation of the distance [m]: distance_m -+ 1.96 deviation_m
                            holds the true distance 19 times of 20. */
    float direction_x; /**< Unit vector to the place, map frame. */
    float direction_y; /**< The same along y. */
    uint8_t flags;     /**< 0, or GPOM_DISTANCE_... bits. */
} gpom_distance_answer_t;

/** Distance and direction to the nearest surface, from the continuous map: no raster is needed.
 *
 *  The search begins towards the nearest hits: on each of these rays it takes the first place whose
 *  probability is 1/2. Then it asks on arcs about the best direction, a little nearer than the best
 *  place. If a point there has at least 1/2, it goes on along that ray. Arcs become narrower. The
 *  place is found to 1/256 of its distance. A surface that no ray and no arc meets is missed.
 *
 *  The deviation is d^2 = 0.1^2 + (6.4 v)^2 + (r^2 / 22)^2 in metres. v is the variance at the
 *  place as a part of the prior's. r is the distance in metres: the farther, the more may be
 *  hidden. The numbers are from simulated streets (docs/decisions/distances.md). They hold for
 *  places where beams came, not for places that no sensor ever saw.
 *
 *  range_m  search up to this distance; > 0, at most GPOM_REACH_M [m].
 *  answer   output.
 *  scratch  as for a query.
 *  Errors   GPOM_ERR_ARG (null; a number not finite or out of range), GPOM_ERR_MEM (scratch),
 *           GPOM_ERR_REACH (the point is out of reach of the map): *answer is untouched.
 *  Cost: at most GPOM_DISTANCE_POINTS_MAX queries, 150 to 200 in practice. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_distance_query(const gpom_map_t *map,
                                                          const gpom_point_t *point, double range_m,
                                                          gpom_distance_answer_t *answer,
                                                          const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
