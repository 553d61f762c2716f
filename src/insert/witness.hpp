/// \file witness.hpp
/// What new beams and kept hits say of each other: new beams confirm, contradict or clear kept hits
/// (the states of a hit are drawn in live.h), and each new beam gets a verdict.
#pragma once

#include "src/map/keeper.hpp"

struct gpom_map;

namespace gpom
{

/// What the kept hits say of a new beam.
enum class Verdict : uint8_t {
    kNew,        ///< It ends at no kept hit.
    kKnown,      ///< It ends at a kept hit.
    kRefused,    ///< It runs past a hit that stands: the beam is dropped.
    kClears,     ///< It ran past a hit that is gone now; it ends at no kept hit.
    kClearsKnown ///< It ran past a hit that is gone now; it ends at a kept hit.
};

/// The verdicts on the beams of one group, a bit for each beam.
struct Judgement {
    uint32_t known;          ///< It ends at a kept hit.
    uint32_t against;        ///< It runs past a kept hit that was not cleared.
    uint32_t clears;         ///< It is the last of those that cleared a hit.
    uint32_t renews[kGroup]; ///< Slot of the oldest hit that beam i ends at, or kNoSlot.

    Verdict of(uint32_t i_beam) const
    {
        const uint32_t bit = 1u << i_beam;
        const bool is_known = (known & bit) != 0;
        if ((clears & bit) != 0) {
            return is_known ? Verdict::kClearsKnown : Verdict::kClears;
        }
        if ((against & bit) != 0) {
            return Verdict::kRefused;
        }
        return is_known ? Verdict::kKnown : Verdict::kNew;
    }
};

/// Compare the beams of the keeper's group with all kept hits near them. Fills the judgement.
/// Cost: one traversal of the hits near the group, and per hit one comparison with all beams.
void judge(gpom_map &map, Judgement &judgement);

} // namespace gpom
