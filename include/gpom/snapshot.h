/** \file snapshot.h
 *  Snapshots: a map is written and read block by block, so that it outlives a loss of power. The
 *  caller's callbacks store the blocks in a file or a flash memory.
 *
 *  There are two snapshot slots, written in turn. A snapshot is valid only if all its blocks are
 *  whole, and the last block, which commits it, is whole too. So after a loss of power at any byte,
 *  either the older or the newer snapshot is whole. The bytes are the same on every processor,
 *  whatever its byte order, lane width and instruction set.
 *
 *  Stored are the beams with their ids and witnesses, the counters, the clock, the frame epoch and
 *  the origin. Not stored:
 *  - The configuration. The map that reads has its own.
 *  - The KD-trees. After reading, beams are searched one by one, exactly, until gpom_map_step() or
 *    gpom_map_build() indexes them.
 *  - The low-resolution map. Its cells become unknown and dirty. */
#ifndef GPOM_SNAPSHOT_H
#define GPOM_SNAPSHOT_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Version of stored maps. The version before is read, too. Other versions are refused. */
#define GPOM_MAP_FORMAT 3u

/** Size of a block. All reads and writes are one block, at multiples of this size. */
#define GPOM_SNAPSHOT_BLOCK_BYTES 512u

/** Beams in one block; 36 bytes each. */
#define GPOM_SNAPSHOT_BLOCK_BEAMS 13u

/** Bytes of one snapshot slot for a map of `beam_max` beams: 39.4 bytes for each beam. Round up to
 *  whole flash pages. */
#define GPOM_SNAPSHOT_SLOT_BYTES(beam_max)                                                         \
    (GPOM_SNAPSHOT_BLOCK_BYTES *                                                                   \
     (1u + ((beam_max) + GPOM_SNAPSHOT_BLOCK_BEAMS - 1u) / GPOM_SNAPSHOT_BLOCK_BEAMS))

/** Storage of snapshots: two snapshot slots, 0 and 1. Offsets are multiples of
 *  GPOM_SNAPSHOT_BLOCK_BYTES inside a slot. */
typedef struct {
    void *ctx;           /**< The library passes it to the callbacks. */
    uint32_t slot_bytes; /**< Size of each slot. To write, at least
                              GPOM_SNAPSHOT_SLOT_BYTES(beam_max). */
    /** Read one block. Every status other than GPOM_OK means a damaged block (never written, or
     *  error correction failed). If a second try may succeed, the callback must make it. */
    gpom_status_t (*read)(void *ctx, uint32_t slot, uint32_t offset_bytes, uint8_t *block);
    /** Write one block. Offsets start at 0 and have no gaps. If writing starts over, they start at
     *  0 again. For a flash: erase a page when its first block comes. Blocks may reach the medium
     *  in any order until `flush`. Every status other than GPOM_OK means that the block could not
     *  be written. NULL if snapshots are only read. */
    gpom_status_t (*write)(void *ctx, uint32_t slot, uint32_t offset_bytes, const uint8_t *block);
    /** Return when everything written to the slot is safe against a loss of power (fsync). Called
     *  once, at the end. NULL: `write` itself returns only when its block is safe. */
    gpom_status_t (*flush)(void *ctx, uint32_t slot);
} gpom_snapshot_io_t;

/** The result; valid when `is_done` is 1. */
typedef struct {
    uint64_t sequence;     /**< Sequence number of the snapshot. A new one is greater than that of
                                the newest snapshot found. */
    uint32_t slot;         /**< Snapshot slot that holds it, 0 or 1. */
    uint32_t n_beams;      /**< Beams written, or beams in the map after reading. */
    uint32_t n_dropped;    /**< Reading: beams that did not fit: the oldest beams if the map is
                                smaller than the written map, and the oldest of the beams that
                                wait for confirmation if too many wait. */
    uint32_t n_restarts;   /**< Writing: how often it started over. It starts over if the map is
                                cleared, if its frame jumps, or if its origin or its stamp0_us
                                (lowres.h) moves. */
    uint8_t params_differ; /**< Reading: 1 if the snapshot was written with other hyperparameters.
                                The beams are raw measurements and stay valid. But the noise that
                                pose uncertainty added to them follows the old covariance. */
    uint8_t is_done;       /**< 1: writing or reading is finished. */
} gpom_snapshot_report_t;

/** A snapshot that is being written or read, in memory of the caller. There is nothing to
 *  destroy. */
