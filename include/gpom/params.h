/** \file params.h
 *  Hyperparameters. They are learnt beforehand and handed in; the library never changes them.
 *
 *  The latent function f of the map is a Gaussian process with covariance k. Occupied points have
 *  the label +1, free points -1. "Paper" is O'Callaghan, Ramos and Durrant-Whyte (2009),
 *  "Contextual Occupancy Maps using Gaussian Processes". */
#ifndef GPOM_PARAMS_H
#define GPOM_PARAMS_H

#include "gpom/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Covariance function. r = |x - x'| [m] is the distance of two points. Each function is multiplied
 *  by the signal variance sf2. */
typedef enum {
    /** Neural network, the paper's eq. 4, with x~ = (1, x, y) and S = diag(s0, s1, s1):
     *  asin(2 x~' S x~* / sqrt((1 + 2 x~' S x~)(1 + 2 x~*' S x~*))). Not stationary. */
    GPOM_KERNEL_NN = 0,
    GPOM_KERNEL_MATERN12 = 1, /**< exp(-r / ell). */
    GPOM_KERNEL_MATERN32 = 2, /**< (1 + s) exp(-s), s = sqrt(3) r / ell. */
    GPOM_KERNEL_SE = 3,       /**< Squared exponential: exp(-r^2 / (2 ell^2)). */
    GPOM_KERNEL_ASKEY = 4     /**< (1 - r / ell)^3 for r < ell, else 0: compact support. */
} gpom_kernel_t;

/** Frame of the points that the covariance gets. It matters only to GPOM_KERNEL_NN. */
typedef enum {
    GPOM_FRAME_QUERY = 0, /**< Coordinates relative to the query point: the default. */
    GPOM_FRAME_MAP = 1    /**< Coordinates relative to the map's origin: the paper's choice. */
} gpom_frame_t;

/** Most neighbours (hits plus free points) of one query with a dense solve. */
#define GPOM_POINTS_MAX 64u
/** Most neighbours of one query with a covariance of compact support (GPOM_KERNEL_ASKEY). Above
 *  GPOM_POINTS_MAX the solve is sparse (SuiteSparse). A library built with SPARSE=0, as for
 *  firmware, refuses more than GPOM_POINTS_MAX. */
#define GPOM_SPARSE_POINTS_MAX 512u

/** Hyperparameters. Fill with gpom_params_init(), change, check with gpom_params_check(). */
typedef struct {
    uint32_t struct_bytes; /**< Set by gpom_params_init(); guards against a header mismatch. */
    int32_t kernel;        /**< gpom_kernel_t. Default GPOM_KERNEL_MATERN12. */
    int32_t frame;         /**< gpom_frame_t. Default GPOM_FRAME_QUERY. */
    float sf2;             /**< Signal variance [1]; 1e-6 .. 1e6. Default 13. */
    float s0;              /**< NN only: variance of the bias weight [1]; 1e-3 .. 1e6.
                                Default 60. */
    float s1;              /**< NN only: variance of the position weights [1/m2]; 1e-6 .. 1e4.
                                Default 1. */
    float ell_m;           /**< All but NN: length scale [m]; 0.2 .. 1000, for Askey 0.6 .. 1000.
                                Default 11. */
    float sn2;             /**< Noise variance of hits [1]; at least 1e-3 sf2, at most 1e6. With
                                Matern-1/2 and Askey the lower bound is 1e-5 sf2 if
                                gap_m (1 - anisotropy) is 0.05 or more. With these bounds float32
                                keeps a probability within 0.01, if the sigmoid is as in the
                                presets. This does not hold where a hit stands on the free segment
                                of another beam (docs/decisions/float32.md). Default 0.02. */
    float sn2_free;        /**< Noise variance of free points [1]; bounds as for sn2.
                                Default 0.31. */
    float alpha;           /**< Slope of the sigmoid, eq. 7 [1]; 1e-6 .. 1e6. Default 3.2. */
    float beta;            /**< Offset of the sigmoid, eq. 7 [1]; -1e6 .. 1e6. Default 0.035. */
    float gap_m;           /**< Free segments end this far before their hit [m]; 0 .. 1e6.
                                Default 0.05. */
    float p_occupied;      /**< Class occupied at or above this probability. Default 0.7. */
    float p_free;    /**< Class free at or below this probability; < p_occupied. Default 0.3. */
    uint16_t n_hits; /**< Nearest hits used for each query; >= 1. Default 8. */
    uint16_t n_free; /**< Nearest free segments used for each query; >= 1. n_hits + n_free <= 64,
                          or <= 512 with GPOM_KERNEL_ASKEY in a library with the sparse solve.
                          Default 8. */

    /* Fields beyond the paper's model. The value 0, the default, leaves out each of them exactly.
       See docs/method.md. */

    uint16_t scan_points_max; /**< Most points of one scan among the neighbours of each kind
                                   (hits, free). They are chosen from the n + n / 2 nearest, n
                                   being n_hits or n_free. 0 .. 64, 0: no limit. */
    uint16_t n_fading;        /**< The last n_fading neighbours of each kind lose weight with
                                   their distance. So answers do not jump where one neighbour
                                   replaces another. The weight is w = 1 - t^2. t rises from 0 at
                                   the last neighbour that does not fade to 1 at the (n + 1)-th
                                   neighbour, which has no effect. A noise v becomes
                                   (v + k(x*, x*)) / w - k(x*, x*). In the vote and in the scatter
                                   of the hits, each neighbour counts with w. If a scan has
                                   reached scan_points_max, its last point fades, too. 0: no
                                   neighbour fades; otherwise less than n_hits and less than
                                   n_free. Neighbours at equal distances still appear and
                                   disappear together, and answers may jump there. Free segments
                                   that start at one place and all point away from the query are
                                   an example. */
    float depth_m;            /**< A hit is occupied from its place on over this depth, away from
                                   the sensor [m]; 0 .. 5. */
    float anisotropy;         /**< Distances along the main axis of the chosen hits shrink by the
                                   factor 1 - anisotropy (1 - sqrt(l2 / l1)). l1 is the scatter of
                                   the hits along this axis, l2 across it. 0 .. 1; must be 0 in
                                   the map frame. */
    float vote;               /**< Weight, inside eq. 7, of the mean cosine between the beams of
                                   the chosen hits and the way from hit to query. The cosine is 1
                                   behind the surface and -1 before it. The effect fades to 0 at
                                   30 m from the nearest hit. -1e6 .. 1e6. */
    float log_hit_first;      /**< Weight, inside eq. 7, of log(d + 2 cm). d is the distance of
                                   the nearest hit, at most 30 m. This field and the next three:
                                   -1e6 .. 1e6. */
    float log_hit_last;       /**< The same for the n_hits-th hit. */
    float log_free_first;     /**< The same for the nearest free point. */
    float log_free_last;      /**< The same for the n_free-th free point. */
    float fade_m;             /**< The effect of the neighbours fades by 1 - d^2 / fade_m^2. d is
                                   the distance to the nearest of them [m]. From d = fade_m on,
                                   the answer is the prior. 0.1 .. 1e6; 0: no fading. Must be 0 in
                                   the map frame. */
    float beta_far;           /**< Offset for places far from all neighbours. It is added to beta
                                   with the factor d^2 / fade_m^2, at most 1: the part of the
                                   neighbours' effect that fade_m removes. -1e6 .. 1e6; must be 0
                                   if fade_m is 0. */
    float sn2_once;           /**< Only for live maps (keep_m > 0, live.h): noise variance of hits
                                   that only scans of one time saw [1]. When a scan of another
                                   time returns from within keep_m of the hit, the noise becomes
                                   sn2. It becomes sn2_once again when scans that saw through the
                                   hit took its last count. sn2 .. 1e6; 0: the same as sn2. */
    float line;               /**< Weight, inside eq. 7, of how far the query is behind the line
                                   through the chosen hits: (1 - sqrt(l2 / l1)) (n . b) t /
                                   sqrt(t^2 + (5 cm)^2). n is the normal of the line. b is the
                                   mean direction of the beams of the hits. t is the distance from
                                   the line along n [m]. l1 and l2 are as for anisotropy. The
                                   effect fades to 0 at 30 m from the nearest hit. -1e6 .. 1e6. */
} gpom_params_t;

