/** \file query.h
 *  Ask the map: at any point, at any resolution, how likely is it occupied and how sure is that?
 *
 *  A point's answer depends on the map and the point alone: within one build and instruction set
 *  it is the same to the last bit in any list, raster, order or thread.
 *
 *  No allocation, no recursion, no locks: safe in an interrupt if its time is. */
#ifndef GPOM_QUERY_H
#define GPOM_QUERY_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Class of a point by the thresholds p_free and p_occupied; GPOM_UNKNOWN, nothing is known here,
 *  is for cells of the low-resolution map alone (lowres.h). */
typedef enum {
    GPOM_FREE = 0,     /**< Probability at most p_free. */
    GPOM_UNSURE = 1,   /**< Between both thresholds. */
    GPOM_OCCUPIED = 2, /**< Probability at least p_occupied. */
    GPOM_UNKNOWN = 3   /**< Nothing is known of the cell. */
} gpom_class_t;

/** Answer to a point is the prior because its coordinates are not finite or out of reach. */
#define GPOM_ANSWER_OUT_OF_REACH 1u
/** Answer to a point is the prior because its covariance matrix was not positive definite. */
#define GPOM_ANSWER_PIVOT 2u

/** The search for the point's neighbours was cut after config.walk_max walks down a tree: the
 *  answer is that of the nearest beams found until then, and there may be nearer ones. An answer
 *  without this flag is exact. A packet that is cut is searched again point by point, so that what
 *  is asked together does not show; only where a packet, which knows what the one before it found,
 *  needed less than a point of it would alone is the answer exact here and cut there. */
#define GPOM_ANSWER_CUT 4u

/** What the map says of one point. Never a NaN. */
typedef struct {
    float mean;        /**< Mean of the latent function, eq. 2: +1 occupied, -1 free, 0 unknown. */
    float variance;    /**< Its variance, eq. 3; up to the prior variance where nothing is known. */
    float probability; /**< Probability of occupancy, eq. 7 with its square root. */
    uint8_t cls;       /**< gpom_class_t. */
    uint8_t flags;     /**< 0, or GPOM_ANSWER_… bits. */
    uint8_t n_hits;    /**< Hits that took part; 255 stands for more, too. */
    uint8_t n_free;    /**< Free segments that took part; likewise. */
} gpom_answer_t;

/** A point in the map frame [m]. */
typedef struct {
    double x_m; /**< Along the x axis of the map frame [m]. */
    double y_m; /**< Along its y axis [m]. */
} gpom_point_t;

/** Most cells along one side of a raster. */
#define GPOM_RASTER_SIDE_MAX 1048576u

/** A raster of square cells; answers are for the cells' centres. */
typedef struct {
    double x0_m;   /**< Lower left corner of cell (0, 0), map frame [m]. */
    double y0_m;   /**< Lower left corner of cell (0, 0), map frame [m]. */
    double cell_m; /**< Side of a cell [m]; > 0. */
    uint32_t nx;   /**< Cells along x; at most GPOM_RASTER_SIDE_MAX. */
    uint32_t ny;   /**< Cells along y; likewise. */
} gpom_raster_t;

/** Working memory of one query call; the caller's, used by one call at a time. */
typedef struct {
    void *mem;        /**< Any alignment. */
    size_t mem_bytes; /**< At least gpom_scratch_bytes(); GPOM_SCRATCH_BYTES() always suffices. */
} gpom_scratch_t;

/** Most lanes (queries side by side) of any build of the library. */
#define GPOM_LANES_MAX 16u

/** Bytes of scratch for n_points = n_hits + n_free neighbours and a library of `lanes` lanes
 *  (gpom_lanes(); GPOM_LANES_MAX fits every build): a constant expression for a static array. */
#define GPOM_SCRATCH_BYTES(n_points, lanes)                                                        \
    ((size_t)1024 + ((lanes) > 1 ? (size_t)4864 : (size_t)0) +                                     \
     ((n_points) <= GPOM_POINTS_MAX ? GPOM_DENSE_BYTES(n_points, lanes)                            \
                                    : GPOM_SPARSE_BYTES(n_points, lanes)))

/** Of this for the dense solve of at most GPOM_POINTS_MAX neighbours. */
#define GPOM_DENSE_BYTES(n_points, lanes)                                                          \
    ((size_t)4 * (size_t)(lanes) *                                                                 \
     (GPOM_WHOLE_TILES(n_points) * (GPOM_WHOLE_TILES(n_points) + (size_t)36) / (size_t)2 +         \
      (size_t)8))

/** Of this for the sparse solve of more: 1.2 MiB for 256 neighbours, 4.9 MiB for 512. */
#define GPOM_SPARSE_BYTES(n_points, lanes)                                                         \
    ((size_t)4 * (size_t)(lanes) * ((size_t)10 * GPOM_WHOLE_TILES(n_points) + (size_t)8) +         \
     (size_t)18 * (size_t)(n_points) * (size_t)(n_points) + (size_t)96 * (size_t)(n_points))

/** The covariance matrix is factored in tiles of 4 x 4: n_points rounded up to a multiple. */
#define GPOM_WHOLE_TILES(n_points) (((size_t)(n_points) + (size_t)3) / (size_t)4 * (size_t)4)

/** Queries that the library computes side by side: 1, 4, 8 or 16, fixed by the build or, on x86-64,
 *  chosen from what the processor has.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_lanes(void);

/** Exact bytes of scratch a query on `map` needs; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_scratch_bytes(const gpom_map_t *map);

/** Answer a list of points.
 *
 *  answers  n_points answers, in the points' order; all written unless GPOM_ERR_ARG or _MEM.
 *  Errors   GPOM_ERR_ARG (null), GPOM_ERR_MEM (scratch),
 *           GPOM_ERR_REACH (some points not finite or out of reach: they got the prior and a flag),
 *           GPOM_ERR_PIVOT (some matrices not positive definite: likewise),
 *           GPOM_ERR_CUT (some searches were cut: their answers have a flag).
 *  Cost: for each point 2 searches and n^3 / 6 + n^2 multiply-adds, n = n_hits + n_free. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_query_points(const gpom_map_t *map,
                                                        const gpom_point_t *points, size_t n_points,
                                                        gpom_answer_t *answers,
                                                        const gpom_scratch_t *scratch);

/** Answer the centres of a raster's cells: faster than a list, as neighbouring cells share their
 *  search.
 *
 *  answers  nx * ny answers, row by row from the lowest y: cell (ix, iy) at iy * nx + ix.
 *  Errors   as gpom_query_points(); GPOM_ERR_ARG also for a raster out of range.
 *  Cost: for each cell at most that of a point of gpom_query_points(). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_query_raster(const gpom_map_t *map,
                                                        const gpom_raster_t *raster,
                                                        gpom_answer_t *answers,
                                                        const gpom_scratch_t *scratch);

#ifdef __cplusplus
}
#endif
#endif
