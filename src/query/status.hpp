/// \file status.hpp
/// From the flags of answers to a status.
#pragma once

#include "gpom/query.h"

namespace gpom
{

inline gpom_status_t status_of(unsigned flags)
{
    if ((flags & GPOM_ANSWER_PIVOT) != 0) {
        return GPOM_ERR_PIVOT;
    }
    if ((flags & GPOM_ANSWER_OUT_OF_REACH) != 0) {
        return GPOM_ERR_REACH;
    }
    return (flags & GPOM_ANSWER_CUT) != 0 ? GPOM_ERR_CUT : GPOM_OK;
}

} // namespace gpom
