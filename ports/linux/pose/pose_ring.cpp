#include "ports/linux/pose/pose_ring.hpp"

#include <cmath>

namespace gpomd
{

bool PoseRing::is_finite(const StampedPose &pose)
{
    return std::isfinite(pose.x_m) && std::isfinite(pose.y_m) && std::isfinite(pose.yaw_rad);
}

/// Drop poses that were ahead of the clock when they came, and are not older than a new pose.
/// Without this, one pose from the future would keep all others out until its time has come.
void PoseRing::give_way(std::int64_t stamp_us)
{
    for (; n_ > 0 && nth(n_ - 1).stamp_us >= stamp_us && stamp_us > sure_us_; --n_) {
        ++n_gave_way_;
    }
}

bool PoseRing::push(const StampedPose &pose, std::int64_t now_us)
{
    if (!is_finite(pose)) {
        return false;
    }
    if (pose.stamp_us <= now_us) {
        give_way(pose.stamp_us);
    }
    if (n_ > 0 && pose.stamp_us <= nth(n_ - 1).stamp_us) {
        n_behind_ = pose.stamp_us > behind_us_ ? n_behind_ + 1 : 1;
        behind_us_ = pose.stamp_us;
        if (n_behind_ < kSetBack) {
            return false;
        }
        n_ = 0;
        is_after_jump_ = false;
        sure_us_ = INT64_MIN;
    }
    n_behind_ = 0;
    behind_us_ = pose.stamp_us;
    if (n_ == kPoses) {
        first_ = (first_ + 1) % kPoses;
        --n_;
        is_after_jump_ = false;
    }
    poses_[(first_ + n_) % kPoses] = pose;
    ++n_;
    sure_us_ = pose.stamp_us <= now_us ? pose.stamp_us : sure_us_;
    return true;
}

void PoseRing::begin_frame()
{
    n_ = 0;
    is_after_jump_ = true;
}

std::size_t PoseRing::first_not_before(std::int64_t stamp_us) const
{
    return first_stamp_not_before(stamp_us, n_, [this](std::size_t i) { return nth(i).stamp_us; });
}

bool PoseRing::not_after(std::int64_t stamp_us, StampedPose &pose) const
{
    const std::size_t i_after = first_not_before(stamp_us);
    if (i_after < n_ && nth(i_after).stamp_us == stamp_us) {
        pose = nth(i_after);
        return true;
    }
    if (i_after == 0) {
        return false;
    }
    pose = nth(i_after - 1);
    return true;
}

PoseMatch PoseRing::at(std::int64_t stamp_us, std::int64_t gap_max_us, StampedPose &pose) const
{
    if (n_ == 0 || stamp_us > nth(n_ - 1).stamp_us) {
        return PoseMatch::not_yet;
    }
    if (stamp_us < nth(0).stamp_us) {
        return is_after_jump_ ? PoseMatch::jumped : PoseMatch::too_old;
    }
    const std::size_t i_after = first_not_before(stamp_us);
    const StampedPose &after = nth(i_after);
    if (after.stamp_us == stamp_us) {
        pose = after;
        return PoseMatch::found;
    }
    const StampedPose &before = nth(i_after - 1);
    const std::int64_t span_us = after.stamp_us - before.stamp_us;
    if (span_us > gap_max_us) {
        return PoseMatch::gap;
    }
    const double part =
        static_cast<double>(stamp_us - before.stamp_us) / static_cast<double>(span_us);
    const double turn_rad = std::remainder(after.yaw_rad - before.yaw_rad, 2.0 * M_PI);
    pose = {stamp_us, before.x_m + part * (after.x_m - before.x_m),
            before.y_m + part * (after.y_m - before.y_m), before.yaw_rad + part * turn_rad};
    return PoseMatch::found;
}

} // namespace gpomd
