#include "src/snapshot/snapshot_format.hpp"

#include "gpom/crc32.h"
#include "src/base/assert.hpp"
#include "src/map/map.hpp"
#include "src/map/store.hpp"
#include "src/snapshot/id_heap.hpp"

using gpom::Beam;
using gpom::BlockHead;
using gpom::BlockKind;
using gpom::Commit;
using gpom::IdHeap;
using gpom::Index;
using gpom::Keeper;

namespace
{

using State = gpom_snapshot_t;

constexpr uint32_t kBlockBytes = GPOM_SNAPSHOT_BLOCK_BYTES;
constexpr uint32_t kBlockBeams = GPOM_SNAPSHOT_BLOCK_BEAMS;

/// Entries of Index::recent that are reset in one step of work.
constexpr uint32_t kEntries = 128;

/// The phase of the work. Writing goes through latest, check, write. Reading goes through latest,
/// check, load, reset, order.
enum Phase : uint8_t { kIdle, kLatest, kCheck, kWrite, kLoad, kReset, kOrder, kDone, kFailed };

/// The kind of block that was read. kNothing: no valid block of the snapshot.
enum class Found { kBeams, kCommit, kNothing };

bool is_active(const State &s) { return s.phase > kIdle && s.phase < kDone; }

void fail(State &s, gpom_status_t status)
{
    s.phase = kFailed;
    s.status = status;
}

void finish(State &s)
{
    s.phase = kDone;
    s.report.sequence = s.sequence;
    s.report.is_done = 1;
}

// ---- the blocks of a snapshot slot -------------------------------------------------------------

/// Start a phase at the first block of slot s.report.slot.
void rewind(State &s, Phase phase)
{
    s.phase = phase;
    s.i_block = 0;
    s.blocks_crc = 0;
    s.n_beams = 0;
    s.id_end = 0;
    s.stamp_ms_max = 0;
}

bool read_block(State &s, uint32_t slot, BlockHead &head)
{
    const gpom_status_t status = s.io.read(s.io.ctx, slot, s.i_block * kBlockBytes, s.block);
    return status == GPOM_OK && gpom::open_block(s.block, head) && head.index == s.i_block;
}

/// Finish with the block in s.block, and go on to the next one.
void pass_block(State &s)
{
    s.blocks_crc = gpom_crc32_continue(s.blocks_crc, s.block + gpom::kCrcAt, 4);
    ++s.i_block;
}

/// True if s.block holds a valid commit that fits the blocks before it.
bool commits(const State &s, Commit &commit)
{
    if (!gpom::take_commit(s.block, commit)) {
        return false;
    }
    return commit.n_beams == s.n_beams && commit.blocks_crc == s.blocks_crc &&
           s.id_end <= commit.next_id &&
           commit.stamp0_us <= INT64_MAX - int64_t{1000} * s.stamp_ms_max;
}

/// Read the next block of the snapshot and call visit(beam) for its beams.
template <class Visit> Found take_block(State &s, const Visit &visit)
{
    BlockHead head;
    const bool is_beyond = s.i_block >= s.io.slot_bytes / kBlockBytes;
    if (is_beyond || !read_block(s, s.report.slot, head) || head.sequence != s.sequence) {
        return Found::kNothing;
    }
    if (head.kind == BlockKind::kCommit) {
        Commit commit;
        return commits(s, commit) ? Found::kCommit : Found::kNothing;
    }
    gpom::Decoder from = {s.block + gpom::kBodyAt};
    for (uint32_t i = 0; i < head.n_beams; ++i) {
        Beam beam;
        if (!gpom::take_beam(from, beam)) {
            return Found::kNothing;
        }
        ++s.n_beams;
        s.id_end = beam.id >= s.id_end ? beam.id + 1 : s.id_end;
        s.stamp_ms_max = beam.stamp_ms > s.stamp_ms_max ? beam.stamp_ms : s.stamp_ms_max;
        visit(beam);
    }
    pass_block(s);
    return Found::kBeams;
}

// ---- choice of the snapshot slot ---------------------------------------------------------------

/// True if sequence number a is newer than b. Sequence numbers may wrap around.
bool is_newer(uint64_t a, uint64_t b) { return a - b - 1 < UINT64_MAX / 2; }

/// Choose the newer of the snapshot slots that may hold a snapshot, and start to check it. False if
/// no slot is left.
bool choose_slot(State &s)
{
    if (s.found[0] == 0 && s.found[1] == 0) {
        return false;
    }
    const bool both = s.found[0] != 0 && s.found[1] != 0;
    const bool second = both ? is_newer(s.found_sequence[1], s.found_sequence[0]) : s.found[1] != 0;
    s.report.slot = second ? 1 : 0;
    s.sequence = s.found_sequence[s.report.slot];
    rewind(s, kCheck);
    return true;
}

/// Start to write the map's beams into the chosen snapshot slot.
void start_writing(State &s)
{
    s.n_slots = s.map->index.n_slots;
    s.n_forgotten = s.map->index.n_forgotten;
    s.frame_epoch = s.map->lowres.frame_epoch;
    s.stamp0_us = s.map->lowres.stamp0_us;
    s.origin_x_m = s.map->config.origin_x_m;
    s.origin_y_m = s.map->config.origin_y_m;
    rewind(s, kWrite);
}

/// Start to write into snapshot slot `slot`. The new sequence number is newer than all numbers that
/// were found.
void write_to(State &s, uint32_t slot)
{
    const bool second = is_newer(s.found_sequence[1], s.found_sequence[0]);
    s.sequence = s.found_sequence[second ? 1 : 0] + 1;
    s.report.slot = slot;
    start_writing(s);
}

/// The chosen snapshot slot holds no whole snapshot. Writing starts in this slot. Reading goes on
/// with the other slot, or fails if there is none.
void give_up_slot(State &s)
{
    s.found[s.report.slot] = 0;
    if (s.is_write != 0) {
        write_to(s, s.report.slot);
    } else if (!choose_slot(s)) {
        fail(s, GPOM_ERR_FORMAT);
    }
}

/// Read the first block of the next snapshot slot. After the second one, choose a slot.
void look_for_latest(State &s)
{
    BlockHead head;
    const uint32_t slot = s.report.slot;
    if (read_block(s, slot, head)) {
        s.found[slot] = 1;
        s.found_sequence[slot] = head.sequence;
    }
    s.report.slot = slot + 1;
    if (s.report.slot < 2) {
        return;
    }
    for (uint32_t i = 0; i < 2; ++i) { // an empty slot must not count as newer than the other
        if (s.found[i] == 0 && s.found[1 - i] != 0) {
            s.found_sequence[i] = s.found_sequence[1 - i];
        }
    }
    if (!choose_slot(s)) {
        s.report.slot = 0;
        give_up_slot(s);
    }
}

/// Check the next block. True if it completes the snapshot in this slot, which is whole then.
bool check_one(State &s)
{
    const Found found = take_block(s, [](const Beam &) {});
    if (found == Found::kNothing) {
        give_up_slot(s);
    }
    return found == Found::kCommit;
}

// ---- writing -----------------------------------------------------------------------------------

/// True if the map changed so that the blocks written before no longer fit the blocks to come.
bool has_jumped(const State &s)
{
    const gpom_map_t &map = *s.map;
    return map.index.n_forgotten != s.n_forgotten || map.lowres.frame_epoch != s.frame_epoch ||
           map.config.origin_x_m != s.origin_x_m || map.config.origin_y_m != s.origin_y_m ||
           map.lowres.stamp0_us != s.stamp0_us;
}

/// Fill s.block with the beams of the next kBlockBeams slots of the beam store.
void fill_beams(State &s, BlockHead &head)
{
    const Index &index = s.map->index;
    gpom::Encoder to = {s.block + gpom::kBodyAt};
    const uint32_t first = s.i_block * kBlockBeams;
    for (uint32_t slot = first; slot < first + kBlockBeams && slot < s.n_slots; ++slot) {
        const Beam &beam = index.beams[slot];
        if (has_hit(beam) || beam.has_free != 0) {
            gpom::put_beam(to, beam);
            ++head.n_beams;
        }
    }
    s.n_beams += head.n_beams;
}

void fill_commit(State &s)
{
    const gpom_map_t &map = *s.map;
    const Keeper &keeper = map.keeper;
    Commit commit = {};
    commit.n_beams = s.n_beams;
    commit.blocks_crc = s.blocks_crc;
    commit.next_id = map.index.next_id;
    commit.time_number = keeper.time_number;
    commit.time_mark = keeper.time_mark;
    commit.hand = keeper.hand;
    commit.stamp_ms = keeper.stamp_ms;
    commit.n_counters = gpom::kCounters;
    commit.stamp0_us = map.lowres.stamp0_us;
    commit.stamp_us = keeper.stamp_us;
    commit.origin_x_m = map.config.origin_x_m;
    commit.origin_y_m = map.config.origin_y_m;
    commit.frame_epoch = map.lowres.frame_epoch;
    commit.robot_x_m = keeper.robot.x_m;
    commit.robot_y_m = keeper.robot.y_m;
    gpom::put_commit(s.block, commit, map.stats);
    memcpy(s.block + gpom::kParamsAt, s.params, sizeof s.params);
}

void write_one(State &s)
{
    if (has_jumped(s)) {
        ++s.report.n_restarts;
        ++s.sequence;
        start_writing(s);
    }
    memset(s.block, 0, kBlockBytes);
    BlockHead head = {BlockKind::kBeams, 0, s.sequence, s.i_block};
    const bool is_last = s.i_block * kBlockBeams >= s.n_slots;
    if (is_last) {
        head.kind = BlockKind::kCommit;
        fill_commit(s);
    } else {
        fill_beams(s, head);
    }
    gpom::seal_block(s.block, head);
    if (s.io.write(s.io.ctx, s.report.slot, s.i_block * kBlockBytes, s.block) != GPOM_OK) {
        fail(s, GPOM_ERR_IO);
        return;
    }
    pass_block(s);
    if (is_last) {
        if (s.io.flush != nullptr && s.io.flush(s.io.ctx, s.report.slot) != GPOM_OK) {
            fail(s, GPOM_ERR_IO);
            return;
        }
        s.report.n_beams = s.n_beams;
        finish(s);
    }
}

/// Process one block in the present phase of writing.
void advance_writing(State &s)
{
    if (s.phase == kLatest) {
        look_for_latest(s);
    } else if (s.phase == kWrite) {
        write_one(s);
    } else if (check_one(s)) {
        write_to(s, 1 - s.report.slot);
    }
}

// ---- reading -----------------------------------------------------------------------------------

/// A heap of the beams placed so far, with the oldest on top. It uses the memory in which the next
/// tree will be built.
IdHeap heap_of(const State &s, Index &index)
{
    return {index.spare.slots, s.n_unordered, index.beams};
}

/// True if the caller inserted no beam and built no tree since loading began.
bool is_untouched(const State &s, const Index &index)
{
    return index.n_forgotten == s.n_forgotten && index.next_id == s.next_id &&
           index.spare.slots == s.heap;
}

/// A whole snapshot was found. Empty the map and its raster, and read the snapshot again. Queries
/// do not see the beams that are put into the store, because its slots do not count as used yet.
void start_loading(State &s, gpom_map_t &map)
{
    Index &index = map.index;
    gpom::drop_all(map);
    gpom::lowres_clear(map.lowres);
    s.n_forgotten = index.n_forgotten;
    s.next_id = index.next_id;
    s.heap = index.spare.slots;
    s.n_placed = 0;
    s.n_unordered = 0;
    s.report.n_dropped = 0;
    rewind(s, kLoad);
}

/// Put a beam into the next slot of the store. If the store is full, the beam replaces the oldest
/// beam, or is dropped if it is older itself.
void place(State &s, Index &index, const Beam &beam)
{
    IdHeap heap = heap_of(s, index);
    if (s.n_placed < index.beam_max) {
        index.beams[s.n_placed] = beam;
        heap.push(s.n_placed);
        s.n_unordered = heap.n;
        ++s.n_placed;
        return;
    }
    ++s.report.n_dropped;
    if (heap.id(0) < beam.id) {
        index.beams[heap.slots[0]] = beam;
        heap.sink();
    }
}

/// Reset the next kEntries entries of Index::recent.
void reset_some_recent(State &s, Index &index)
{
    const uint32_t end =
        index.n_recent_max - s.i_entry > kEntries ? s.i_entry + kEntries : index.n_recent_max;
    for (; s.i_entry < end; ++s.i_entry) {
        gpom::reset_recent(index, s.i_entry);
    }
    if (s.i_entry == index.n_recent_max) {
        s.phase = kOrder;
        s.id_end = 0;
        s.n_provisional = 0;
        s.first_vacant = gpom::kNoSlot;
    }
}

/// Drop a provisional beam because the ring of provisional beams is full. Its slot becomes vacant.
void drop(State &s, Index &index, uint32_t slot)
{
    Beam &beam = index.beams[slot];
    beam.hit = gpom::kNoHit;
    beam.has_free = 0;
    gpom::next_vacant(beam) = s.first_vacant;
    s.first_vacant = slot;
    ++s.report.n_dropped;
}

/// Enter a beam into the list of recent beams and, if it is provisional, into the ring of
/// provisional beams. Beams come in order of their ids. If the ring is full, the oldest beam in it
/// is dropped.
void list(State &s, gpom_map_t &map, uint32_t slot)
{
    Index &index = map.index;
    const Beam &beam = index.beams[slot];
    gpom::remember(index, slot);
    if (is_provisional(beam)) {
        gpom::Waiting &entry = map.keeper.provisional[s.n_provisional % map.keeper.provisional_max];
        if (s.n_provisional >= map.keeper.provisional_max) {
            drop(s, index, entry.slot);
        }
        entry = {slot, beam.id};
        ++s.n_provisional;
    }
}

void publish_beams(const State &s, Index &index)
{
    index.next_id = s.n_placed;
    index.n_slots = s.n_placed;
    index.n_beams = s.n_beams - s.report.n_dropped;
    index.first_vacant = s.first_vacant;
}

/// Make the loaded map visible: the beams in the store, and the state from the commit in s.block.
void publish(State &s, gpom_map_t &map)
{
    Commit commit;
    const bool is_whole = gpom::take_commit(s.block, commit);
    GPOM_ASSERT(is_whole);
    (void)is_whole;
    publish_beams(s, map.index);
    gpom::take_counters(s.block, commit.n_counters, map.stats);
    map.config.origin_x_m = commit.origin_x_m;
    map.config.origin_y_m = commit.origin_y_m;
    Keeper &keeper = map.keeper;
    keeper.scan_first_id = map.index.next_id;
    keeper.time_number = commit.time_number;
    keeper.time_mark = commit.time_mark;
    keeper.n_provisional = s.n_provisional;
    keeper.hand = commit.hand < map.index.n_slots ? commit.hand : 0;
    keeper.robot = {commit.robot_x_m, commit.robot_y_m};
    keeper.stamp_us = commit.stamp_us;
    keeper.stamp_ms = commit.stamp_ms;
    const bool has_scans = map.stats.scans_inserted > 0;
    gpom::lowres_restore(
        map.lowres, {commit.origin_x_m, commit.origin_y_m, commit.stamp0_us, commit.frame_epoch},
        has_scans || map.index.n_beams > 0); // beams may come from another map
    if (has_scans) {
        gpom::lowres_follow(map.lowres, keeper.robot, keeper.stamp_us);
    }
    s.report.params_differ = gpom::has_params(s.block, s.params) ? 0 : 1;
    s.report.n_beams = map.index.n_beams;
    finish(s);
}

/// Take the next kBlockBeams beams in order of their ids, and give them new ids from 0 on. So ids
/// do not run out, however often a map is written and read. If an id comes twice, the snapshot is
/// not valid.
void order_some(State &s, gpom_map_t &map)
{
    IdHeap heap = heap_of(s, map.index);
    for (uint32_t i = 0; i < kBlockBeams && heap.n > 0; ++i) {
        const uint32_t slot = heap.pop();
        uint32_t &id = map.index.beams[slot].id;
        if (id < s.id_end) {
            give_up_slot(s);
            return;
        }
        s.id_end = id + 1;
        id = s.n_placed - heap.n - 1;
        list(s, map, slot);
    }
    s.n_unordered = heap.n;
    if (heap.n == 0) {
        publish(s, map);
    }
}

// ---- steps -------------------------------------------------------------------------------------

void load_one(State &s, gpom_map_t &map)
{
    const Found found = take_block(s, [&](const Beam &beam) { place(s, map.index, beam); });
    if (found == Found::kNothing) {
        give_up_slot(s);
    } else if (found == Found::kCommit) {
        s.phase = kReset;
        s.i_entry = 0;
    }
}

void read_one(State &s, gpom_map_t &map)
{
    const bool is_filling = s.phase == kLoad || s.phase == kReset || s.phase == kOrder;
    if (is_filling && !is_untouched(s, map.index)) {
        fail(s, GPOM_ERR_ARG);
        return;
    }
    switch (s.phase) {
    case kLatest:
        look_for_latest(s);
        break;
    case kCheck:
        if (check_one(s)) {
            start_loading(s, map);
        }
        break;
    case kLoad:
        load_one(s, map);
        break;
    case kReset:
        reset_some_recent(s, map.index);
        break;
    default:
        order_some(s, map);
        break;
    }
}

gpom_status_t begin(State *snapshot, const gpom_map_t *map, const gpom_snapshot_io_t *io,
                    bool is_write)
{
    if (snapshot == nullptr) {
        return GPOM_ERR_ARG;
    }
    snapshot->phase = kIdle;
    if (!gpom::is_map(map) || io == nullptr || io->read == nullptr ||
        (is_write && io->write == nullptr)) {
        return GPOM_ERR_ARG;
    }
    const uint32_t need_bytes =
        is_write ? GPOM_SNAPSHOT_SLOT_BYTES(map->config.beam_max) : kBlockBytes;
    if (io->slot_bytes < need_bytes) {
        return GPOM_ERR_MEM;
    }
    *snapshot = gpom_snapshot_t{};
    const gpom_status_t status = gpom_params_save(&map->config.params, snapshot->params);
    if (status != GPOM_OK) {
        return status;
    }
    snapshot->map = map;
    snapshot->io = *io;
    snapshot->is_write = is_write ? 1 : 0;
    snapshot->phase = kLatest;
    return GPOM_OK;
}

bool is_under_way(const State *snapshot, const gpom_map_t *map, bool is_write)
{
    return snapshot != nullptr && gpom::is_map(map) && snapshot->phase > kIdle &&
           snapshot->phase <= kFailed && snapshot->map == map &&
           (snapshot->is_write != 0) == is_write;
}

} // namespace

