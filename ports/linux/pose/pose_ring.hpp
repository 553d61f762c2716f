// The last poses of the pose channel, for scans that carry no pose.
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
    not_yet, ///< The time is after the newest pose.
    too_old, ///< The time is before the oldest pose kept.
    jumped,  ///< The time is before the oldest pose kept, and the map frame jumped just before that
             ///< pose.
    gap      ///< The poses before and after are too far apart in time.
};

/// Index of the first of n ordered stamps that is not before a time. n: all stamps are before it.
template <class StampAt>
std::size_t first_stamp_not_before(std::int64_t stamp_us, std::size_t n, const StampAt &stamp_at)
{
    std::size_t low = 0; // the index is in low .. high
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

/// A bounded ring of poses, ordered by stamp.
class PoseRing {
public:
    static constexpr std::size_t kPoses = 1024; ///< 5 s at 200 Hz.
    /// After this many poses in a row that are older than the newest pose, and each newer than the
    /// one before, the sender's clock must have been set back. The ring then begins anew.
    static constexpr std::uint32_t kSetBack = 10;

    static bool is_finite(const StampedPose &pose);

    /// Add a pose. `now_us` is the time of the clock that stamps are of. False: the pose is not
    /// finite, or not newer than the newest pose. A pose that was ahead of the clock when it came
    /// is dropped if a pose comes that is not.
    bool push(const StampedPose &pose, std::int64_t now_us = INT64_MAX);

    /// Number of poses dropped so far because they had been ahead of the clock.
    std::uint32_t n_gave_way() const { return n_gave_way_; }

    /// Remove the newest pose. There must be one.
    void drop_newest() { --n_; }

    /// The map frame jumped: forget earlier poses, because they are of another frame and must not
    /// be interpolated with new ones.
    void begin_frame();

    /// The pose at a time, interpolated between the poses before and after it. Yaw takes the
    /// shorter way round.
    PoseMatch at(std::int64_t stamp_us, std::int64_t gap_max_us, StampedPose &pose) const;

    /// Get the newest pose that is not after a time. False: there is none.
    bool not_after(std::int64_t stamp_us, StampedPose &pose) const;

private:
    const StampedPose &nth(std::size_t i) const { return poses_[(first_ + i) % kPoses]; }
    void give_way(std::int64_t stamp_us);
    std::size_t first_not_before(std::int64_t stamp_us) const;

    StampedPose poses_[kPoses] = {};
    std::size_t first_ = 0;
    std::size_t n_ = 0;
    bool is_after_jump_ = false;       ///< The oldest pose is the first of its frame.
    std::int64_t sure_us_ = INT64_MIN; ///< Poses newer than this were ahead of the clock when they
                                       ///< came.
    std::uint32_t n_gave_way_ = 0;
    std::int64_t behind_us_ = 0; ///< Stamp of the last pose that was older than the newest.
    std::uint32_t n_behind_ = 0; ///< Number of such poses in a row.
};

} // namespace gpomd

#endif
