/** \file status.h
 *  Status codes, version numbers, and the two attributes that every other header uses. */
#ifndef GPOM_STATUS_H
#define GPOM_STATUS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Grows when programs that use the library must change. */
#define GPOM_VERSION_MAJOR 0
/** Grows when the interface changes. */
#define GPOM_VERSION_MINOR 1
/** Grows when only the implementation changes. */
#define GPOM_VERSION_PATCH 0
/** Version of this interface as one number, e.g. 102 for 0.1.2. */
#define GPOM_VERSION (GPOM_VERSION_MAJOR * 10000 + GPOM_VERSION_MINOR * 100 + GPOM_VERSION_PATCH)

#if defined(__GNUC__) || defined(__clang__)
/** The compiler warns if a program ignores the returned status. */
#define GPOM_NODISCARD __attribute__((warn_unused_result))
/** The shared library exports the function. */
#define GPOM_API __attribute__((visibility("default")))
#else
#define GPOM_NODISCARD
#define GPOM_API
#endif

/** Result of a call. Zero is success; every error is negative. */
typedef enum {
    GPOM_OK = 0,          /**< Done. */
    GPOM_ERR_ARG = -1,    /**< An argument is null, uninitialised or out of range. */
    GPOM_ERR_MEM = -2,    /**< The memory of the caller is null, misaligned or too small. */
    GPOM_ERR_PARAMS = -3, /**< A hyperparameter is refused; gpom_params_check() names it. */
    GPOM_ERR_REACH = -4,  /**< A place is farther than GPOM_REACH_M from the map's origin. */
    GPOM_ERR_PIVOT = -6,  /**< A covariance matrix was not positive definite; see gpom_answer_t. */
    GPOM_ERR_FORMAT = -7, /**< A stored record is damaged, or its version is not known. */
    GPOM_ERR_BUSY = -8,   /**< The data changed during each try to read it; call again. */
    GPOM_ERR_IO = -9,     /**< A callback of the caller could not write. */
    GPOM_ERR_CUT = -10    /**< A search was cut; see gpom_answer_t and config.walk_max. */
} gpom_status_t;

/** One line of English text for a status. Never NULL; static storage.
 *
 *  Cost: O(1). */
GPOM_API const char *gpom_status_str(gpom_status_t status);

/** GPOM_VERSION of the linked library. Compare it with GPOM_VERSION of the header.
 *
 *  Cost: O(1). */
GPOM_API uint32_t gpom_version(void);

#ifdef __cplusplus
}
#endif
#endif
