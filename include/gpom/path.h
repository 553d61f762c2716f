/** \file path.h
 *  For planners: is this path free, and where is it worth going? */
#ifndef GPOM_PATH_H
#define GPOM_PATH_H

#include "gpom/lowres.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most samples of one gpom_path_query(), each sector of a corner counted with up to two rings and
 *  two places a ring too many. */
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
/** Some samples' searches were cut (GPOM_ANSWER_CUT). */
#define GPOM_PATH_CUT 8u

/** The likeliest obstacle of a path. */
typedef struct {
    double x_m;         /**< Its sample's place, map frame [m]. */
    double y_m;         /**< Likewise. */
    double arc_m;       /**< Length of the polyline up to the centre of the disc that meets it, with
                             the sample straight to its side or in a corner's sector [m]. */
    float probability;  /**< Highest probability of occupancy; of equal ones the first sample's. */
    uint8_t cls;        /**< Its gpom_class_t. */
    uint8_t flags;      /**< 0, or GPOM_PATH_… bits. */
    uint32_t n_samples; /**< Samples regarded. */
} gpom_path_result_t;

/** Highest probability of occupancy in the area that a disc sweeps along a polyline.
 *
 *  The area is made of a rectangle about each stretch and a sector about each corner: the half disc
 *  behind the first and before the last (both, if the path stands still), at the others what opens
 *  on the outer side of the turn.
 *  Rectangles are sampled along and across in equal steps of at most spacing_m, both ends included;
 *  sectors likewise on rings of equal steps up to radius_m, from the centre outward, each ring from
 *  side to side. So every sample lies in the area, every point of the area has a sample within 0.8
 *  spacing_m, and the samples come in the order of their arc_m. Sectors narrower than a thousandth
 *  of spacing_m and stretches of no length are left out.
 *
 *  result   Of the samples up to the first with probability >= stop_probability.
 *  scratch  As for a query.
 *  Errors   GPOM_ERR_ARG (null; a number not finite or out of range; more than
 *           GPOM_PATH_SAMPLES_MAX samples), GPOM_ERR_MEM (scratch): result
 *           is untouched. GPOM_ERR_REACH, _PIVOT, _CUT: as the flags say; result is valid.
 *  Cost: one query a sample; at most GPOM_LANES_MAX - 1 more than are regarded. */
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
 *  Cost: O(nx ny (1 + n_goals_max)) at worst, O(nx ny) for a few goals in practice. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_explore(const gpom_map_t *map, const gpom_point_t *from,
                                                   gpom_goals_t *goals,
                                                   const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
