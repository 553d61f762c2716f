/** \file gradient.h
 *  Ask the map at any point, and in which direction its answer changes.
 *
 *  A planner that pushes a path away from obstacles (MPC, elastic bands) needs the derivatives of
 *  the probability by x and y. They are analytic here, for every covariance and every addition of
 *  params.h.
 *
 *  What is held fixed: which neighbours a query uses, and their order. Around almost every point
 *  they are constant. Everything else moves with the query: the closest point of a free segment
 *  (eq. 10), unless it is an end of the segment, and with the points the covariances between them,
 *  the weights of neighbours that fade, the axis of the hits, and the terms inside eq. 7.
 *
 *  Where the neighbours change, the answer may jump or have a kink. There the gradient is that of
 *  one side. On a hit and on a free segment GPOM_KERNEL_MATERN12 and GPOM_KERNEL_ASKEY have a kink:
 *  the covariance with this one neighbour is largest there, and its slope changes its sign. The
 *  gradient there leaves out this neighbour's covariance: this is the mean of the slopes on the two
 *  sides, and what central differences give. The same holds for distances inside eq. 7. */
#ifndef GPOM_GRADIENT_H
#define GPOM_GRADIENT_H

#include "gpom/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The answer for one point, and its derivatives. No field is ever NaN. All derivatives are 0 if
 *  the answer is the prior (GPOM_ANSWER_OUT_OF_REACH, GPOM_ANSWER_PIVOT, or farther than fade_m
 *  from all neighbours). */
typedef struct {
    gpom_answer_t answer; /**< The same to the last bit as from gpom_query_points(). */
    float mean_x;         /**< d mean / d x, map frame [1/m]. */
    float mean_y;         /**< d mean / d y, map frame [1/m]. */
    float variance_x;     /**< d variance / d x, map frame [1/m]. */
    float variance_y;     /**< d variance / d y, map frame [1/m]. */
    float probability_x;  /**< d probability / d x, map frame [1/m]. */
    float probability_y;  /**< d probability / d y, map frame [1/m]. */
} gpom_gradient_t;

/** Bytes of scratch for gradients with n_points = n_hits + n_free neighbours and a library with
 *  `lanes` lanes, as GPOM_SCRATCH_BYTES(). It is enough for queries, too. */
#define GPOM_GRADIENT_BYTES(n_points, lanes)                                                       \
    (GPOM_SCRATCH_BYTES(n_points, lanes) + (size_t)64 +                                            \
     (size_t)4 * (size_t)(lanes)*GPOM_WHOLE_TILES(n_points) *                                      \
         ((n_points) <= GPOM_POINTS_MAX ? GPOM_WHOLE_TILES(n_points) + (size_t)33 : (size_t)18))

/** Exact bytes of scratch that gpom_query_gradients() needs on `map`; 0 for NULL and for a map with
 *  a sparse solve.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_gradient_bytes(const gpom_map_t *map);

/** Answer a list of points, with derivatives.
 *
 *  gradients  n_points results in the order of the points. All are written, except after
 *             GPOM_ERR_ARG or GPOM_ERR_MEM.
 *  scratch    at least gpom_gradient_bytes() bytes.
 *  Errors     as gpom_query_points(); GPOM_ERR_PARAMS (a map with a sparse solve: more than
 *             GPOM_POINTS_MAX neighbours).
 *  Cost: at most 1.6 of gpom_query_points(): n^2 multiply-adds to solve once more, n = n_hits +
 *  n_free, and about 20 operations for each of the n^2 / 2 pairs of neighbours. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_query_gradients(const gpom_map_t *map,
                                                           const gpom_point_t *points,
                                                           size_t n_points,
                                                           gpom_gradient_t *gradients,
                                                           const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
