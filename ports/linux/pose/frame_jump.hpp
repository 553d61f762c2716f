// Jumps of the map frame, told by what a robot can do: a pose that it cannot have reached.
#ifndef GPOM_LINUX_FRAME_JUMP_HPP
#define GPOM_LINUX_FRAME_JUMP_HPP

#include "ports/linux/pose/pose_ring.hpp"

#include <cstdint>

namespace gpomd
{

/// What becomes of the map at a jump.
enum class JumpRule : std::uint8_t {
    none,   ///< Jumps are not looked for.
    keep,   ///< All stays, in a new frame epoch; so with the others.
    forget, ///< What is near the poses before and after is forgotten.
    clear   ///< All is forgotten.
};

/// How far a pose may be from the one before, dt apart: distance_m + speed_mps dt, and turned by
/// turn_rad + turn_radps dt.
struct JumpConfig {
    JumpRule rule;
    double distance_m; ///< What a localiser corrects without calling it a jump.
    double speed_mps;  ///< No robot of this kind is faster.
    double turn_rad;   ///< As distance_m; over pi: turns are not looked at.
    double turn_radps; ///< As speed_mps.
    double forget_m;   ///< Radius about either pose, JumpRule::forget.
};

/// How a pose continues those before it.
enum class Continuity : std::uint8_t {
    follows, ///< Within reach of the last one that did.
    strays,  ///< Out of its reach: wild, or the first of another frame; the next one will tell.
    jumps    ///< Out of its reach, but within that of the stray just before: the frame jumped.
};

/// Tells wild poses from jumps: a stray on its own is wild, two that agree are a jump. The very
/// first pose is believed.
class FrameJump {
public:
    void init(const JumpConfig &config) { config_ = config; }

    /// Take a finite pose. Stamps may run backwards by as much as sensors differ.
    Continuity take(const StampedPose &pose);
    /// The last pose that followed or jumped.
    const StampedPose &last() const { return last_; }

private:
    bool is_reached(const StampedPose &from, const StampedPose &to) const;

    JumpConfig config_ = {};
    StampedPose last_ = {};  ///< The last pose that followed or jumped.
    StampedPose stray_ = {}; ///< The last pose, if it strayed.
    bool has_last_ = false;
    bool has_stray_ = false;
};

} // namespace gpomd

#endif
