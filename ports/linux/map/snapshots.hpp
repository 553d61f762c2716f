// The map on disk: taken on the mapping thread block by block, written by another one.
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

/// When a snapshot is to begin so that it is on disk a period after the last one was begun: then no
/// kill loses more than a period. Twice as long as any of the last ones took is left for it, half a
/// period at most, and half a period as long as none is known. One thread begins snapshots, another
/// one tells how long they took.
class SnapshotPace {
public:
    void init(std::int64_t period_us) { spare_us_ = (period_us_ = period_us) / 2; }
    /// The last one was begun, or there was nothing yet to begin with.
    void begin(std::int64_t now_us) { begun_us_ = now_us; }
    std::int64_t begun_us() const { return begun_us_; }
    std::int64_t due_us() const { return begun_us_ + period_us_ - spare_us_.load(); }
    /// A snapshot took so long, from its beginning until it was on disk.
    void note(std::int64_t took_us);

private:
    static constexpr std::size_t kLast = 8;

    std::int64_t period_us_ = 0;
    std::int64_t begun_us_ = 0;
    std::atomic<std::int64_t> spare_us_{0};
    std::int64_t took_us_[kLast] = {}; ///< Of the last ones.
    std::size_t n_ = 0;                ///< That were noted.
};

/// Both slots have an image in memory. The mapping thread writes a snapshot into an image, a few
/// blocks at a time, and hands it over; the writing thread brings it to disk, and only then may the
/// next one begin. So the disk, however slow, never holds the map up.
class Snapshots {
public:
    static std::size_t need(const Config &config);
    /// Read what is on disk. `file` is copied; slots of a block of zeros are none.
    void init(const Config &config, Memory &memory, const gpom_snapshot_io_t &file, Counts &counts);
    bool is_used() const { return image_[0] != nullptr; }

    /// Read the newest snapshot on disk into a map, also one of a larger map. False: there is none
    /// that is whole.
    bool restore(gpom_map_t *map, gpom_snapshot_report_t &report);
    /// The slot's file was set aside: what is in the image is on disk no more.
    void drop(std::uint32_t slot);

    /// The mapping thread, every turn: begin when it is time, go on by a few blocks. True: go on.
    bool step(const gpom_map_t *map, std::int64_t monotonic_us);
    /// How long the mapping thread may sleep before its next turn with step() [us].
    std::int64_t wait_us(std::int64_t monotonic_us) const;
    /// The mapping thread, at the end: a last snapshot, whole. Waits for the disk.
    void finish(const gpom_map_t *map);

    /// The writing thread. Ends at stop(), when all that was handed over is written.
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
    std::uint32_t used_bytes_ = 0; ///< Of the image being written.
    SnapshotPace pace_;
    bool has_turned_ = false; ///< step() was called: the pace runs.
    bool is_writing_ = false; ///< A snapshot is being taken.
    gpom_snapshot_t snapshot_ = {};

    std::mutex mutex_;
    std::condition_variable changed_;
    int handed_slot_ = -1; ///< Guarded by mutex_: the writing thread's until it is -1 again.
    std::uint32_t handed_bytes_ = 0; ///< Guarded by mutex_.
    bool is_stopping_ = false;       ///< Guarded by mutex_.
};

} // namespace gpomd

#endif
