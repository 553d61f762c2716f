// Scans on their way into the map: a fixed number of slots that threads hand to each other.
#ifndef GPOM_LINUX_SCAN_QUEUE_HPP
#define GPOM_LINUX_SCAN_QUEUE_HPP

#include "gpom/gpom.h"
#include "ports/linux/base/memory.hpp"

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// A scan in a slot. Its arrays have room for IntakeConfig::ranges_max ranges.
struct ScanSlot {
    std::int64_t stamp_us;
    std::int64_t latest_us;  ///< Stamp of the latest beam. Types without a time per beam: stamp_us.
    std::int64_t arrived_us; ///< Arrival time, monotonic.
    std::size_t i_sensor;
    std::uint32_t n_jumps; ///< Number of jumps of the map frame before this scan.
    gpom_pose_t pose;      ///< Pose at stamp_us. Its cov points to `cov` below, or is NULL.
    float cov[9];
    double angle_min_rad;
    double angle_step_rad;
    std::uint32_t n_ranges;
    bool is_per_beam; ///< Each beam has a bearing, a time and a pose of its own.
    float *ranges_m;
    float *bearings_rad;     ///< Bearing of each beam, for types that have bearings.
    std::int64_t *stamps_us; ///< Time of each beam, for types that have times.
    gpom_pose_t *poses;      ///< Pose of each beam, for types that have times. Filled when poses
                             ///< are matched.
};

/// A bounded first-in, first-out list of slot numbers. Threads share it.
class SlotList {
public:
    static std::size_t need(std::size_t n_max) { return Memory::need<std::uint32_t>(n_max); }
    void init(Memory &memory, std::size_t n_max);

    /// Append a slot number. There is always room for all slots.
    void push(std::uint32_t slot);
    /// Take the next slot number. Waits for one for wait_us at most. False: none came.
    bool pop(std::uint32_t &slot, std::int64_t wait_us);
    std::size_t size();
    /// End the waiting of pop() now.
    void wake();

private:
    std::mutex mutex_;
    std::condition_variable arrived_;
    std::uint32_t *slots_ = nullptr;
    std::size_t n_max_ = 0;
    std::size_t first_ = 0;
    std::size_t n_ = 0;
    bool is_woken_ = false;
};

/// The slots. Each slot is free, held by the decoding thread, ready, or held by the mapping thread.
class ScanQueue {
public:
    static std::size_t need(std::size_t n_slots, std::size_t n_ranges, bool has_per_beam);
    void init(Memory &memory, std::size_t n_slots, std::size_t n_ranges, bool has_per_beam);

    ScanSlot &slot(std::uint32_t i) { return slots_[i]; }
    std::size_t n_slots() const { return n_slots_; }

    SlotList free;
    SlotList ready;

private:
    ScanSlot *slots_ = nullptr;
    std::size_t n_slots_ = 0;
};

} // namespace gpomd

#endif
