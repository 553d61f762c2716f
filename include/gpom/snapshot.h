/** \file snapshot.h
 *  A map that outlives a loss of power: written and read block by block through the caller's
 *  callbacks, behind which is a file or a flash memory.
 *
 *  Two slots are written in turn. A snapshot counts only if each of its blocks and the last one,
 *  which commits it, are whole; so that a cut at any byte leaves the older or the newer, whole.
 *  Bytes are the same on every processor, whatever its byte order, lane width and instruction set.
 *
 *  Stored are the beams with their ids and witnesses, the counters, the clock, the frame epoch and
 *  the origin. Not stored are the configuration, which the map that reads has; KD-trees: after
 *  reading, all beams are searched one by one, exactly, until gpom_map_step() or gpom_map_build()
 *  indexes them; and the low-resolution map, whose cells become unknown and dirty. */
#ifndef GPOM_SNAPSHOT_H
#define GPOM_SNAPSHOT_H

#include "gpom/map.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Version of stored maps. The one before is read, too; others are refused. */
#define GPOM_MAP_FORMAT 3u

/** All that is written and read comes in blocks of this size, at multiples of it. */
#define GPOM_SNAPSHOT_BLOCK_BYTES 512u

/** Beams in one block, 36 bytes each. */
#define GPOM_SNAPSHOT_BLOCK_BEAMS 13u

/** Bytes of one slot for a map of `beam_max` beams, 39.4 a beam: round up to whole flash pages. */
#define GPOM_SNAPSHOT_SLOT_BYTES(beam_max)                                                         \
    (GPOM_SNAPSHOT_BLOCK_BYTES *                                                                   \
     (1u + ((beam_max) + GPOM_SNAPSHOT_BLOCK_BEAMS - 1u) / GPOM_SNAPSHOT_BLOCK_BEAMS))

/** Where snapshots are kept: two slots, 0 and 1. Offsets are multiples of
 *  GPOM_SNAPSHOT_BLOCK_BYTES inside a slot. */
typedef struct {
    void *ctx;           /**< Handed to the callbacks. */
    uint32_t slot_bytes; /**< Size of each slot; at least GPOM_SNAPSHOT_SLOT_BYTES(beam_max) to
                              write. */
    /** Read one block. Anything but GPOM_OK counts as a damaged block (never written, failed error
     *  correction): try again yourself if it may pass. */
    gpom_status_t (*read)(void *ctx, uint32_t slot, uint32_t offset_bytes, uint8_t *block);
    /** Write one block. Offsets run from 0 on without gaps, and again from 0 when it starts over; a
     *  flash erases its page when the first block of it comes. Blocks may reach the medium in any
     *  order until `flush`. Not GPOM_OK: could not. NULL if only read. */
    gpom_status_t (*write)(void *ctx, uint32_t slot, uint32_t offset_bytes, const uint8_t *block);
    /** Return when all that was written to the slot stays without power (fsync); called once, at
     *  the end. NULL: `write` returns only then. */
    gpom_status_t (*flush)(void *ctx, uint32_t slot);
} gpom_snapshot_io_t;

/** What came of it; valid once `is_done`. */
typedef struct {
    uint64_t sequence;     /**< Number of the snapshot: greater than that of the newest found. */
    uint32_t slot;         /**< 0 or 1: where it is. */
    uint32_t n_beams;      /**< Beams written, or in the map after reading. */
    uint32_t n_dropped;    /**< Reading: beams without a place: the oldest where the map is smaller,
                                and of those that wait for confirmation. */
    uint32_t n_restarts;   /**< Writing: started over because the map was cleared, its frame
                                jumped, or its origin or its stamp0_us (lowres.h) moved. */
    uint8_t params_differ; /**< Reading: 1: written with other hyperparameters. The beams are raw
                                measurements and hold all the same; but how much uncertainty of a
                                pose raised their noise follows the old covariance. */
    uint8_t is_done;       /**< 1: finished. */
} gpom_snapshot_report_t;

