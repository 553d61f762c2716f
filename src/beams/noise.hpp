/// \file noise.hpp
/// Noise variances of a beam's points, by what is known of them.
#pragma once

#include "src/beams/beam.hpp"

namespace gpom
{

/// Noise variances of points whose places are known.
struct Noise {
    float seen; ///< Of a hit with counts: scans of several times returned from it.
    float once; ///< Of one without counts: scans of one time saw it, or those against took them.
    float past; ///< Of one that scans of several times saw through.
    float free; ///< Of free points.
};

/// Excess of a past hit: of what it said, half the variance is left (scan.h: rho^2 = 1/2).
constexpr float kPastExcess = 1.0f;

/// Noise variance of a point whose place is uncertain from that of a known one and its beam's
/// excess (scan.h).
inline float raised(float sn2, float prior_variance, float excess)
{
    return sn2 + excess * (sn2 + prior_variance);
}

inline float sn2_of(const Noise &noise, const Beam &beam, const HitPart &)
{
    if (is_past(beam)) {
        return noise.past;
    }
    return beam.agreed == 0 ? noise.once : noise.seen;
}

inline float sn2_of(const Noise &noise, const Beam &, const FreePart &) { return noise.free; }

} // namespace gpom
