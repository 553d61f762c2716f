/** \file query.h
 *  Ask the map at any point and at any resolution: how likely is this point occupied, and how sure
 *  is the map?
 *
 *  The answer for a point depends only on the map and the point. Within one build and one
 *  instruction set the answer is the same to the last bit in any list, raster, order or thread. The
 *  one exception is a search that is cut (GPOM_ANSWER_CUT).
 *
 *  Queries use no allocation, no recursion and no locks. They are safe in an interrupt that has
 *  enough time for them. */
#ifndef GPOM_QUERY_H
#define GPOM_QUERY_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Class of a point, from the thresholds p_free and p_occupied. Only cells of the low-resolution
 *  map (lowres.h) can have the class GPOM_UNKNOWN. */
typedef enum {
    GPOM_FREE = 0,     /**< Probability at most p_free. */
    GPOM_UNSURE = 1,   /**< Probability between the two thresholds. */
    GPOM_OCCUPIED = 2, /**< Probability at least p_occupied. */
    GPOM_UNKNOWN = 3   /**< Nothing is known of the cell. */
} gpom_class_t;

/** Flag: the answer is the prior, because the coordinates are not finite or out of reach. */
#define GPOM_ANSWER_OUT_OF_REACH 1u
/** Flag: the answer is the prior, because the covariance matrix was not positive definite. */
#define GPOM_ANSWER_PIVOT 2u

/** Flag: the search for neighbours was cut after config.walk_max walks down a tree. The answer uses
 *  the nearest beams found until then; nearer ones may exist. An answer without this flag is exact.
 *  If the search of a packet (points computed together) is cut, the points of the packet are
 *  searched again one by one. So the other points of a call do not change an answer, with one
 *  exception: a packet starts from the result of the packet before and may need fewer walks than a
 *  single point. Then the answer is exact, while a query for the point alone would be cut. */
#define GPOM_ANSWER_CUT 4u

/** The answer for one point. No field is ever NaN. */
typedef struct {
    float mean;        /**< Mean of the latent function, eq. 2: +1 occupied, -1 free, 0 unknown. */
    float variance;    /**< Variance of the latent function, eq. 3; at most the prior variance.
                            It is the prior variance where nothing is known. */
    float probability; /**< Probability of occupancy, eq. 7 with its square root. */
    uint8_t cls;       /**< gpom_class_t. */
    uint8_t flags;     /**< 0, or GPOM_ANSWER_… bits. */
    uint8_t n_hits;    /**< Number of hits used; 255 means 255 or more. */
    uint8_t n_free;    /**< Number of free segments used; 255 means 255 or more. */
} gpom_answer_t;

/** A point in the map frame [m]. */
typedef struct {
    double x_m; /**< Along the x axis of the map frame [m]. */
    double y_m; /**< Along the y axis of the map frame [m]. */
} gpom_point_t;

/** Most cells along one side of a raster. */
#define GPOM_RASTER_SIDE_MAX 1048576u

/** A raster of square cells. Answers are for the centres of the cells. */
typedef struct {
    double x0_m;   /**< Lower left corner of cell (0, 0), map frame [m]. */
    double y0_m;   /**< Lower left corner of cell (0, 0), map frame [m]. */
    double cell_m; /**< Side of a cell [m]; > 0. */
    uint32_t nx;   /**< Cells along x; at most GPOM_RASTER_SIDE_MAX. */
    uint32_t ny;   /**< Cells along y; at most GPOM_RASTER_SIDE_MAX. */
} gpom_raster_t;

/** Working memory of one query call. The caller owns it; only one call at a time may use it. */
typedef struct {
    void *mem;        /**< Memory of any alignment. */
    size_t mem_bytes; /**< At least gpom_scratch_bytes(); GPOM_SCRATCH_BYTES() is always enough. */
} gpom_scratch_t;

/** Most lanes (queries computed side by side) of any build of the library. */
#define GPOM_LANES_MAX 16u

/** Bytes of scratch for n_points = n_hits + n_free neighbours and a library with `lanes` lanes.
 *  gpom_lanes() gives the lanes of this build; GPOM_LANES_MAX is enough for every build. This is a
 *  constant expression, so it can size a static array. */
#define GPOM_SCRATCH_BYTES(n_points, lanes)                                                        \
    ((size_t)1024 + ((lanes) > 1 ? (size_t)4864 : (size_t)0) +                                     \
     ((n_points) <= GPOM_POINTS_MAX ? GPOM_DENSE_BYTES(n_points, lanes)                            \
                                    : GPOM_SPARSE_BYTES(n_points, lanes)))

/** Part of GPOM_SCRATCH_BYTES() for the dense solve, with at most GPOM_POINTS_MAX neighbours. */
#define GPOM_DENSE_BYTES(n_points, lanes)                                                          \
    ((size_t)4 * (size_t)(lanes) *                                                                 \
     (GPOM_WHOLE_TILES(n_points) * (GPOM_WHOLE_TILES(n_points) + (size_t)36) / (size_t)2 +         \
      (size_t)8))

/** Part of GPOM_SCRATCH_BYTES() for the sparse solve, with more than GPOM_POINTS_MAX neighbours:
 *  1.2 MiB for 256 neighbours, 4.9 MiB for 512. */
#define GPOM_SPARSE_BYTES(n_points, lanes)                                                         \
    ((size_t)4 * (size_t)(lanes) * ((size_t)10 * GPOM_WHOLE_TILES(n_points) + (size_t)8) +         \
     (size_t)18 * (size_t)(n_points) * (size_t)(n_points) + (size_t)96 * (size_t)(n_points))

/** n_points rounded up to a multiple of 4, because the covariance matrix is factored in tiles of 4
 *  x 4. */
#define GPOM_WHOLE_TILES(n_points) (((size_t)(n_points) + (size_t)3) / (size_t)4 * (size_t)4)

/** Number of lanes: queries that the library computes side by side. It is 1, 4, 8 or 16. The build
 *  fixes the number; on x86-64 the library may choose it from what the processor has.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_lanes(void);

/** Exact bytes of scratch that a query on `map` needs; 0 for NULL.
 *
 *  Cost: O(1). */
GPOM_API size_t gpom_scratch_bytes(const gpom_map_t *map);

/** Answer a list of points.
 *
 *  answers  n_points answers in the order of the points. All are written, except after GPOM_ERR_ARG
 *           or GPOM_ERR_MEM.
 *  Errors   GPOM_ERR_ARG (null), GPOM_ERR_MEM (scratch), GPOM_ERR_REACH (some points are not finite
 *           or out of reach: their answers are the prior, with a flag), GPOM_ERR_PIVOT (some
 *           matrices are not positive definite: their answers are the prior, with a flag),
 *           GPOM_ERR_CUT (some searches were cut: their answers have a flag).
 *  Cost: for each point 2 searches and n^3 / 6 + n^2 multiply-adds, n = n_hits + n_free. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_query_points(const gpom_map_t *map,
                                                        const gpom_point_t *points, size_t n_points,
                                                        gpom_answer_t *answers,
                                                        const gpom_scratch_t *scratch);

/** Answer the centres of the cells of a raster. This is faster than a list, because neighbouring
 *  cells share their search.
 *
 *  answers  nx * ny answers, row by row from the lowest y: cell (ix, iy) is at iy * nx + ix.
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
