/** \file params.h
 *  Hyperparameters: learnt beforehand, handed in, never changed by the library.
 *
 *  The latent function f of the map is a Gaussian process with covariance k; occupied points are
 *  labelled +1 and free ones -1. "Paper" is O'Callaghan, Ramos and Durrant-Whyte (2009),
 *  "Contextual Occupancy Maps using Gaussian Processes". */
#ifndef GPOM_PARAMS_H
#define GPOM_PARAMS_H

#include "gpom/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Covariance function; r = |x - x'| [m], all multiplied by the signal variance sf2. */
typedef enum {
    /** Neural network, the paper's eq. 4, with x~ = (1, x, y) and S = diag(s0, s1, s1):
     *  asin(2 x~' S x~* / sqrt((1 + 2 x~' S x~)(1 + 2 x~*' S x~*))). Not stationary. */
    GPOM_KERNEL_NN = 0,
    GPOM_KERNEL_MATERN12 = 1, /**< exp(-r / ell). */
    GPOM_KERNEL_MATERN32 = 2, /**< (1 + s) exp(-s), s = sqrt(3) r / ell. */
    GPOM_KERNEL_SE = 3,       /**< Squared exponential: exp(-r^2 / (2 ell^2)). */
    GPOM_KERNEL_ASKEY = 4     /**< (1 - r / ell)^3 for r < ell, else 0: compact support. */
} gpom_kernel_t;

/** Frame in which the covariance sees the points. It matters to GPOM_KERNEL_NN alone. */
typedef enum {
    GPOM_FRAME_QUERY = 0, /**< Coordinates relative to the query point: the default. */
    GPOM_FRAME_MAP = 1    /**< Coordinates relative to the map's origin: the paper's. */
} gpom_frame_t;

/** Most points (hits plus free) in one query's neighbourhood: solved dense. */
#define GPOM_POINTS_MAX 64u
/** Most with a covariance of compact support (GPOM_KERNEL_ASKEY): above GPOM_POINTS_MAX the solve
 *  is sparse (SuiteSparse). A library built with SPARSE=0, as for firmware, refuses them. */
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
    float ell_m;           /**< All but NN: length scale [m]; 0.2, for Askey 0.6 .. 1000.
                                Default 11. */
    float sn2;             /**< Noise variance of hits [1]; at most 1e6, at least 1e-3 sf2, and for
                                Matern-1/2 and Askey at least 1e-5 sf2 if gap_m (1 - anisotropy) is
                                0.05 or more. Float32 then keeps a probability within 0.01 (sigmoid
                                as in the presets; not where a hit stands on the free segment of
                                another beam: docs/decisions/float32.md). Default 0.02. */
    float sn2_free;        /**< Noise variance of free points [1]; the same bounds. Default 0.31. */
    float alpha;           /**< Slope of the sigmoid, eq. 7 [1]; 1e-6 .. 1e6. Default 3.2. */
    float beta;            /**< Offset of the sigmoid, eq. 7 [1]; -1e6 .. 1e6. Default 0.035. */
    float gap_m;           /**< Free segments end this far before their hit [m]; 0 .. 1e6. Default
                                0.05. */
    float p_occupied;      /**< Class occupied at or above this probability. Default 0.7. */
    float p_free;    /**< Class free at or below this probability; < p_occupied. Default 0.3. */
    uint16_t n_hits; /**< Nearest hits per query; >= 1. Default 8. */
    uint16_t n_free; /**< Nearest free segments per query; >= 1. n_hits + n_free <= 64, with
                           GPOM_KERNEL_ASKEY and a sparse solve in the library <= 512. Default 8. */

    /* Beyond the paper's model; 0, the default, leaves each out exactly. See docs/method.md. */

    uint16_t scan_points_max; /**< Of each kind at most this many points of one scan, out of the
                                   n + n / 2 nearest; 0 .. 64, 0: no cap. */
    uint16_t n_fading;        /**< Of each kind the last n_fading neighbours fade with their
                                   distance: the next one that a query could take has no say, so
                                   that no answer jumps where neighbours change. Noise v becomes
                                   (v + k(x*, x*)) / w - k(x*, x*), w = 1 - t^2, t rising from 0 at
                                   the last that does not fade to 1 at the (n + 1)-th neighbour; in
                                   the vote and the scatter of the hits each counts w. Of a scan at
                                   its cap (scan_points_max) the last point fades, too. 0: none
                                   fades; else less than n_hits and than n_free. Neighbours at equal
                                   distances, as free segments that begin at one place and all look
                                   away from the query, still come and go together: there answers
                                   may jump. */
    float depth_m;            /**< Occupied part of a hit: from it on this far [m]; 0 .. 5. */
    float anisotropy;         /**< Distances along the main axis of the chosen hits shrink by the
                                   factor 1 - anisotropy (1 - sqrt(l2 / l1)), l1 and l2 being their
                                   scatter along and across it; 0 .. 1, 0 in the map frame. */
    float vote;               /**< Weight, inside eq. 7, of the mean cosine between the chosen hits'
                                   beams and the way from hit to query: 1 behind the surface, -1
                                   before it; fades to 0 at 30 m from the nearest hit. */
    float log_hit_first;      /**< Weight, inside eq. 7, of log(d + 2 cm), d the distance of the
                                   nearest hit, at most 30 m. These four: -1e6 .. 1e6. */
    float log_hit_last;       /**< The same of the n_hits-th hit. */
    float log_free_first;     /**< The same of the nearest free point. */
    float log_free_last;      /**< The same of the n_free-th free point. */
    float fade_m;             /**< What the neighbours say fades with the distance d [m] to the
                                   nearest of them by 1 - d^2 / fade_m^2: from here on the answer is
                                   the prior. 0.1 .. 1e6, 0: never; 0 in the map frame. */
    float beta_far;           /**< Added to beta as far as fade_m takes the neighbours away: an own
                                   offset for places far from all; -1e6 .. 1e6, 0 if fade_m is 0. */
    float sn2_once;           /**< Live maps alone (keep_m > 0, live.h): noise variance of hits that
                                   scans of one time alone saw [1], until a scan of another time
                                   returns from within keep_m, and again once scans that saw through
                                   the hit took its last count. sn2 .. 1e6, 0: as sn2. */
    float line;               /**< Weight, inside eq. 7, of how far the query is behind the line
                                   through the chosen hits: (1 - sqrt(l2 / l1)) (n . b) t /
                                   sqrt(t^2 + (5 cm)^2), n being the line's normal, b the mean
                                   direction of the hits' beams and t the distance [m] from the line
                                   along n; fades to 0 at 30 m from the nearest hit. -1e6 .. 1e6. */
} gpom_params_t;

