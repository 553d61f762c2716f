#include "ports/linux/pose/frame_jump.hpp"

#include <cmath>
#include <cstdlib>

namespace gpomd
{

bool FrameJump::is_reached(const StampedPose &from, const StampedPose &to) const
{
    const double dt_s = 1e-6 * static_cast<double>(std::llabs(to.stamp_us - from.stamp_us));
    const double way_m = std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
    const double turn_rad = std::fabs(std::remainder(to.yaw_rad - from.yaw_rad, 2.0 * M_PI));
    return way_m <= config_.distance_m + config_.speed_mps * dt_s &&
           turn_rad <= config_.turn_rad + config_.turn_radps * dt_s;
}

Continuity FrameJump::take(const StampedPose &pose)
{
    const bool follows = !has_last_ || is_reached(last_, pose);
    const bool jumps = !follows && has_stray_ && is_reached(stray_, pose);
    has_stray_ = !follows && !jumps;
    if (has_stray_) {
        stray_ = pose;
        return Continuity::strays;
    }
    has_last_ = true;
    last_ = pose;
    return follows ? Continuity::follows : Continuity::jumps;
}

} // namespace gpomd
