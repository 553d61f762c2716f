/// \file gradient_path.hpp
/// The interface of the code of gradients, which is compiled once for each instruction set, as the
/// hot path of queries is (hot_path.hpp). It is apart from the hot path, so that an image without
/// gradients does not contain it.
#pragma once

#include "gpom/gradient.h"
#include "src/query/hot_path.hpp"

/// Gradients at one lane width. The caller has checked the arguments. gradients() returns the
/// bitwise or of the flags of the answers.
struct gpom_gradient_path {
    size_t (*scratch_bytes)(const gpom_map &map);
    unsigned (*gradients)(const gpom_map &map, const gpom_point_list &points,
                          gpom_gradient_t *gradients, void *scratch);
};

namespace gpom
{

/// The code for the instruction set that the file is compiled for (gradient.cpp).
gpom_gradient_path gradient_path_here();

} // namespace gpom
