/// \file classify.hpp
/// Probabilistic least-squares classification (paper, III.C).
#pragma once

#include "gpom/params.h"
#include "gpom/query.h"
#include "src/lane/elementary.hpp"

namespace gpom
{

/// Eq. 7: p = Phi((alpha mu + beta) / sqrt(1 + alpha^2 var)). The square root is missing in the
/// paper's text (Rasmussen and Williams 2006, sec. 6.5). `offset` is beta plus the terms of
/// context.hpp.
template <class F> inline F squash(const gpom_params_t &params, F mu, F var, F offset)
{
    const F spread = lane::sqrt(F(1.0f + (params.alpha * params.alpha) * var));
    return normal_cdf(F((params.alpha * mu + offset) / spread));
}

inline gpom_class_t class_of(const gpom_params_t &params, float probability)
{
    if (probability >= params.p_occupied) {
        return GPOM_OCCUPIED;
    }
    return probability <= params.p_free ? GPOM_FREE : GPOM_UNSURE;
}

} // namespace gpom
