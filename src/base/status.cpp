#include "gpom/status.h"

const char *gpom_status_str(gpom_status_t status)
{
    switch (status) {
    case GPOM_OK:
        return "ok";
    case GPOM_ERR_ARG:
        return "an argument is null, uninitialised or out of range";
    case GPOM_ERR_MEM:
        return "memory is null, misaligned or too small";
    case GPOM_ERR_PARAMS:
        return "a hyperparameter is out of range";
    case GPOM_ERR_REACH:
        return "farther than GPOM_REACH_M from the map's origin";
    case GPOM_ERR_PIVOT:
        return "a covariance matrix was not positive definite";
    case GPOM_ERR_FORMAT:
        return "a stored record is damaged, or of a version not known";
    case GPOM_ERR_BUSY:
        return "what was to be read kept changing meanwhile";
    case GPOM_ERR_IO:
        return "a callback could not write";
    case GPOM_ERR_CUT:
        return "a search took more than walk_max walks: there may be nearer beams";
    }
    return "unknown status";
}

uint32_t gpom_version(void) { return GPOM_VERSION; }