gpom_status_t gpom_snapshot_write_begin(gpom_snapshot_t *snapshot, const gpom_map_t *map,
                                        const gpom_snapshot_io_t *io)
{
    return begin(snapshot, map, io, true);
}

gpom_status_t gpom_snapshot_write_step(gpom_snapshot_t *snapshot, const gpom_map_t *map,
                                       uint32_t n_blocks)
{
    if (!is_under_way(snapshot, map, true)) {
        return GPOM_ERR_ARG;
    }
    for (uint32_t i = 0; i < n_blocks && is_active(*snapshot); ++i) {
        advance_writing(*snapshot);
    }
    return static_cast<gpom_status_t>(snapshot->status);
}

gpom_status_t gpom_snapshot_read_begin(gpom_snapshot_t *snapshot, gpom_map_t *map,
                                       const gpom_snapshot_io_t *io)
{
    return begin(snapshot, map, io, false);
}

gpom_status_t gpom_snapshot_read_step(gpom_snapshot_t *snapshot, gpom_map_t *map, uint32_t n_blocks)
{
    if (!is_under_way(snapshot, map, false)) {
        return GPOM_ERR_ARG;
    }
    for (uint32_t i = 0; i < n_blocks && is_active(*snapshot); ++i) {
        read_one(*snapshot, *map);
    }
    return static_cast<gpom_status_t>(snapshot->status);
}
