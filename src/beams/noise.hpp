/// \file noise.hpp
/// Noise variances of the points of a beam.
#pragma once

#include "src/beams/beam.hpp"

namespace gpom
{

/// Noise variances of points whose places are known.
struct Noise {
    float seen; ///< Hits that scans of several times returned from (Beam::agreed > 0).
    float once; ///< Hits that scans of one time saw, or that lost their last count (agreed 0).
    float past; ///< Hits that scans of several times saw through.
    float free; ///< Free points.
};

/// Excess of a past hit. At its place, the hit explains half of the variance that it explained
/// before (rho^2 = 1/2 in scan.h).
constexpr float kPastExcess = 1.0f;

/// Noise variance of a point whose place is uncertain (scan.h). sn2 is the noise variance of a
/// point whose place is known, and `excess` is Beam::excess.
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
