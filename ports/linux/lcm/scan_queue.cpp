#include "ports/linux/lcm/scan_queue.hpp"

#include <chrono>

namespace gpomd
{

void SlotList::init(Memory &memory, std::size_t n_max)
{
    slots_ = memory.take<std::uint32_t>(n_max);
    n_max_ = n_max;
}

void SlotList::push(std::uint32_t slot)
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        slots_[(first_ + n_) % n_max_] = slot;
        ++n_;
    }
    arrived_.notify_one();
}

bool SlotList::pop(std::uint32_t &slot, std::int64_t wait_us)
{
    std::unique_lock<std::mutex> lock(mutex_);
    if (n_ == 0 && wait_us > 0) {
        arrived_.wait_for(lock, std::chrono::microseconds(wait_us),
                          [this] { return n_ > 0 || is_woken_; });
    }
    is_woken_ = false;
    if (n_ == 0) {
        return false;
    }
    slot = slots_[first_];
    first_ = (first_ + 1) % n_max_;
    --n_;
    return true;
}

std::size_t SlotList::size()
{
    const std::lock_guard<std::mutex> lock(mutex_);
    return n_;
}

void SlotList::wake()
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        is_woken_ = true;
    }
    arrived_.notify_one();
}

std::size_t ScanQueue::need(std::size_t n_slots, std::size_t n_ranges, bool has_per_beam)
{
    const std::size_t per_beam = has_per_beam ? Memory::need<float>(n_ranges) +
                                                    Memory::need<std::int64_t>(n_ranges) +
                                                    Memory::need<gpom_pose_t>(n_ranges)
                                              : 0;
    return Memory::need<ScanSlot>(n_slots) + 2 * SlotList::need(n_slots) +
           n_slots * (Memory::need<float>(n_ranges) + per_beam);
}

void ScanQueue::init(Memory &memory, std::size_t n_slots, std::size_t n_ranges, bool has_per_beam)
{
    slots_ = memory.take<ScanSlot>(n_slots);
    n_slots_ = n_slots;
    free.init(memory, n_slots);
    ready.init(memory, n_slots);
    for (std::uint32_t i = 0; i < n_slots; ++i) {
        slots_[i].ranges_m = memory.take<float>(n_ranges);
        if (has_per_beam) {
            slots_[i].bearings_rad = memory.take<float>(n_ranges);
            slots_[i].stamps_us = memory.take<std::int64_t>(n_ranges);
            slots_[i].poses = memory.take<gpom_pose_t>(n_ranges);
        }
        free.push(i);
    }
}

} // namespace gpomd
