// Snapshots of the map on disk. The mapping thread takes them block by block, and another thread
// writes them to disk.
#ifndef GPOM_LINUX_SNAPSHOTS_HPP
#define GPOM_LINUX_SNAPSHOTS_HPP

#include "gpom/snapshot.h"
#include "ports/linux/base/counts.hpp"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/config/config.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// Decides when a snapshot begins. A snapshot must be on disk one period after the last one was
/// begun, so that a kill loses at most one period. The time reserved for it is twice the longest
/// time that recent snapshots took, but at most half a period. As long as no time is known, half a
/// period is reserved. One thread begins snapshots, another one reports how long they took.
class SnapshotPace {
public:
    void init(std::int64_t period_us) { spare_us_ = (period_us_ = period_us) / 2; }
    /// A snapshot was begun, or there was nothing to take yet.
    void begin(std::int64_t now_us) { begun_us_ = now_us; }
    std::int64_t begun_us() const { return begun_us_; }
    std::int64_t due_us() const { return begun_us_ + period_us_ - spare_us_.load(); }
    /// Report the time from the beginning of a snapshot until it was on disk.
    void note(std::int64_t took_us);

private:
    static constexpr std::size_t kLast = 8;

    std::int64_t period_us_ = 0;
    std::int64_t begun_us_ = 0;
    std::atomic<std::int64_t> spare_us_{0};
    std::int64_t took_us_[kLast] = {}; ///< Times of the last kLast snapshots.
    std::size_t n_ = 0;                ///< Number of times reported.
};

/// Each of the two slots has an image in memory. The mapping thread writes a snapshot into an
/// image, a few blocks at a time. The writing thread then writes the image to disk, and only after
/// that may the next snapshot begin. A slow disk therefore never delays the map.
class Snapshots {
public:
    static std::size_t need(const Config &config);
    /// Read what is on disk. `file` is copied. A block size of zero means that there are no slots.
    void init(const Config &config, Memory &memory, const gpom_snapshot_io_t &file, Counts &counts);
    bool is_used() const { return image_[0] != nullptr; }

    /// Read the newest whole snapshot on disk into a map. It may be of a larger map. False: there
    /// is no whole snapshot.
    bool restore(gpom_map_t *map, gpom_snapshot_report_t &report);
    /// The slot's file was renamed: the image in memory is no longer on disk.
    void drop(std::uint32_t slot);

    /// For the mapping thread, on every turn: begin a snapshot when it is time, or take a few more
    /// blocks. True: more blocks are left.
    bool step(const gpom_map_t *map, std::int64_t monotonic_us);
    /// How long the mapping thread may sleep before its next call of step() [us].
    std::int64_t wait_us(std::int64_t monotonic_us) const;
    /// For the mapping thread, at the end: take a last snapshot, whole. Waits for the disk.
    void finish(const gpom_map_t *map);

    /// Main function of the writing thread. Returns after stop(), when every image handed over is
    /// on disk.
    void run();
    void stop();

private:
    static gpom_status_t read_image(void *snapshots, std::uint32_t slot, std::uint32_t offset,
                                    std::uint8_t *block);
    static gpom_status_t write_image(void *snapshots, std::uint32_t slot, std::uint32_t offset,
                                     const std::uint8_t *block);
    gpom_snapshot_io_t image_io();
    bool begin(const gpom_map_t *map);
    bool advance(const gpom_map_t *map, std::uint32_t n_blocks);
    void hand_over(std::uint32_t slot);
    bool write_file(std::uint32_t slot);

    Counts *counts_ = nullptr;
    gpom_snapshot_io_t file_ = {};
    std::uint8_t *image_[2] = {};
    std::uint32_t slot_bytes_ = 0;
    std::uint32_t used_bytes_ = 0; ///< Bytes used in the image that is being written.
    SnapshotPace pace_;
    bool has_turned_ = false; ///< step() was called, so the pace runs.
    bool is_writing_ = false; ///< A snapshot is being taken.
    gpom_snapshot_t snapshot_ = {};

    std::mutex mutex_;
    std::condition_variable changed_;
    int handed_slot_ = -1; ///< Guarded by mutex_. The writing thread owns the slot until this is -1
                           ///< again.
    std::uint32_t handed_bytes_ = 0; ///< Guarded by mutex_.
    bool is_stopping_ = false;       ///< Guarded by mutex_.
};

} // namespace gpomd

#endif