/** Fill with a general setting: Matern-1/2, 8 + 8 neighbours. It was learnt from three logs
 *  together, two indoors and one outdoors, for maps that keep one beam in 25. Hyperparameters
 *  learnt for one place and its map are better there.
 *
 *  Cost: O(1). */
GPOM_API void gpom_params_init(gpom_params_t *params);

/** Check every field. Also check that the prior probability lies between p_free and p_occupied.
 *  Then a place that nobody has seen is never called free or occupied.
 *
 *  problem  NULL, or where to put a static one-line text "field: what is wrong". The text is NULL
 *           if all is well.
 *  Errors   GPOM_ERR_ARG (params NULL, or not from gpom_params_init()), GPOM_ERR_PARAMS.
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_params_check(const gpom_params_t *params,
                                                        const char **problem);

/** Prior variance k(x*, x*) of the latent function [1]. With GPOM_FRAME_MAP it is the value at the
 *  map's origin.
 *
 *  Cost: O(1). */
GPOM_API float gpom_params_prior_variance(const gpom_params_t *params);

/** Probability of occupancy far from all beams, eq. 7: Phi(beta / sqrt(1 + alpha^2 k(x*, x*))). In
 *  this equation beta_far and the four log terms at 30 m are added to beta.
 *
 *  Cost: O(1). */
GPOM_API float gpom_params_prior_probability(const gpom_params_t *params);

/** Bytes of a stored record of hyperparameters. A record has a magic number, a version, the fields,
 *  and a CRC-32. The bytes are little-endian on every processor. */
#define GPOM_PARAMS_RECORD_BYTES 108u

/** Write a record of GPOM_PARAMS_RECORD_BYTES bytes, for a file or a flash page.
 *
 *  Errors   GPOM_ERR_ARG (null), or the errors of gpom_params_check(). The record is untouched
 *           after an error.
 *  Cost: O(1): the check, and the CRC-32 of one record. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_params_save(const gpom_params_t *params,
                                                       uint8_t *record);

/** Read a record and check every field. Any bytes are safe. *params changes only on GPOM_OK. A
 *  record of the version before (98 bytes) is read, too; fields that it does not have become
 *  neutral. Any other version is refused: learn again, or write the TOML again.
 *
 *  problem  as in gpom_params_check().
 *  Errors   GPOM_ERR_ARG (null), GPOM_ERR_FORMAT (size, magic, version or CRC), GPOM_ERR_PARAMS.
 *  Cost: O(1): the check, and the CRC-32 of one record. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_params_load(gpom_params_t *params, const uint8_t *record,
                                                       size_t record_bytes, const char **problem);

#ifdef __cplusplus
}
#endif
#endif
