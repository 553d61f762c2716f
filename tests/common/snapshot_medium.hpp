/// \file snapshot_medium.hpp
/// Two slots in memory whose power can fail, and whole snapshots written to and read from them.
#pragma once

#include "tests/common/reference.hpp"

#include <zlib.h>

namespace reference
{

constexpr std::size_t kBlock = GPOM_SNAPSHOT_BLOCK_BYTES;

using Bytes = std::vector<std::uint8_t>;

struct Medium {
    Bytes slots[2];
    std::uint64_t n_bytes_left = UINT64_MAX; ///< What is written after so many bytes is lost.
    std::int64_t lost_block = -1;            ///< This write, counted from 0, never arrives.
    bool tears_erase = false;                ///< The rest of a block that was cut is 0xff.
    int n_reads = 0, n_writes = 0, n_flushes = 0;

    explicit Medium(std::uint32_t beam_max)
    {
        for (Bytes &slot : slots) {
            slot.assign(GPOM_SNAPSHOT_SLOT_BYTES(beam_max), 0xff);
        }
    }

    gpom_snapshot_io_t io()
    {
        return {this, static_cast<std::uint32_t>(slots[0].size()), read_block, write_block,
                flush_slot};
    }

    void check_place(std::uint32_t slot, std::uint32_t offset) const
    {
        const bool is_block = slot < 2 && offset % kBlock == 0;
        if (!is_block || offset + kBlock > slots[slot].size()) { // far quicker than REQUIRE
            FAIL("no block: slot ", slot, ", offset ", offset);
        }
    }

    static gpom_status_t read_block(void *ctx, std::uint32_t slot, std::uint32_t offset,
                                    std::uint8_t *block)
    {
        auto &self = *static_cast<Medium *>(ctx);
        ++self.n_reads;
        self.check_place(slot, offset);
        std::memcpy(block, self.slots[slot].data() + offset, kBlock);
        return GPOM_OK;
    }

    static gpom_status_t write_block(void *ctx, std::uint32_t slot, std::uint32_t offset,
                                     const std::uint8_t *block)
    {
        auto &self = *static_cast<Medium *>(ctx);
        self.check_place(slot, offset);
        const bool is_lost = self.n_writes++ == self.lost_block;
        const std::size_t n = std::min<std::uint64_t>(is_lost ? 0 : kBlock, self.n_bytes_left);
        std::uint8_t *const at = self.slots[slot].data() + offset;
        if (self.tears_erase && n > 0) {
            std::memset(at, 0xff, kBlock);
        }
        std::memcpy(at, block, n);
        self.n_bytes_left -= n;
        return GPOM_OK; // whoever has no power notices nothing
    }

