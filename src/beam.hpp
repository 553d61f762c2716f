/// \file beam.hpp
/// The beam store: what is kept of each beam, and the two things a query sees of it, its hit and
/// its free segment.
#pragma once

#include <stdint.h>

namespace gpom
{

/// One kept beam, relative to the map's origin. 40 bytes.
struct Beam {
    int64_t stamp_us;
    float x_m, y_m;     ///< Sensor position.
    float dir_x, dir_y; ///< Unit direction.
    float range_m;      ///< Raw range, or the usable maximum if there was no return.
    float excess;       ///< w = 1 / rho^2 - 1 >= 0: how much its noise is raised (scan.h); 0: known.
    uint32_t id;        ///< Order of insertion.
    uint32_t is_hit;
};
static_assert(sizeof(Beam) == 40, "GPOM_MAP_BYTES counts on it");

struct Point {
    float x_m, y_m;
};

/// The free part of a beam: from its origin, `length_m` along its direction.
struct Segment {
    float x_m, y_m, dir_x, dir_y, length_m;
};

inline Point hit_of(const Beam &beam)
{
    return {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y};
}

/// The gap before the hit is left to the Gaussian process (paper, III.E); without a hit there is
/// none to leave.
inline Segment free_segment_of(const Beam &beam, float gap_m)
{
    const float to_gap_m = beam.range_m > gap_m ? beam.range_m - gap_m : 0.0f;
    const float length_m = beam.is_hit != 0 ? to_gap_m : beam.range_m;
    return {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, length_m};
}

} // namespace gpom
