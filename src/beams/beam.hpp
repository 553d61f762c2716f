/// \file beam.hpp
/// The beam store: what is kept of each beam, and the two parts of it that a query sees, its hit
/// and its free segment.
#pragma once

#include "src/lane/lane.hpp"

#include <stdint.h>

namespace gpom
{

/// What is known of a beam's hit. Queries see the last two.
enum HitState : uint16_t {
    kNoHit,       ///< None, or no longer.
    kProvisional, ///< It is against what was known, or its own scan, and not confirmed yet.
    kPast,        ///< Scans of several times saw through it: something may stand there, no more.
    kStanding
};

/// One kept beam, relative to the map's origin. 36 bytes.
///
/// The last two bytes count witnesses (keep.hpp). A part that was contradicted too often is gone
/// while the other stays. A slot of the store whose beam has neither part is vacant.
struct Beam {
    float x_m, y_m;     ///< Sensor position.
    float dir_x, dir_y; ///< Unit direction.
    float range_m;      ///< Raw range, or the usable maximum if there was no return.
    float excess;      ///< w = 1 / rho^2 - 1 >= 0: how much its noise is raised (scan.h); 0: known.
    uint32_t id;       ///< Order of insertion since the map was empty.
    uint32_t stamp_ms; ///< Time of its scan, or since when its hit is past; from stamp0_us on.
    uint16_t scan;     ///< Number of its scan, modulo 2^16.
    uint16_t returned : 1;    ///< range_m ends at a surface: a gap is left before it.
    uint16_t hit : 2;         ///< HitState.
    uint16_t has_free : 1;    ///< Its free segment is known.
    uint16_t agreed : 4;      ///< Count of scans that saw its hit again, less those against it.
    uint16_t hit_against : 2; ///< Scans in a row that saw through its hit, at most 3.
    uint16_t arrived : 1;     ///< It hit where free segments of earlier scans ran.
    uint16_t hit_time : 5;    ///< Mark of the time of the last witness for or against its hit:
                              ///< scans of one time count once.
};
static_assert(sizeof(Beam) == 36, "GPOM_MAP_BYTES counts on it");

inline bool has_hit(const Beam &beam) { return beam.hit != kNoHit; }
/// False: its slot of the store is vacant.
inline bool is_kept(const Beam &beam) { return has_hit(beam) || beam.has_free != 0; }
/// The list of vacant slots: a vacant slot has no use for its stamp, and holds the next slot there.
inline uint32_t &next_vacant(Beam &vacant) { return vacant.stamp_ms; }
inline bool is_provisional(const Beam &beam) { return beam.hit == kProvisional; }
inline bool is_past(const Beam &beam) { return beam.hit == kPast; }

constexpr uint32_t kAgreedMax = 15;
constexpr uint32_t kTimeMarkBits = 5;
constexpr uint32_t kTimeMarkMask = (1u << kTimeMarkBits) - 1;

/// Beyond this excess a beam's points have no say; keeps the noise finite.
constexpr float kExcessMax = 1e9f;

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

    static bool is_in(const Beam &beam) { return has_hit(beam); }
    static bool is_seen(const Beam &beam) { return beam.hit >= kPast; }
};

/// The free part of a beam. The gap before the hit is left to the Gaussian process (paper, III.E);
/// without a hit there is none to leave.
struct FreePart {
    float gap_m;

    Segment operator()(const Beam &beam) const
    {
        const float gap = beam.returned != 0 ? gap_m : 0.0f;
        return {beam.x_m, beam.y_m, beam.dir_x, beam.dir_y, beam.range_m - gap};
    }

    static bool is_in(const Beam &beam) { return beam.has_free != 0; }
    static bool is_seen(const Beam &beam) { return beam.has_free != 0; }
};

/// Where a beam speaks: its return, or the far end of its free segment.
inline Point end_of(const Beam &beam)
{
    return {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y};
}

} // namespace gpom