    static gpom_status_t flush_slot(void *ctx, std::uint32_t slot)
    {
        REQUIRE(slot < 2);
        ++static_cast<Medium *>(ctx)->n_flushes;
        return GPOM_OK;
    }
};

/// Write or read a whole snapshot, `n_blocks` a step.
struct Outcome {
    gpom_status_t status = GPOM_OK;
    gpom_snapshot_report_t report = {};
};

inline Outcome write_snapshot(const gpom_map_t *map, Medium &medium, std::uint32_t n_blocks = 1000)
{
    gpom_snapshot_t snapshot;
    const gpom_snapshot_io_t io = medium.io();
    Outcome outcome;
    outcome.status = gpom_snapshot_write_begin(&snapshot, map, &io);
    while (outcome.status == GPOM_OK && snapshot.report.is_done == 0) {
        outcome.status = gpom_snapshot_write_step(&snapshot, map, n_blocks);
    }
    outcome.report = snapshot.report;
    return outcome;
}

inline Outcome read_snapshot(gpom_map_t *map, Medium &medium, std::uint32_t n_blocks = 1000)
{
    gpom_snapshot_t snapshot;
    const gpom_snapshot_io_t io = medium.io();
    Outcome outcome;
    outcome.status = gpom_snapshot_read_begin(&snapshot, map, &io);
    while (outcome.status == GPOM_OK && snapshot.report.is_done == 0) {
        outcome.status = gpom_snapshot_read_step(&snapshot, map, n_blocks);
    }
    outcome.report = snapshot.report;
    return outcome;
}

/// The beams that a map holds, slot by slot.
inline std::vector<gpom_beam_t> beams_of(const gpom_map_t *map)
{
    std::vector<gpom_beam_t> beams;
    bool is_ok = true;
    for (std::uint32_t i = 0; i < gpom_map_slot_count(map); ++i) {
        gpom_beam_t beam;
        is_ok = gpom_map_beam(map, i, &beam) == GPOM_OK && is_ok;
        if (beam.is_hit != 0 || beam.is_free != 0) {
            beams.push_back(beam);
        }
    }
    REQUIRE(is_ok);
    return beams;
}

/// Without its id: reading numbers beams anew.
inline bool same_beam(const gpom_beam_t &a, const gpom_beam_t &b)
{
    return a.x_m == b.x_m && a.y_m == b.y_m && a.stamp_us == b.stamp_us &&
           same_bits(a.dir_x, b.dir_x) && same_bits(a.dir_y, b.dir_y) &&
           same_bits(a.range_m, b.range_m) && same_bits(a.hit_noise, b.hit_noise) &&
           same_bits(a.free_noise, b.free_noise) && a.is_hit == b.is_hit &&
           a.is_free == b.is_free && a.returned == b.returned && a.provisional == b.provisional &&
           a.past == b.past && a.n_agreed == b.n_agreed;
}

/// True if the ids of both come in one order.
inline bool same_order(const std::vector<gpom_beam_t> &a, const std::vector<gpom_beam_t> &b)
{
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ids;
    for (std::size_t i = 0; i < a.size(); ++i) {
        ids.emplace_back(a[i].id, b[i].id);
    }
    std::sort(ids.begin(), ids.end());
    const auto is_behind = [](const auto &one, const auto &next) {
        return next.first <= one.first || next.second <= one.second;
    };
    return std::adjacent_find(ids.begin(), ids.end(), is_behind) == ids.end();
}

inline bool same_beams(const std::vector<gpom_beam_t> &a, const std::vector<gpom_beam_t> &b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_beam) && same_order(a, b);
}

inline bool same_counters(const gpom_map_t *a, const gpom_map_t *b)
{
    gpom_stats_t stats[2];
    REQUIRE(gpom_map_stats(a, &stats[0]) == GPOM_OK);
    REQUIRE(gpom_map_stats(b, &stats[1]) == GPOM_OK);
    return std::memcmp(&stats[0], &stats[1], sizeof stats[0]) == 0;
}

// ---- forging: numbers by hand and checksums by zlib --------------------------------------------

inline std::uint64_t number_at(const Bytes &bytes, std::size_t at, int n_bytes)
{
    std::uint64_t value = 0;
    for (int i = n_bytes - 1; i >= 0; --i) {
        value = value << 8 | bytes.at(at + static_cast<std::size_t>(i));
    }
    return value;
}

inline void set_number(Bytes &bytes, std::size_t at, int n_bytes, std::uint64_t value)
{
    for (int i = 0; i < n_bytes; ++i) {
        bytes.at(at + static_cast<std::size_t>(i)) = static_cast<std::uint8_t>(value >> (8 * i));
    }
}

inline std::uint32_t zlib_crc(const std::uint8_t *bytes, std::size_t n)
{
    return static_cast<std::uint32_t>(crc32(0, bytes, static_cast<unsigned>(n)));
}

/// Number of blocks up to and with the commit.
inline std::size_t n_blocks_of(const Bytes &slot)
{
    std::size_t n = 1;
    while (slot.at((n - 1) * kBlock + 6) == 0) {
        ++n;
    }
    return n;
}

/// Make all checksums of a snapshot of n_blocks fit its bytes again.
inline void mend(Bytes &slot, std::size_t n_blocks)
{
    Bytes crcs;
    for (std::size_t i = 0; i < n_blocks; ++i) {
        if (i + 1 == n_blocks) {
            set_number(slot, i * kBlock + 24, 4, zlib_crc(crcs.data(), crcs.size()));
        }
        const std::size_t at = i * kBlock + kBlock - 4;
        set_number(slot, at, 4, zlib_crc(slot.data() + i * kBlock, kBlock - 4));
        crcs.insert(crcs.end(), slot.begin() + static_cast<std::ptrdiff_t>(at),
                    slot.begin() + static_cast<std::ptrdiff_t>(at + 4));
    }
}

} // namespace reference