typedef struct {
    gpom_snapshot_report_t report; /**< For the caller to read. All other fields belong to the
                                        library. */
    /** \cond internal */
    const gpom_map_t *map;
    gpom_snapshot_io_t io;
    int32_t status;
    uint64_t sequence, found_sequence[2];
    double origin_x_m, origin_y_m;
    int64_t stamp0_us;
    uint32_t i_block, blocks_crc, n_beams, id_end, stamp_ms_max, n_slots, n_forgotten, frame_epoch;
    uint32_t n_placed, n_unordered, i_entry, next_id, n_provisional, first_vacant;
    const uint32_t *heap;
    uint8_t found[2];
    uint8_t phase, is_write;
    uint8_t params[GPOM_PARAMS_RECORD_BYTES];
    uint8_t block[GPOM_SNAPSHOT_BLOCK_BYTES];
    /** \endcond */
} gpom_snapshot_t;

/** Begin to write a snapshot of the map. This call reads and writes no block. Writing never touches
 *  the newest whole snapshot.
 *
 *  snapshot  may hold any bytes. If a snapshot was being written or read in it, that work is
 *            dropped.
 *  io        is copied. Its ctx must stay valid until the work ends.
 *  Errors    GPOM_ERR_ARG (null, no map, no callback), GPOM_ERR_MEM (slot_bytes too small).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_write_begin(gpom_snapshot_t *snapshot,
                                                                const gpom_map_t *map,
                                                                const gpom_snapshot_io_t *io);

/** Go on writing; repeat until report.is_done. One call reads or writes at most `n_blocks` blocks.
 *  First the newest snapshot is found and checked. Then the other slot is written. All calls
 *  together need up to 2 + 2 slot_bytes / GPOM_SNAPSHOT_BLOCK_BYTES blocks.
 *
 *  Between calls, scans may be inserted and the map may be built. If nothing changes, the snapshot
 *  is the map as it was at the beginning. If the map changes:
 *  - Each beam in the snapshot is there once, as it was when its block was written.
 *  - A beam that is in the map all the time is in the snapshot. A beam that comes or goes meanwhile
 *    may be in it or not.
 *  - Counters and clock are those at the end.
 *  - After gpom_map_clear(), after gpom_map_jump(), and when the origin or stamp0_us moved, writing
 *    starts over by itself at the first block of the slot.
 *  - After gpom_map_forget(), begin again if the forgotten beams must not come back.
 *
 *  Errors  GPOM_ERR_ARG (not begun, or another map); GPOM_ERR_IO (`write` or `flush` failed): the
 *          older snapshot is whole; begin again.
 *  Cost: for each block 13 beams, 1016 steps of the CRC-32, and the callback. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_write_step(gpom_snapshot_t *snapshot,
                                                               const gpom_map_t *map,
                                                               uint32_t n_blocks);

/** Begin to read the newest whole snapshot into a map. This call reads no block.
 *
 *  snapshot  as in gpom_snapshot_write_begin().
 *  io        as in gpom_snapshot_write_begin(), but only `read` is needed.
 *  Errors    GPOM_ERR_ARG (null, no map, no `read`), GPOM_ERR_MEM (slot_bytes less than one block).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_read_begin(gpom_snapshot_t *snapshot,
                                                               gpom_map_t *map,
                                                               const gpom_snapshot_io_t *io);

/** Go on reading; repeat until report.is_done. One call reads at most `n_blocks` blocks, or does as
 *  much work on blocks that were read. Any bytes are safe. All calls together need up to 2 + 4
 *  slot_bytes / GPOM_SNAPSHOT_BLOCK_BYTES reads. Each time that a snapshot was read whole, further
 *  steps follow: steps of 13 beams each, and steps of 128 entries each for beam_max / 8 entries.
 *
 *  The map does not change until a snapshot has proved whole. Then the map becomes empty, and after
 *  the last call it holds the beams of the snapshot. Its answers are those of the written map, bit
 *  for bit. What else changes:
 *  - Origin, counters and clock are replaced. The frame epoch becomes the greater of the two maps'
 *    epochs.
 *  - Beams get new ids from 0 on, in the order of the old ids.
 *  - Beams that wait for confirmation go on waiting.
 *  - If the snapshot has more than beam_max beams, the youngest are kept. Of the beams that wait
 *    for confirmation, the youngest beam_max / 16 + 8 are kept.
 *
 *  Every map that is read from the same bytes goes on in the same way.
 *
 *  Errors  GPOM_ERR_ARG (not begun, another map, or a call changed the map after loading of its
 *          beams began), GPOM_ERR_FORMAT (neither slot holds a whole snapshot of a known version).
 *          After GPOM_ERR_FORMAT the map is as it was, with one exception: it is empty if bytes
 *          changed between two reads, or if a forged snapshot repeats an id.
 *  Cost: for each block as in writing, and 26 log2(beam_max) comparisons; last: all cells. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_read_step(gpom_snapshot_t *snapshot,
                                                              gpom_map_t *map, uint32_t n_blocks);

#ifdef __cplusplus
}
#endif
#endif
