/// \file hot_path.hpp
/// The interface of the code that is compiled once for each instruction set, and the choice between
/// the instruction sets. The types are plain and the same for all instruction sets.
#pragma once

#include "gpom/query.h"

#ifndef GPOM_DISPATCH
#define GPOM_DISPATCH 0 ///< 1: an x86-64 library with code for AVX2 and AVX-512 too.
#endif

struct gpom_point_list {
    const gpom_point_t *points;
    size_t n;
};

/// Distances from a query to the neighbours that it uses. Where there is no neighbour: about 3e14.
struct gpom_distances {
    float hit_m;      ///< The nearest hit.
    float last_hit_m; ///< The farthest hit.
    float free_m;     ///< The nearest free segment.
};

/// Queries at one lane width. The caller has checked the arguments. answer_points(), probe_points()
/// and answer_raster() return the bitwise or of the flags of the answers.
struct gpom_hot_path {
    uint32_t lanes;
    size_t (*scratch_bytes)(const gpom_map &map);
    unsigned (*answer_points)(const gpom_map &map, const gpom_point_list &points,
                              gpom_answer_t *answers, void *scratch);
    unsigned (*probe_points)(const gpom_map &map, const gpom_point_list &points,
                             gpom_answer_t *answers, gpom_distances *distances, void *scratch);
    unsigned (*answer_raster)(const gpom_map &map, const gpom_raster_t &raster,
                              gpom_answer_t *answers, void *scratch);
};

namespace gpom
{

/// The hot path for the instruction set that the file is compiled for (answer.cpp).
gpom_hot_path hot_path_here();

/// The hot path that queries use on this processor.
gpom_hot_path hot_path();

/// GPOM_ERR_MEM if the scratch is too small for queries on this map.
gpom_status_t check_scratch(const gpom_map &map, const gpom_scratch_t &scratch);

} // namespace gpom
