// The last poses of a channel, for scans that carry none.
#ifndef GPOM_LINUX_POSE_RING_HPP
#define GPOM_LINUX_POSE_RING_HPP

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A pose of the robot in the map frame.
struct StampedPose {
    std::int64_t stamp_us;
    double x_m;
    double y_m;
    double yaw_rad;
};

enum class PoseMatch : std::uint8_t {
    found,
    not_yet, ///< Newer than the newest pose.
    too_old, ///< Older than the oldest pose kept.
    jumped,  ///< Likewise, and the map frame jumped just before that pose.
    gap      ///< The poses before and after are too far apart in time.
};

/// Index of the first of n stamps, in their order, that is not before a time; n: all are before it.
template <class StampAt>
std::size_t first_stamp_not_before(std::int64_t stamp_us, std::size_t n, const StampAt &stamp_at)
{
    std::size_t low = 0; // it is in low .. high
    std::size_t high = n;
    while (low < high) {
        const std::size_t middle = (low + high) / 2;
        if (stamp_at(middle) < stamp_us) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/// A bounded ring of poses in the order of their stamps.
class PoseRing {
public:
    static constexpr std::size_t kPoses = 1024; ///< 5 s at 200 Hz.
    /// Poses in a row behind the newest, each newer than the one before, after which time is taken
    /// to have been set back: the ring begins anew.
    static constexpr std::uint32_t kSetBack = 10;

    static bool is_finite(const StampedPose &pose);

    /// Take a pose, at a time of the clock that stamps are of. False: not finite, or not newer than
    /// the newest. Poses that were ahead of the clock when they came give way to one that is not.
    bool push(const StampedPose &pose, std::int64_t now_us = INT64_MAX);

    /// Poses that gave way so far.
    std::uint32_t n_gave_way() const { return n_gave_way_; }

    /// Take the newest pose back; there must be one.
    void drop_newest() { --n_; }

    /// The map frame jumped: poses before are of another one, and none is interpolated with them.
    void begin_frame();

    /// The pose at a time, interpolated between the two about it; yaw the short way round.
    PoseMatch at(std::int64_t stamp_us, std::int64_t gap_max_us, StampedPose &pose) const;

    /// The newest pose not after a time; false: there is none.
    bool not_after(std::int64_t stamp_us, StampedPose &pose) const;

private:
    const StampedPose &nth(std::size_t i) const { return poses_[(first_ + i) % kPoses]; }
    void give_way(std::int64_t stamp_us);
    std::size_t first_not_before(std::int64_t stamp_us) const;

    StampedPose poses_[kPoses] = {};
    std::size_t first_ = 0;
    std::size_t n_ = 0;
    bool is_after_jump_ = false;       ///< The oldest pose is the first of its frame.
    std::int64_t sure_us_ = INT64_MIN; ///< Newer poses were ahead of the clock when they came.
    std::uint32_t n_gave_way_ = 0;
    std::int64_t behind_us_ = 0; ///< Stamp of the last one that came behind.
    std::uint32_t n_behind_ = 0; ///< So many in a row.
};

} // namespace gpomd

#endif
