/// \file beam.hpp
/// The beam store: what is kept of each beam, and the two parts of it that a query sees, its hit
/// and its free segment.
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
    float excess; ///< w = 1 / rho^2 - 1 >= 0: how much its noise is raised (scan.h); 0: known.
    uint32_t id;  ///< Order of insertion.
    uint32_t is_hit : 1;
    uint32_t scan : 31; ///< Number of its scan, modulo 2^31.
};
static_assert(sizeof(Beam) == 40, "GPOM_MAP_BYTES counts on it");

struct Point {
    float x_m, y_m;
};

/// From (x, y), `length_m` along the unit direction.
struct Segment {
    float x_m, y_m, dir_x, dir_y, length_m;
};

inline Point end_of(const Segment &s)
{
    return {s.x_m + s.length_m * s.dir_x, s.y_m + s.length_m * s.dir_y};
}

/// The occupied part of a beam that returned: from its hit on, in the paper's model of no length.
struct HitPart {
    float depth_m;

    Segment operator()(const Beam &beam) const
    {
        return {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y,
                beam.dir_x, beam.dir_y, depth_m};
    }
};

/// The free part of a beam. The gap before the hit is left to the Gaussian process (paper, III.E);
/// without a hit there is none to leave.
struct FreePart {
    float gap_m;

    Segment operator()(const Beam &beam) const
    {
        const float gap = beam.is_hit != 0 ? gap_m : 0.0f;
        const float length_m = beam.range_m > gap ? beam.range_m - gap : 0.0f;
        return {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, length_m};
    }
};

} // namespace gpom
