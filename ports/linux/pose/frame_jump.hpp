// Finds jumps of the map frame. A jump is a pose that the robot cannot have reached.
#ifndef GPOM_LINUX_FRAME_JUMP_HPP
#define GPOM_LINUX_FRAME_JUMP_HPP

#include "ports/linux/pose/pose_ring.hpp"

#include <cstdint>

namespace gpomd
{

/// What happens to the map at a jump.
enum class JumpRule : std::uint8_t {
    none,   ///< gpomd does not look for jumps.
    keep,   ///< All beams stay, in a new frame epoch. The other two rules begin a new epoch, too.
    forget, ///< Forget what is near the pose before the jump and near the pose after it.
    clear   ///< Forget all beams.
};

/// Limits on the motion between two poses that are dt apart in time: distance_m + speed_mps dt for
/// the way, turn_rad + turn_radps dt for the turn.
struct JumpConfig {
    JumpRule rule;
    double distance_m; ///< Largest correction of a localiser that is not a jump.
    double speed_mps;  ///< The robot cannot be faster than this.
    double turn_rad;   ///< Like distance_m, for the turn. Over pi: turns are not checked.
    double turn_radps; ///< The robot cannot turn faster than this.
    double forget_m;   ///< JumpRule::forget: radius around each of the two poses.
};

/// How a pose continues the poses before it.
enum class Continuity : std::uint8_t {
    follows, ///< The robot can have reached it from the last good pose.
    strays,  ///< The robot cannot have reached it from the last good pose. The next pose decides
             ///< whether it is wild or the first pose of a new frame.
    jumps    ///< The robot cannot have reached it from the last good pose, but from the stray pose
             ///< just before. The frame jumped.
};

/// Tells wild poses from jumps. A single stray pose is wild. Two stray poses in a row that agree
/// are a jump. The very first pose is always believed.
class FrameJump {
public:
    void init(const JumpConfig &config) { config_ = config; }

    /// Judge a finite pose. Stamps may run backwards, by as much as the stamps of different sensors
    /// differ.
    Continuity take(const StampedPose &pose);
    /// The last pose that followed or jumped.
    const StampedPose &last() const { return last_; }

private:
    bool is_reached(const StampedPose &from, const StampedPose &to) const;

    JumpConfig config_ = {};
    StampedPose last_ = {};  ///< The last pose that followed or jumped.
    StampedPose stray_ = {}; ///< The pose before, if it was a stray.
    bool has_last_ = false;
    bool has_stray_ = false;
};

} // namespace gpomd

#endif
