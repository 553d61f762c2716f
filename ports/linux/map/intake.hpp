// Turns messages into scans with poses: decodes and checks them, finds their poses, counts what it
// drops.
#ifndef GPOM_LINUX_INTAKE_HPP
#define GPOM_LINUX_INTAKE_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"
#include "ports/linux/lcm/scan_decoder.hpp"
#include "ports/linux/lcm/scan_queue.hpp"
#include "ports/linux/map/latency.hpp"
#include "ports/linux/pose/frame_jump.hpp"
#include "ports/linux/pose/odometry.hpp"
#include "ports/linux/pose/pose_ring.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// Used by one thread. Every scan message ends in `ScanQueue::ready` or in exactly one drop
/// counter.
class Intake {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, ScanQueue &queue, Counts &counts,
              Problems &problems);

    /// Take a message of a scan channel. The order of these calls decides what the map becomes.
    void take_scan(const char *channel, const Message &message);
    /// Take a message of the pose channel.
    void take_pose(const Message &message);
    /// From now on, carry poses on by odometry.
    void use_odometry(Odometry &odometry) { odometry_ = &odometry; }
    /// Look again for the poses of waiting scans, because new odometry may have come.
    void match_waiting();
    /// Drop scans that have waited too long for a pose.
    void expire(std::int64_t monotonic_us);

private:
    /// State of one sensor's stream of scans.
    struct Track {
        bool has_scan;
        bool has_sequence;
        std::int64_t stamp_us;   ///< Stamp of the last scan accepted.
        std::int64_t order_us;   ///< Stamp of the last scan accepted that was not ahead of the
                                 ///< clock.
        std::uint32_t sequence;  ///< The newest sequence number seen.
        std::int64_t arrived_us; ///< Arrival time of the scan with that number, monotonic.
        std::int64_t behind_us;  ///< Stamp of the last scan whose stamp was before order_us.
        std::uint32_t n_behind;  ///< Number of such scans in a row, each newer than the one before.
    };

    void note(std::uint32_t kind, const ScanSlot &slot, std::int64_t other_us, double value = 0.0,
              double limit = 0.0);
    void note_wild(std::size_t i_sensor, const StampedPose &pose);
    void note_unmatched(std::uint32_t kind, const ScanSlot &slot);
    bool admit(const ScanSlot &slot, std::uint32_t sequence, std::int64_t wall_us);
    std::int32_t note_sequence(Track &track, const ScanSlot &slot, std::uint32_t sequence);
    bool is_next(Track &track, const ScanSlot &slot, std::int32_t ahead, std::uint32_t sequence);
    bool is_set_back(Track &track, std::int64_t stamp_us);
    void keep_spare();
    void hand_over(std::uint32_t i_slot);
    Continuity follow(const StampedPose &pose);
    bool is_stray(const ScanSlot &slot);
    void learn_latency(const ScanSlot &slot);
    bool read_pose(const Message &message, StampedPose &pose, Problem &problem) const;
    bool is_order_kept(const StampedPose &pose, const Message &message, Problem &problem);
    PoseMatch match(ScanSlot &slot) const;
    bool hold(ScanSlot &slot) const;
    void learn_odometry();
    PoseMatch pose_at(std::int64_t stamp_us, StampedPose &pose, float *cov) const;
    bool settle(std::uint32_t i_slot, PoseMatch match);
    void drop(std::uint32_t i_slot, std::size_t place);

    const Config *config_ = nullptr;
    ScanQueue *queue_ = nullptr;
    Counts *counts_ = nullptr;
    Problems *problems_ = nullptr;
    Track tracks_[kSensorsMax] = {};
    Latency *latencies_ = nullptr; ///< One per sensor.
    PoseRing poses_;
    std::int64_t pose_arrived_us_ = 0; ///< Arrival time of the newest pose, monotonic.
    FrameJump frame_;
    std::uint32_t n_jumps_ = 0;        ///< Number of jumps of the map frame so far.
    Odometry *odometry_ = nullptr;     ///< NULL: poses are only interpolated.
    std::uint32_t spare_ = 0;          ///< The slot that the next scan is decoded into.
    std::uint32_t *waiting_ = nullptr; ///< Slots of scans without a pose, in order of arrival.
    std::size_t n_waiting_ = 0;
};

} // namespace gpomd

#endif
