/** \file ray.h
 *  For localisation and planning: how far would a beam go from here, and what would a whole scan
 *  look like? */
#ifndef GPOM_RAY_H
#define GPOM_RAY_H

#include "gpom/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most points that one ray evaluates. */
#define GPOM_RAY_EVALUATIONS_MAX 512u
/** Greatest length of a ray [m]. */
#define GPOM_RAY_LENGTH_MAX_M 1000.0

/** Rays from one place, at equal angles. */
typedef struct {
    double x_m;              /**< The place, map frame [m]. */
    double y_m;              /**< The place, map frame [m]. */
    double bearing_rad;      /**< Of the first ray, from the x axis of the map frame, towards the
                                    y axis [rad]; -1e6 .. 1e6. */
    double bearing_step_rad; /**< From one ray to the next [rad]; -1e6 .. 1e6. */
    uint32_t n_rays;         /**< >= 1. */
    float threshold;         /**< A ray ends where the probability of occupancy reaches this;
                                    0 .. 1. 0.5: the median of where a beam would end. */
    double length_m;         /**< Length of the rays [m]; > 0, at most GPOM_RAY_LENGTH_MAX_M. */
    float step_min_m;        /**< Least step, 0 .. 1 [m]; 0: 0.08. What is thinner may be missed.
                                    A smaller one finds more of it and costs more. */
    const float *before_m;   /**< n_before ranges, rising [m]; >= 0. */
    uint32_t n_before;       /**< 0: none. */
} gpom_fan_t;

/** Flag: the probability reaches the threshold at range_m. */
#define GPOM_RAY_REACHED 1u
/** Flag: at not_free_m the ray leaves what is free. */
#define GPOM_RAY_NOT_FREE 2u
/** Flag: the ray has GPOM_RAY_EVALUATIONS_MAX evaluations, or the search of one of them was cut
 *  (GPOM_ANSWER_CUT). What is behind range_m is not known. */
#define GPOM_RAY_CUT 4u
/** Flag: some points were out of reach. Their answers are the prior. */
#define GPOM_RAY_OUT_OF_REACH 8u
/** Flag: some covariance matrices were not positive definite. Their answers are the prior. */
#define GPOM_RAY_PIVOT 16u

/** One ray. Ranges are from its start [m].
 *
 *  A beam ends at the first place that is occupied. The model for this: one hidden number u,
 *  uniform in 0 .. 1, decides for the whole ray, and a place is occupied if u is less than its
 *  probability. This is right where one surface decides. The place of the sensor is free. So with M
 *  the greatest probability up to a range and p0 the one at the start, the beam ends before the
 *  range with the probability (M - p0) / (1 - p0). A beam that comes to the end of the ray (the
 *  threshold, or length_m) ends there. */
typedef struct {
    float range_m;        /**< First place with probability >= threshold; else the length. */
    float not_free_m;     /**< First place whose class is not free; else range_m. */
    float expected_m;     /**< Expected range of a beam. */
    float deviation_m;    /**< Its standard deviation. */
    uint16_t n_evaluated; /**< Points that were evaluated. */
    uint8_t flags;        /**< 0, or GPOM_RAY_… bits. */
    uint8_t reserved;     /**< Always 0. */
} gpom_ray_t;

/** Bytes of scratch for rays, as GPOM_SCRATCH_BYTES(). It is enough for queries, too. */
#define GPOM_RAY_BYTES(n_points, lanes) (GPOM_SCRATCH_BYTES(n_points, lanes) + (size_t)2048)

/** Exact bytes of scratch that gpom_ray_fan() needs on `map`; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_ray_bytes(const gpom_map_t *map);

/** Follow rays. They step as far as their neighbours allow, and find the places where they reach
 *  the threshold and leave what is free to 9 mm. A surface may be missed if it is thinner than
 *  step_min_m, or if it touches the threshold only just.
 *
 *  rays     n_rays results.
 *  before   NULL, or n_rays x n_before: row by row, for each ray the probability that a beam ends
 *           before each of the ranges.
 *  scratch  at least gpom_ray_bytes() bytes.
 *  Errors   GPOM_ERR_ARG (null, a number not finite or out of range), GPOM_ERR_MEM (scratch):
 *           nothing is written. GPOM_ERR_REACH, GPOM_ERR_PIVOT, GPOM_ERR_CUT: as the flags say; the
 *           results are valid.
 *  Cost: about 20 queries for a ray of 20 m, at most GPOM_RAY_EVALUATIONS_MAX. Rays of a fan share
 *  packets. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_ray_fan(const gpom_map_t *map, const gpom_fan_t *fan,
                                                   gpom_ray_t *rays, float *before,
                                                   const gpom_scratch_t *scratch);

/** Follow one ray: the first of the fan. As gpom_ray_fan() otherwise.
 *
 *  Cost: as for one ray of a fan. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_ray_query(const gpom_map_t *map, const gpom_fan_t *fan,
                                                     gpom_ray_t *ray, float *before,
                                                     const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
