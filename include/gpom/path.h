/** \file path.h
 *  For planners: is this path free, and which places are worth exploring? */
#ifndef GPOM_PATH_H
#define GPOM_PATH_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most samples of one gpom_path_query(). The library compares an upper bound of the number of
 *  samples with this limit. In the bound, n_points + 1 corners count as whole discs, and each ring
 *  of a disc as its longest ring plus one sample. */
#define GPOM_PATH_SAMPLES_MAX 16777216u

/** A path: a polyline, and a disc that moves along it. */
typedef struct {
    const gpom_point_t *points; /**< n_points corners, map frame [m]. */
    size_t n_points;            /**< >= 1. With 1, the disc stands still. */
    double radius_m;            /**< Radius of the disc [m]; >= 0. */
    double spacing_m;           /**< Largest step between samples, along and across the path [m];
                                     > 0. */
    float stop_probability;     /**< Stop at the first sample with at least this probability.
                                     Above 1: look at all samples. */
} gpom_path_t;

/** Flag: some samples were not finite or out of reach. Their answers are the prior. */
#define GPOM_PATH_OUT_OF_REACH 1u
/** Flag: some covariance matrices were not positive definite. The answers are the prior. */
#define GPOM_PATH_PIVOT 2u
/** Flag: a sample reached stop_probability. The result does not regard later samples. */
#define GPOM_PATH_STOPPED 4u
/** Flag: the searches of some samples were cut (GPOM_ANSWER_CUT). */
#define GPOM_PATH_CUT 8u

/** The most likely obstacle of a path. */
typedef struct {
    double x_m;         /**< Sample with the highest probability: x, map frame [m]. */
    double y_m;         /**< Sample with the highest probability: y, map frame [m]. */
    double arc_m;       /**< Length of the polyline up to the centre of the disc that meets the
                             sample [m]. The sample is straight to the side of this centre, or in
                             the sector of the corner at this centre. */
    float probability;  /**< Highest probability of occupancy. If several samples have it, the
                             result is for the first of them. */
    uint8_t cls;        /**< gpom_class_t of this sample. */
    uint8_t flags;      /**< 0, or GPOM_PATH_… bits. */
    uint32_t n_samples; /**< Number of samples that the result regards. */
} gpom_path_result_t;

/** Highest probability of occupancy in the area that a disc sweeps along a polyline.
 *
 *  The area consists of a rectangle around each stretch and a sector around each corner. At the
 *  first corner the sector is the half disc behind it. At the last corner the sector is the half
 *  disc before it. At every other corner the sector is the part that opens on the outer side of the
 *  turn. If the path stands still, the sector is the whole disc.
 *
 *  Rectangles are sampled along and across in equal steps of at most spacing_m, both ends included.
 *  Sectors are sampled in the same way: on rings from the centre outward up to radius_m, and on
 *  each ring from side to side. So every sample lies in the area. Every point of the area has a
 *  sample within 0.8 spacing_m. The samples come in the order of their arc_m. Some parts are left
 *  out: stretches without length, and sectors narrower than a thousandth of spacing_m.
 *
 *  result   regards the samples up to the first with probability >= stop_probability.
 *  scratch  as for a query.
 *  Errors   GPOM_ERR_ARG (null; a number not finite or out of range; more than
 *           GPOM_PATH_SAMPLES_MAX samples), GPOM_ERR_MEM (scratch): *result is untouched.
 *           GPOM_ERR_REACH, GPOM_ERR_PIVOT, GPOM_ERR_CUT: as the flags say; *result is valid.
 *  Cost: one query for each regarded sample, and at most GPOM_LANES_MAX - 1 queries more. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_path_query(const gpom_map_t *map,
                                                      const gpom_path_t *path,
                                                      gpom_path_result_t *result,
                                                      const gpom_scratch_t *scratch);

/** A cell that is worth exploring. */
typedef struct {
    uint32_t ix;      /**< Column of the cell in the coarse layer. */
    uint32_t iy;      /**< Row of the cell in the coarse layer. */
    uint32_t n_steps; /**< Steps from cell to cell on the shortest way from the start. */
    uint8_t variance; /**< Variance, as in gpom_cell_t. */
    uint8_t cls;      /**< gpom_class_t: free, unsure or unknown. */
} gpom_goal_t;

/** Bytes of scratch that gpom_explore() needs for a coarse layer of nx x ny cells. */
#define GPOM_EXPLORE_BYTES(nx, ny)                                                                 \
    ((size_t)4 * (size_t)(nx) * (size_t)(ny) + (size_t)(nx) * (size_t)(ny) / 8 + (size_t)8)

/** A list of goals. */
typedef struct {
    gpom_goal_t *goals;   /**< Room for n_goals_max goals; the caller's memory. */
    uint32_t n_goals_max; /**< >= 1. */
    uint32_t n_goals;     /**< Output: the number of goals. */
} gpom_goals_t;

/** Find cells that are worth exploring: cells that the robot can reach through free cells of the
 *  coarse layer, and of which the map knows least. This is how the paper uses the map for
 *  exploration.
 *
 *  The start is the cell of `from`; its class does not matter. A cell is reached by steps to one of
 *  the four neighbours, through cells of class free. Goals are the free cells that are reached, and
 *  the unsure and unknown cells next to them, where known space ends. An occupied cell is never a
 *  goal, and neither is the start. Goals are ranked by variance, highest first, then by number of
 *  steps, lowest first, then by index iy * nx + ix.
 *
 *  goals    output: the first n_goals_max goals in this order.
 *  scratch  GPOM_EXPLORE_BYTES(nx, ny) bytes of any alignment.
 *  Errors   GPOM_ERR_ARG (null, no coarse layer), GPOM_ERR_MEM (scratch), GPOM_ERR_REACH (`from` is
 *           outside of the raster). After an error goals->n_goals is 0, if `goals` is not null.
 *  Cost: O(nx ny (1 + n_goals_max)) at worst, O(nx ny) for a few goals in practice. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_explore(const gpom_map_t *map, const gpom_point_t *from,
                                                   gpom_goals_t *goals,
                                                   const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
