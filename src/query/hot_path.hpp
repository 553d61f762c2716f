/// \file hot_path.hpp
/// What the rest of the library knows of the code that is compiled for each instruction set: plain
/// types, the same in all of them, and which one to use.
#pragma once

#include "gpom/query.h"

#ifndef GPOM_DISPATCH
#define GPOM_DISPATCH 0 ///< 1: an x86-64 library that also holds AVX2 and AVX-512.
#endif

struct gpom_point_list {
    const gpom_point_t *points;
    size_t n;
};

/// Queries at one lane width. Arguments were checked; flags of the answers come back, or-ed.
struct gpom_hot_path {
    uint32_t lanes;
    size_t (*scratch_bytes)(const gpom_map &map);
    unsigned (*answer_points)(const gpom_map &map, const gpom_point_list &points,
                              gpom_answer_t *answers, void *scratch);
    unsigned (*answer_raster)(const gpom_map &map, const gpom_raster_t &raster,
                              gpom_answer_t *answers, void *scratch);
};

namespace gpom
{

/// The hot path of this instruction set (answer.cpp).
gpom_hot_path hot_path_here();

/// The one that queries use.
gpom_hot_path hot_path();

/// GPOM_ERR_MEM if the scratch does not suffice for queries on this map.
gpom_status_t check_scratch(const gpom_map &map, const gpom_scratch_t &scratch);

} // namespace gpom
