/** \file path.h
 *  For planners: is this path free, and where is it worth going? */
#ifndef GPOM_PATH_H
#define GPOM_PATH_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most samples of one gpom_path_query(). */
#define GPOM_PATH_SAMPLES_MAX 16777216u

/** A way to go: a polyline and the disc that moves along it. */
typedef struct {
    const gpom_point_t *points; /**< n_points corners, map frame [m]. */
    size_t n_points;            /**< >= 1. One: the disc stands still. */
    double radius_m;            /**< Of the disc [m]; >= 0. */
    double spacing_m;           /**< Largest step between samples, along and across [m]; > 0. */
    float stop_probability;     /**< Stop at the first sample as likely occupied as this; above 1:
                                     look at all. */
} gpom_path_t;

/** Some samples were not finite or out of reach: they got the prior. */
#define GPOM_PATH_OUT_OF_REACH 1u
/** Some samples' covariance matrices were not positive definite: likewise. */
#define GPOM_PATH_PIVOT 2u
/** A sample reached stop_probability; those after it were not regarded. */
#define GPOM_PATH_STOPPED 4u

/** The likeliest obstacle of a path. */
typedef struct {
    double x_m;         /**< Its sample's place, map frame [m]. */
    double y_m;         /**< Likewise. */
    double arc_m;       /**< Length of the polyline up to the point of the sample's stretch that is
                             closest to the sample [m]. */
    float probability;  /**< Highest probability of occupancy; of equal ones the first sample's. */
    uint8_t cls;        /**< Its gpom_class_t. */
    uint8_t flags;      /**< 0, or GPOM_PATH_… bits. */
    uint32_t n_samples; /**< Samples regarded. */
} gpom_path_result_t;

/** Highest probability of occupancy in the area that a disc sweeps along a polyline.
 *
 *  Each stretch from corner to corner, of length l along its unit direction t with left normal n,
 *  is sampled at steps of at most spacing_m along t, from 0 to l + radius_m (the first stretch from
 *  -radius_m), and for each of these across, along n, from -radius_m to radius_m; the steps of a
 *  side are equal and include both its ends. A sample that lies outside of the rounded end is moved
 *  to the nearest point within radius_m of the stretch if that is within spacing_m / sqrt(2), else
 *  left out. So every point of the swept area has a sample within spacing_m / sqrt(2), and every
 *  sample lies in the area. Samples come in the order of stretch, step along, step across.
 *  Stretches of no length are left out (a path of nothing else keeps its first, along x).
 *
 *  result   Of the samples up to the first with probability >= stop_probability.
 *  scratch  As for a query.
 *  Errors   GPOM_ERR_ARG (null; a number not finite or out of range; more than
 *           GPOM_PATH_SAMPLES_MAX samples, left out ones included), GPOM_ERR_MEM (scratch): result
 *           is untouched. GPOM_ERR_REACH, GPOM_ERR_PIVOT: as the flags say; result is valid.
 *  Cost     One query a sample, GPOM_LANES_MAX at a time: fewer than that are asked in vain. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_path_query(const gpom_map_t *map,
                                                      const gpom_path_t *path,
                                                      gpom_path_result_t *result,
                                                      const gpom_scratch_t *scratch);

/** A cell worth going to. */
typedef struct {
    uint32_t ix;      /**< Cell of the coarse layer. */
    uint32_t iy;      /**< Likewise. */
    uint32_t n_steps; /**< Steps from cell to cell on the shortest way from the start. */
    uint8_t variance; /**< As in gpom_cell_t. */
    uint8_t cls;      /**< gpom_class_t: free, unsure or unknown. */
} gpom_goal_t;

/** Bytes of scratch that gpom_explore() needs for a coarse layer of nx x ny cells. */
#define GPOM_EXPLORE_BYTES(nx, ny)                                                                 \
    ((size_t)4 * (size_t)(nx) * (size_t)(ny) + (size_t)(nx) * (size_t)(ny) / 8 + (size_t)8)

/** A list of goals. */
typedef struct {
    gpom_goal_t *goals;   /**< Room for n_goals_max, the caller's. */
    uint32_t n_goals_max; /**< >= 1. */
    uint32_t n_goals;     /**< Written: how many there are. */
} gpom_goals_t;

/** The paper's use for exploration: where does the map know least, of all places that can be
 *  reached through free cells of the coarse layer?
 *
 *  A cell is reached from the cell of `from`, of whatever class that is, by steps to one of four
 *  neighbours through cells of class free. Goals are the free cells so reached and the unsure and
 *  unknown cells next to them, where the known world ends; never an occupied cell nor that of
 *  `from`. They are ranked by variance, highest first, then by steps, fewest first, then by index
 *  iy * nx + ix.
 *
 *  goals        Its goals become the first n_goals_max in this order.
 *  scratch      GPOM_EXPLORE_BYTES(nx, ny) of any alignment.
 *  Errors       GPOM_ERR_ARG (null, no coarse layer), GPOM_ERR_MEM (scratch),
 *               GPOM_ERR_REACH (`from` is outside of the raster). goals->n_goals is 0 then, if it
 *               can be.
 *  Cost         O(nx ny (1 + n_goals_max)) at worst, O(nx ny) for a few goals in practice. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_explore(const gpom_map_t *map, const gpom_point_t *from,
                                                   gpom_goals_t *goals,
                                                   const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
