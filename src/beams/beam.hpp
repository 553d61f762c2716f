/// \file beam.hpp
/// The beam: what the store keeps of it, and its two parts that a query sees, the hit and the free
/// segment.
#pragma once

#include "src/lane/four.hpp"

#include <stdint.h>

namespace gpom
{

/// State of a beam's hit. Queries see past and standing hits.
enum HitState : uint16_t {
    kNoHit,       ///< The beam has no hit, or lost it.
    kProvisional, ///< It contradicts earlier scans or its own scan, and is not confirmed yet.
    kPast,        ///< Scans of several times saw through it. It may still be there.
    kStanding
};

/// One kept beam, relative to the map's origin. 36 bytes.
///
/// The last two bytes hold the state of the parts, and counts of the scans for and against the hit
/// (witness.hpp). A part that was contradicted too often is removed, while the other part stays. A
/// slot of the store whose beam has neither part is vacant. Nothing counts for or against a past
/// hit: its counts hold the time since which it is past (set_past()).
struct Beam {
    float x_m, y_m;           ///< Sensor position, or where it begins late (late_start.hpp).
    float dir_x, dir_y;       ///< Unit direction.
    float range_m;            ///< Raw range, or the usable maximum if there was no return; from
                              ///< where it begins.
    float excess;             ///< w = 1 / rho^2 - 1 >= 0 raises its noise (scan.h). 0: place known.
    uint32_t id;              ///< Order of insertion since the map was empty.
    uint32_t stamp_ms;        ///< Time of its scan, from stamp0_us on.
    uint16_t scan;            ///< Number of its scan, modulo 2^16.
    uint16_t returned : 1;    ///< range_m ends at a surface. A gap is left before the surface.
    uint16_t hit : 2;         ///< HitState.
    uint16_t has_free : 1;    ///< Its free segment is known.
    uint16_t agreed : 4;      ///< Number of scans that saw its hit again, minus scans against it.
    uint16_t hit_against : 2; ///< Scans in a row that saw through its hit, at most 3.
    uint16_t arrived : 1;     ///< It hit a place where free segments of earlier scans ran.
    uint16_t hit_time : 5;    ///< Mark of the time of the last scan for or against its hit.
                              ///< Scans of one time count once.
};
static_assert(sizeof(Beam) == 36, "GPOM_MAP_BYTES counts on it");

inline bool has_hit(const Beam &beam) { return beam.hit != kNoHit; }
/// False if the slot of the beam in the store is vacant.
inline bool is_kept(const Beam &beam) { return has_hit(beam) || beam.has_free != 0; }
/// The slot after this one in the list of vacant slots. A vacant slot does not need its stamp, so
/// that the stamp holds the next slot.
inline uint32_t &next_vacant(Beam &vacant) { return vacant.stamp_ms; }
inline bool is_provisional(const Beam &beam) { return beam.hit == kProvisional; }
inline bool is_past(const Beam &beam) { return beam.hit == kPast; }

/// The hit is past from a time on. Of the time's number (Keeper::time_number) the beam keeps 12
/// bits, in the fields that a past hit does not need. The scan's stamp stays, so that the beam can
/// move when its scan's pose is corrected.
inline void set_past(Beam &beam, uint32_t time_number)
{
    beam.hit = kPast;
    beam.agreed = time_number & 15u;
    beam.hit_against = time_number >> 4 & 3u;
    beam.arrived = time_number >> 6 & 1u;
    beam.hit_time = time_number >> 7 & 31u;
}

/// True if a past hit became past at a time. Wrong for times that are a multiple of 4096 apart.
inline bool became_past_at(const Beam &beam, uint32_t time_number)
{
    Beam then = beam;
    set_past(then, time_number);
    return then.agreed == beam.agreed && then.hit_against == beam.hit_against &&
           then.arrived == beam.arrived && then.hit_time == beam.hit_time;
}

constexpr uint32_t kAgreedMax = 15;
constexpr uint32_t kTimeMarkBits = 5;
constexpr uint32_t kTimeMarkMask = (1u << kTimeMarkBits) - 1;

/// Greatest excess. Points of a beam with this excess have no effect, but their noise is finite.
constexpr float kExcessMax = 1e9f;

struct Point {
    float x_m, y_m;
};

/// A segment that starts at (x_m, y_m) and runs length_m along the unit direction.
struct Segment {
    float x_m, y_m, dir_x, dir_y, length_m;
};

inline Point end_of(const Segment &s)
{
    return {s.x_m + s.length_m * s.dir_x, s.y_m + s.length_m * s.dir_y};
}

/// The occupied part of a beam that returned. It starts at the hit and is depth_m long. In the
/// paper's model its length is 0.
struct HitPart {
    float depth_m;

    Segment operator()(const Beam &beam) const
    {
        float ray[4]; // start and direction
        lane::load_four<5>(&beam.x_m, ray);
        return {ray[0] + beam.range_m * ray[2], ray[1] + beam.range_m * ray[3], ray[2], ray[3],
                depth_m};
    }

    static bool is_in(const Beam &beam) { return has_hit(beam); }
    static bool is_seen(const Beam &beam) { return beam.hit >= kPast; }
};

/// The free part of a beam. It ends gap_m before the return, because the Gaussian process decides
/// about the gap (paper, III.E). If there was no return, there is no gap.
struct FreePart {
    float gap_m;

    Segment operator()(const Beam &beam) const
    {
        const float gap = beam.returned != 0 ? gap_m : 0.0f;
        float ray[4];
        lane::load_four<5>(&beam.x_m, ray);
        return {ray[0], ray[1], ray[2], ray[3], beam.range_m - gap};
    }

    static bool is_in(const Beam &beam) { return beam.has_free != 0; }
    static bool is_seen(const Beam &beam) { return beam.has_free != 0; }
};

/// The end of a beam: its return, or the far end of its free segment if there was no return.
inline Point end_of(const Beam &beam)
{
    return {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y};
}

/// Let a beam start start_m farther along its way. Its end stays.
inline void advance_start(Beam &beam, float start_m)
{
    beam.x_m += start_m * beam.dir_x;
    beam.y_m += start_m * beam.dir_y;
    beam.range_m -= start_m;
}

} // namespace gpom
