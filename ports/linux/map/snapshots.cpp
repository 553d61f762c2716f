#include "ports/linux/map/snapshots.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>
#include <cstring>

namespace gpomd
{

namespace
{

constexpr std::uint32_t kBlock = GPOM_SNAPSHOT_BLOCK_BYTES;

/// Blocks taken in one turn of the mapping thread: 416 beams.
constexpr std::uint32_t kTurnBlocks = 32;

/// Shortest sleep while a snapshot is due and the disk still writes the one before.
constexpr std::int64_t kRetry_us = 1000;

/// Blocks taken in one call when no other work waits.
constexpr std::uint32_t kManyBlocks = 1u << 16;

} // namespace

void SnapshotPace::note(std::int64_t took_us)
{
    took_us_[n_++ % kLast] = took_us;
    const std::int64_t longest_us = *std::max_element(took_us_, took_us_ + kLast);
    spare_us_.store(std::min(2 * longest_us, period_us_ / 2));
}

std::size_t Snapshots::need(const Config &config)
{
    return config.snapshot_path[0] == '\0'
               ? 0
               : 2 * Memory::need<std::uint8_t>(GPOM_SNAPSHOT_SLOT_BYTES(config.map.beam_max));
}

void Snapshots::init(const Config &config, Memory &memory, const gpom_snapshot_io_t &file,
                     Counts &counts)
{
    counts_ = &counts;
    file_ = file;
    pace_.init(config.snapshot_period_us);
    slot_bytes_ = GPOM_SNAPSHOT_SLOT_BYTES(config.map.beam_max);
    for (std::uint32_t slot = 0; slot < 2; ++slot) {
        image_[slot] = memory.take<std::uint8_t>(slot_bytes_);
        for (std::uint32_t at = 0; at < slot_bytes_; at += kBlock) {
            if (file_.read(file_.ctx, slot, at, image_[slot] + at) != GPOM_OK) {
                std::memset(image_[slot] + at, 0, kBlock); // damaged, or the end of the file
                break;
            }
        }
    }
}

gpom_status_t Snapshots::read_image(void *snapshots, std::uint32_t slot, std::uint32_t offset,
                                    std::uint8_t *block)
{
    const auto &self = *static_cast<const Snapshots *>(snapshots);
    if (offset > self.slot_bytes_ - kBlock) {
        return GPOM_ERR_IO;
    }
    std::memcpy(block, self.image_[slot] + offset, kBlock);
    return GPOM_OK;
}

gpom_status_t Snapshots::write_image(void *snapshots, std::uint32_t slot, std::uint32_t offset,
                                     const std::uint8_t *block)
{
    auto &self = *static_cast<Snapshots *>(snapshots);
    std::memcpy(self.image_[slot] + offset, block, kBlock);
    self.used_bytes_ = offset + kBlock;
    return GPOM_OK;
}

gpom_snapshot_io_t Snapshots::image_io()
{
    return {this, slot_bytes_, read_image, write_image, nullptr};
}

bool Snapshots::restore(gpom_map_t *map, gpom_snapshot_report_t &report)
{
    if (gpom_snapshot_read_begin(&snapshot_, map, &file_) != GPOM_OK) {
        return false;
    }
    while (snapshot_.report.is_done == 0) {
        if (gpom_snapshot_read_step(&snapshot_, map, kManyBlocks) != GPOM_OK) {
            return false;
        }
    }
    report = snapshot_.report;
    return true;
}

void Snapshots::drop(std::uint32_t slot) { std::memset(image_[slot], 0, kBlock); }

bool Snapshots::begin(const gpom_map_t *map)
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (handed_slot_ >= 0) { // the disk is slow: begin at a later turn
            return false;
        }
    }
    const gpom_snapshot_io_t io = image_io();
    is_writing_ = gpom_snapshot_write_begin(&snapshot_, map, &io) == GPOM_OK;
    if (!is_writing_) {
        counts_->add(GPOM_WIRE_SNAPSHOTS_FAILED);
    }
    return is_writing_;
}

/// Take blocks. False: the snapshot is done, or it failed.
bool Snapshots::advance(const gpom_map_t *map, std::uint32_t n_blocks)
{
    if (gpom_snapshot_write_step(&snapshot_, map, n_blocks) != GPOM_OK) {
        counts_->add(GPOM_WIRE_SNAPSHOTS_FAILED);
        is_writing_ = false;
    } else if (snapshot_.report.is_done != 0) {
        is_writing_ = false;
        hand_over(snapshot_.report.slot);
    }
    return is_writing_;
}

bool Snapshots::step(const gpom_map_t *map, std::int64_t monotonic_us)
{
    if (!is_used()) {
        return false;
    }
    if (!is_writing_) {
        if (!has_turned_) {
            has_turned_ = true;
            pace_.begin(monotonic_us);
        }
        if (monotonic_us < pace_.due_us() || !begin(map)) {
            return false;
        }
        pace_.begin(monotonic_us);
    }
    return advance(map, kTurnBlocks);
}

std::int64_t Snapshots::wait_us(std::int64_t monotonic_us) const
{
    return is_used() ? std::max(pace_.due_us() - monotonic_us, kRetry_us) : INT64_MAX;
}

void Snapshots::finish(const gpom_map_t *map)
{
    if (!is_used()) {
        return;
    }
    {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return handed_slot_ < 0; });
    }
    is_writing_ = false; // a snapshot under way is not the last state
    if (begin(map)) {
        while (advance(map, kManyBlocks)) {
        }
    }
}

void Snapshots::hand_over(std::uint32_t slot)
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        handed_slot_ = static_cast<int>(slot);
        handed_bytes_ = used_bytes_;
    }
    changed_.notify_all();
}

void Snapshots::run()
{
    for (;;) {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return handed_slot_ >= 0 || is_stopping_; });
        if (handed_slot_ < 0) {
            return;
        }
        const auto slot = static_cast<std::uint32_t>(handed_slot_);
        // No other snapshot begins until this one is written.
        const std::int64_t begun_us = pace_.begun_us();
        lock.unlock();
        const bool is_written = write_file(slot);
        pace_.note(monotonic_us() - begun_us);
        counts_->add(is_written ? GPOM_WIRE_SNAPSHOTS_WRITTEN : GPOM_WIRE_SNAPSHOTS_FAILED);
        lock.lock();
        if (!is_written) { // the image must not claim what the disk does not hold
            drop(slot);
        }
        handed_slot_ = -1;
        lock.unlock();
        changed_.notify_all();
    }
}

void Snapshots::stop()
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        is_stopping_ = true;
    }
    changed_.notify_all();
}

bool Snapshots::write_file(std::uint32_t slot)
{
    for (std::uint32_t at = 0; at < handed_bytes_; at += kBlock) {
        if (file_.write(file_.ctx, slot, at, image_[slot] + at) != GPOM_OK) {
            return false;
        }
    }
    return file_.flush == nullptr || file_.flush(file_.ctx, slot) == GPOM_OK;
}

} // namespace gpomd
