/// \file snapshot_format.hpp
/// Blocks of a snapshot as bytes. Numbers are little-endian (little_endian.hpp).
///
///     bytes      field
///     0          "GPMS", format u16, kind u8, n_beams u8, sequence u64, index u32
///     20         kind 0: n_beams beams of 36 bytes; kind 1: Commit, hyperparameters, counters
///     508        CRC-32 of bytes 0 .. 507
///
/// The previous format is read, too. It differs only in the size of the hyperparameters.
///
/// Block k holds the beams of slots [13 k, 13 k + 13) of the beam store. The commit block comes
/// last. Unused bytes are 0.
#pragma once

#include "gpom/snapshot.h"
#include "src/base/little_endian.hpp"
#include "src/beams/beam.hpp"
#include "src/gp/params_record.hpp"

namespace gpom
{

enum class BlockKind : uint8_t { kBeams = 0, kCommit = 1 };

struct BlockHead {
    BlockKind kind;
    uint8_t n_beams;
    uint64_t sequence;
    uint32_t index; ///< Number of the block in the snapshot, from 0 on.
};

constexpr uint32_t kBeamBytes = 36;
constexpr uint32_t kBodyAt = 20;
constexpr uint32_t kCrcAt = GPOM_SNAPSHOT_BLOCK_BYTES - 4;
static_assert(kBodyAt + GPOM_SNAPSHOT_BLOCK_BEAMS * kBeamBytes <= kCrcAt, "a block is too small");

/// Write head and CRC of a block. The body must be in the block before.
void seal_block(uint8_t *block, const BlockHead &head);

/// Read the head. False if the block is damaged or of another format.
bool open_block(const uint8_t *block, BlockHead &head);

void put_beam(Encoder &to, const Beam &beam);

/// Read a beam of kBeamBytes. False if no map can hold such a beam.
bool take_beam(Decoder &from, Beam &beam);

/// The state of a map besides its beams. Index, Keeper and Lowres describe the fields.
struct Commit {
    uint32_t n_beams;
    uint32_t blocks_crc; ///< CRC-32 of the CRCs of all blocks before this one.
    uint32_t next_id;
    uint32_t time_number;
    uint32_t hand;
    uint32_t stamp_ms;
    uint32_t frame_epoch;
    uint16_t time_mark;
    uint16_t n_counters; ///< Counters in gpom_stats_t's order. Some may be added without a new
                         ///< format.
    int64_t stamp0_us, stamp_us;
    double origin_x_m, origin_y_m;
    float robot_x_m, robot_y_m;
};

constexpr uint32_t kCommitBytes = 72;
constexpr uint32_t kParamsAt = kBodyAt + kCommitBytes;
constexpr uint32_t kCountersAt = kParamsAt + GPOM_PARAMS_RECORD_BYTES;
constexpr uint32_t kCountersMax = (kCrcAt - kCountersAt) / 8;
constexpr uint32_t kCounters = sizeof(gpom_stats_t) / 8;
static_assert(kCounters <= kCountersMax, "a block is too small");

/// Write the commit and the counters into the body of a commit block. The caller writes the
/// hyperparameters.
void put_commit(uint8_t *block, const Commit &commit, const gpom_stats_t &stats);

/// Read the commit of a commit block. False if no map can be in such a state.
bool take_commit(const uint8_t *block, Commit &commit);

/// True if a commit block has the same hyperparameters as a record of this version.
bool has_params(const uint8_t *block, const uint8_t *record);

/// Read the counters of a commit block. Counters that the block does not have become 0.
void take_counters(const uint8_t *block, uint32_t n_counters, gpom_stats_t &stats);

} // namespace gpom