/** One snapshot being written or read, in the caller's memory; nothing to destroy. */
typedef struct {
    gpom_snapshot_report_t report; /**< To be read. The rest is the library's. */
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

/** Begin to write a snapshot of the map; nothing is read or written yet. The newest whole snapshot
 *  will not be touched.
 *
 *  snapshot  any bytes; what was under way in it is dropped.
 *  io        copied; its ctx outlives the writing.
 *  Errors    GPOM_ERR_ARG (null, no map, no callback), GPOM_ERR_MEM (slot_bytes too small).
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_write_begin(gpom_snapshot_t *snapshot,
                                                                const gpom_map_t *map,
                                                                const gpom_snapshot_io_t *io);

/** Go on writing until report.is_done: at most `n_blocks` blocks are read or written. First the
 *  newest snapshot is found and checked, then the other slot is written; in all up to
 *  2 + 2 slot_bytes / GPOM_SNAPSHOT_BLOCK_BYTES blocks.
 *
 *  Scans may be inserted and the map may be built between the steps. If nothing changed, the
 *  snapshot is the map as it was at the beginning. Otherwise each beam is as it was when its block
 *  was written, once, and counters and clock are those of the end: one that was in the map all the
 *  time is in the snapshot, one that came or went meanwhile may be or not. After gpom_map_clear(),
 *  gpom_map_jump() and when the origin moved, writing starts over by itself, at the slot's first
 *  block; after gpom_map_forget() begin again if what was forgotten must not come back.
 *
 *  Errors  GPOM_ERR_ARG (not begun, or another map); GPOM_ERR_IO (`write` or `flush` failed): the
 *          older snapshot is whole; begin again.
 *  Cost: for each block 13 beams, 1016 steps of the CRC-32, and the callback. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_write_step(gpom_snapshot_t *snapshot,
                                                               const gpom_map_t *map,
                                                               uint32_t n_blocks);

/** Begin to read the newest whole snapshot into a map; nothing is read yet. As in
 *  gpom_snapshot_write_begin(), except that only `read` is needed, and any slot_bytes of a block or
 *  more.
 *
 *  Cost: O(1). */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_read_begin(gpom_snapshot_t *snapshot,
                                                               gpom_map_t *map,
                                                               const gpom_snapshot_io_t *io);

/** Go on reading until report.is_done: at most `n_blocks` blocks are read, or as much work done on
 *  what was read. Any bytes are safe. In all up to 2 + 4 slot_bytes / GPOM_SNAPSHOT_BLOCK_BYTES
 *  reads; for each time that a snapshot was read whole, steps of 13 beams and of 128 entries out of
 *  beam_max / 8.
 *
 *  The map stays as it is until a snapshot has proved whole; then it is empty, and from the last
 *  step on it holds the snapshot's beams. It answers as the one that was written, bit for bit.
 *  Origin, counters and clock are replaced; the epoch is the greater of both maps'. Beams get new
 *  ids from 0 on, in the order of the old. Those that wait for confirmation go on waiting. Of more
 *  than beam_max beams the youngest are kept; of those that wait, the youngest
 *  beam_max / 16 + 8. A map read from the same bytes
 *  goes on in the same way each time.
 *
 *  Errors  GPOM_ERR_ARG (not begun, another map, or a call changed it since its beams are being
 *          read), GPOM_ERR_FORMAT: neither slot holds a whole snapshot of known format. The map is
 *          as it was; empty if bytes changed between two reads or a forged snapshot repeats an id.
 *  Cost: for each block as writing, and 26 log2(beam_max) comparisons; last: all cells. */
GPOM_NODISCARD GPOM_API gpom_status_t gpom_snapshot_read_step(gpom_snapshot_t *snapshot,
                                                              gpom_map_t *map, uint32_t n_blocks);

#ifdef __cplusplus
}
#endif
#endif