/** Fill with a general setting: Matern-1/2, 8 + 8 neighbours, learnt from three logs together, two
 *  indoors and one outdoors, for maps that keep one beam in 25. Those learnt for a place and its
 *  map are better.
 *
 *  Cost: O(1). */
GPOM_API void gpom_params_init(gpom_params_t *params);

/** Check every field, and that the prior probability lies between p_free and p_occupied, so that
 *  a place nobody has seen is never called free or occupied.
 *
 *  problem  NULL, or where a static one-line text "field: what is wrong" is put; NULL text if OK.
 *  Errors   GPOM_ERR_ARG (params NULL, or not from gpom_params_init), GPOM_ERR_PARAMS.
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_params_check(const gpom_params_t *params,
                                                        const char **problem);

/** Prior variance k(x*, x*) of the latent function [1], at the map's origin for GPOM_FRAME_MAP.
 *
 *  Cost: O(1). */
GPOM_API float gpom_params_prior_variance(const gpom_params_t *params);

/** Probability of occupancy far from all beams: Phi(beta / sqrt(1 + alpha^2 k(x*, x*))), eq. 7,
 *  with beta_far and the four log terms at 30 m added to beta.
 *
 *  Cost: O(1). */
GPOM_API float gpom_params_prior_probability(const gpom_params_t *params);

/** Bytes of a stored record of hyperparameters: magic, version, fields in little-endian order on
 *  every processor, CRC-32. */
#define GPOM_PARAMS_RECORD_BYTES 108u

/** Write a record of GPOM_PARAMS_RECORD_BYTES, for a file or a flash page.
 *
 *  Errors   GPOM_ERR_ARG (null), or what gpom_params_check() says; the record is then untouched.
 *  Cost: O(1): the check, and the CRC-32 of one record. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_params_save(const gpom_params_t *params,
                                                       uint8_t *record);

/** Read a record and check every field. Any bytes are safe; *params changes only on GPOM_OK.
 *  A record of the version before (98 bytes) is read, with fields it does not know neutral; any
 *  other version is refused: learn again, or write the TOML anew.
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
