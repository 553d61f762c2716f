// Scans on their way into the map: fixed slots, handed from thread to thread.
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

/// A scan in a slot. Arrays have room for IntakeConfig::ranges_max.
struct ScanSlot {
    std::int64_t stamp_us;
    std::int64_t latest_us;  ///< Of its latest beam; types without times per beam: stamp_us.
    std::int64_t arrived_us; ///< Monotonic.
    std::size_t i_sensor;
    std::uint32_t n_jumps; ///< Of the map frame before this scan.
    gpom_pose_t pose;      ///< At stamp_us; cov is `cov` below, or NULL.
    float cov[9];
    double angle_min_rad;
    double angle_step_rad;
    std::uint32_t n_ranges;
    bool is_per_beam; ///< Each beam has bearing, time and pose of its own.
    float *ranges_m;
    float *bearings_rad;     ///< Per beam, in types that have them.
    std::int64_t *stamps_us; ///< Likewise.
    gpom_pose_t *poses;      ///< Likewise; filled when matched.
};

/// A bounded first-in, first-out list of slot numbers between threads.
class SlotList {
public:
    static std::size_t need(std::size_t n_max) { return Memory::need<std::uint32_t>(n_max); }
    void init(Memory &memory, std::size_t n_max);

    /// There is always room for as many as there are slots.
    void push(std::uint32_t slot);
    /// The next slot; false if there is none, after waiting for one so long at most.
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

/// Slots: each is free, with the thread that decodes, ready, or with the thread that maps.
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
