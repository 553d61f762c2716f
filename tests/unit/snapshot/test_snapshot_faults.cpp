// Snapshots under faults: power that fails, bits that flip, blocks that are lost, bytes that lie.
#include "tests/common/lowres_fixture.hpp"
#include "tests/common/snapshot_medium.hpp"

#include <set>

using namespace reference;

namespace
{

gpom_config_t keeping_config(std::uint32_t beam_max)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), beam_max);
    config.keep_m = 0.2f;
    config.clear_scans = 2;
    return config;
}

/// Scans of a drive over a wide yard, from number `first` on, until the map holds n_beams.
int fill(gpom_map_t *map, std::uint64_t stream, int first, std::uint32_t n_beams)
{
    Random random(stream);
    int i = first;
    for (; gpom_map_beam_count(map) < n_beams; ++i) {
        TestScan scan = yard_scan(random, 0, {0.0, 0.0});
        scan.pose.x_m = random.uniform(-50.0, 50.0);
        scan.pose.y_m = random.uniform(-50.0, 50.0);
        scan.stamp_us = 100000 * i;
        const std::uint32_t n_room = n_beams - gpom_map_beam_count(map);
        scan.ranges_m.resize(std::min<std::size_t>(scan.ranges_m.size(), n_room));
        REQUIRE(scan.insert_into(map) == GPOM_OK);
    }
    return i;
}

/// The states of a map at successive snapshots.
struct Version {
    std::vector<gpom_beam_t> beams;
    std::uint64_t scans;
};

Version version_of(const gpom_map_t *map)
{
    gpom_stats_t stats;
    REQUIRE(gpom_map_stats(map, &stats) == GPOM_OK);
    return {beams_of(map), stats.scans_inserted};
}

bool same_version(const Version &a, const Version &b)
{
    return a.scans == b.scans && same_beams(a.beams, b.beams);
}

/// Read into a map that is made in the same memory each time.
class Reader {
public:
    explicit Reader(const gpom_config_t &config) : config_(config), memory_(gpom_map_bytes(&config))
    {
    }

    Outcome read(Medium &medium)
    {
        REQUIRE(gpom_map_init(&map_, &config_, memory_.mem(), memory_.bytes()) == GPOM_OK);
        return read_snapshot(map_, medium);
    }
    gpom_map_t *map() { return map_; }

private:
    gpom_config_t config_;
    GuardedMemory memory_;
    gpom_map_t *map_ = nullptr;
};

/// The power fails after n bytes of writing the map: what is there afterwards?
struct Cut {
    const gpom_map_t *map;
    const Medium &before;
    std::uint64_t n_bytes;
    bool tears_erase;
};

Medium after(const Cut &cut)
{
    Medium medium = cut.before;
    medium.n_bytes_left = cut.n_bytes;
    medium.tears_erase = cut.tears_erase;
    medium.n_writes = 0;
    REQUIRE(write_snapshot(cut.map, medium).status == GPOM_OK);
    return medium;
}

/// True if reading gives the older version, or the newer one once all bytes are written.
bool leaves_one_whole(Medium &medium, Reader &reader, const Version *older, const Version &newer,
                      bool is_complete)
{
    const Outcome read = reader.read(medium);
    if (older == nullptr && !is_complete) {
        return read.status == GPOM_ERR_FORMAT && gpom_map_beam_count(reader.map()) == 0;
    }
    return read.status == GPOM_OK &&
           same_version(version_of(reader.map()), is_complete ? newer : *older);
}

} // namespace

// The power may fail after any byte of the first, second and third snapshot: the older one is read
// until the last byte of the newer is written, whatever the cut leaves of its block.
TEST_CASE("a cut at any byte leaves the older or the newer map, whole")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(64));
    Medium medium(64);
    Reader reader(keeping_config(64));
    Version older;
    int i_scan = 0;
    for (int i = 0; i < 3; ++i) {
        i_scan = fill(map.get(), 400 + static_cast<std::uint64_t>(i), i_scan,
                      44 + 10 * static_cast<std::uint32_t>(i));
        const Version newer = version_of(map.get());
        Medium whole = medium;
        whole.n_writes = 0;
        REQUIRE(write_snapshot(map.get(), whole).status == GPOM_OK);
        const std::uint64_t n_bytes = kBlock * static_cast<std::uint64_t>(whole.n_writes);
        for (std::uint64_t n = 0; n <= n_bytes; ++n) {
            for (const bool tears_erase : {false, true}) {
                CAPTURE(n);
                Medium cut = after({map.get(), medium, n, tears_erase});
                const bool is_complete = // also if what an erase leaves is what was to be written
                    cut.slots[0] == whole.slots[0] && cut.slots[1] == whole.slots[1];
                REQUIRE((is_complete || n < n_bytes));
                REQUIRE(
                    leaves_one_whole(cut, reader, i == 0 ? nullptr : &older, newer, is_complete));
            }
        }
        older = newer;
        medium = whole;
    }
    CHECK(older.beams.size() == 64);
}

// After a cut the next snapshot leaves the whole one alone: cut again anywhere, it is still there.
TEST_CASE("cuts in a row never cost the snapshot that was whole")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(64));
    Medium medium(64);
    Reader reader(keeping_config(64));
    int i_scan = fill(map.get(), 410, 0, 30);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    const Version older = version_of(map.get());
    Random random(411);
    for (int i = 0; i < 500; ++i) {
        fill(map.get(), 412 + static_cast<std::uint64_t>(i), i_scan, 30 + random.below(35));
        const std::uint32_t n_bytes = random.below(4 * kBlock); // its commit is the sixth block
        medium = after({map.get(), medium, n_bytes, random.below(2) == 0});
        medium.n_bytes_left = UINT64_MAX;
        REQUIRE(leaves_one_whole(medium, reader, &older, older, false));
    }
}

// The same at 2000 random bytes (100 under sanitizers) of a snapshot of 16,384 beams.
TEST_CASE("a cut at random bytes of a large map leaves one map whole" *
          doctest::test_suite("campaign"))
{
    GPOM_TELL_SEED();
    constexpr std::uint32_t kBeams = 16384;
    constexpr int kCuts = GPOM_ASSERTS != 0 ? 100 : 2000;
    gpom_config_t config = keeping_config(kBeams);
    config.keep_m = 0.0f; // every beam is kept: quick to fill
    config.clear_scans = 0;
    TestMap map(config);
    Medium before(kBeams);
    const int i_scan = fill(map.get(), 420, 0, kBeams - 50);
    REQUIRE(write_snapshot(map.get(), before).status == GPOM_OK);
    const Version older = version_of(map.get());
    fill(map.get(), 421, i_scan, kBeams);
    const Version newer = version_of(map.get());
    Medium whole = before;
    whole.n_writes = 0;
    REQUIRE(write_snapshot(map.get(), whole).status == GPOM_OK);
    const std::uint64_t n_bytes = kBlock * static_cast<std::uint64_t>(whole.n_writes);
    Reader reader(config);
    REQUIRE(leaves_one_whole(whole, reader, nullptr, newer, true));
    Random random(422);
    Medium cut = before;
    for (int i = 0; i < kCuts; ++i) { // slot 1 gets the first bytes of the newer
        const std::uint32_t n = random.below(static_cast<std::uint32_t>(n_bytes));
        CAPTURE(n);
        std::copy_n(whole.slots[1].begin(), n, cut.slots[1].begin());
        std::copy(before.slots[1].begin() + n, before.slots[1].end(), cut.slots[1].begin() + n);
        REQUIRE(leaves_one_whole(cut, reader, &older, newer, false));
    }
}

// Until the flush at the end blocks may arrive in any order: any one that is missing when the power
// fails leaves the older map.
TEST_CASE("a block that never arrives leaves the older map")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(64));
    Medium medium(64);
    Reader reader(keeping_config(64));
    int i_scan = 0;
    for (int i = 0; i < 3; ++i) { // both slots hold a snapshot of the same number of blocks
        i_scan = fill(map.get(), 430 + static_cast<std::uint64_t>(i), i_scan,
                      60 + 2 * static_cast<std::uint32_t>(i));
        REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    }
    const Version older = version_of(map.get());
    TestScan scan;
    scan.ranges_m = {3.0f, 4.0f};
    scan.stamp_us = 77000000;
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    for (std::int64_t lost = 0; lost < 6; ++lost) {
        CAPTURE(lost);
        Medium cut = medium;
        cut.n_writes = 0;
        cut.lost_block = lost;
        REQUIRE(write_snapshot(map.get(), cut).status == GPOM_OK);
        REQUIRE(cut.n_writes == 6);
        CHECK(leaves_one_whole(cut, reader, &older, older, false));
    }
}

// No damaged bit of a snapshot goes unnoticed: the other slot is read, and without one, none.
TEST_CASE("every flipped bit is noticed")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(40));
    Medium alone(40);
    Reader reader(keeping_config(40));
    const int i_scan = fill(map.get(), 440, 0, 30);
    REQUIRE(write_snapshot(map.get(), alone).status == GPOM_OK);
    const Version older = version_of(map.get());
    Medium both = alone;
    fill(map.get(), 441, i_scan, 38);
    REQUIRE(write_snapshot(map.get(), both).report.slot == 1);
    const std::size_t n_bits = 8 * kBlock * 4;
    for (std::size_t i = 0; i < n_bits; ++i) {
        CAPTURE(i);
        const auto bit = static_cast<std::uint8_t>(1u << i % 8);
        alone.slots[0][i / 8] ^= bit;
        REQUIRE(reader.read(alone).status == GPOM_ERR_FORMAT);
        REQUIRE(gpom_map_beam_count(reader.map()) == 0);
        alone.slots[0][i / 8] ^= bit;
        both.slots[1][i / 8] ^= bit;
        REQUIRE(leaves_one_whole(both, reader, &older, older, false));
        both.slots[1][i / 8] ^= bit;
    }
}

// A map that already holds beams keeps them if nothing whole is found.
TEST_CASE("a failed reading leaves the map as it was")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(40));
    fill(map.get(), 450, 0, 30);
    const Version before = version_of(map.get());
    Medium medium(40); // erased
    CHECK(read_snapshot(map.get(), medium).status == GPOM_ERR_FORMAT);
    CHECK(same_version(version_of(map.get()), before));
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    set_number(medium.slots[0], 3 * kBlock + 4, 2,
               GPOM_MAP_FORMAT + 1); // another version in the commit block
    mend(medium.slots[0], 4);
    CHECK(read_snapshot(map.get(), medium).status == GPOM_ERR_FORMAT);
    CHECK(same_version(version_of(map.get()), before));
}

// Checksums do not protect from a forger: whatever the fields say, the map is valid or refused.
TEST_CASE("forged snapshots never make an invalid map")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(64));
    Medium good(64);
    fill(map.get(), 460, 0, 60);
    REQUIRE(write_snapshot(map.get(), good).status == GPOM_OK);
    const std::vector<gpom_point_t> points = random_points(461, 5, 60.0);
    Reader reader(keeping_config(50));
    Random random(462);
    int n_taken = 0;
    constexpr std::uint8_t kPatterns[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
    for (int i = 0; i < 4000; ++i) {
        CAPTURE(i);
        Medium medium = good;
        for (std::uint32_t k = 0; k <= random.below(3); ++k) {
            const std::size_t at = random.below(6 * kBlock);
            const std::size_t n = 1 + random.below(4);
            for (std::size_t j = at; j < at + n && j < 6 * kBlock; ++j) {
                medium.slots[0][j] = kPatterns[random.below(5)];
            }
        }
        mend(medium.slots[0], 6);
        const gpom_status_t status = reader.read(medium).status;
        REQUIRE((status == GPOM_OK || status == GPOM_ERR_FORMAT));
        n_taken += status == GPOM_OK ? 1 : 0;
        std::set<std::uint32_t> ids;
        for (const gpom_beam_t &beam : beams_of(reader.map())) {
            REQUIRE(ids.insert(beam.id).second);
            REQUIRE(std::abs(std::hypot(beam.dir_x, beam.dir_y) - 1.0f) < 1e-4f);
            REQUIRE((beam.range_m > 0.0f && beam.range_m <= 8000.0f));
            REQUIRE(std::isfinite(beam.hit_noise));
        }
        REQUIRE(ids.size() == gpom_map_beam_count(reader.map()));
        for (const gpom_answer_t &answer : query_points(reader.map(), points).all) {
            REQUIRE((answer.probability >= 0.0f && answer.probability <= 1.0f));
        }
        TestScan scan;
        scan.ranges_m = {2.0f, 3.0f, 5.0f};
        scan.stamp_us = i;
        const gpom_status_t inserted = scan.insert_into(reader.map());
        REQUIRE((inserted == GPOM_OK || inserted == GPOM_ERR_REACH)); // the origin may be anywhere
        REQUIRE(gpom_map_build(reader.map()) == GPOM_OK);
    }
    CHECK(n_taken > 100);
    CHECK(n_taken < 3900);
}

// Two beams of one id are refused, though all checksums fit, and so is an id that is yet to come.
TEST_CASE("a forged snapshot that repeats an id or is ahead of its ids is refused")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(64));
    Medium medium(64);
    fill(map.get(), 470, 0, 60);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    Medium ahead = medium;
    const std::size_t next_id_at = 5 * kBlock + 28;
    REQUIRE(number_at(ahead.slots[0], next_id_at, 4) == beams_of(map.get()).back().id + 1);
    set_number(ahead.slots[0], next_id_at, 4, 3);
    mend(ahead.slots[0], 6);
    const std::uint64_t id = number_at(medium.slots[0], 20 + 24, 4);
    set_number(medium.slots[0], 2 * kBlock + 20 + 36 + 24, 4, id);
    mend(medium.slots[0], 6);
    Reader reader(keeping_config(64));
    CHECK(reader.read(medium).status == GPOM_ERR_FORMAT);
    CHECK(gpom_map_beam_count(reader.map()) == 0);
    CHECK(reader.read(ahead).status == GPOM_ERR_FORMAT);
}

// A callback that cannot write is reported, and the older snapshot stays; one that cannot read
// counts as damage.
TEST_CASE("failing callbacks")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(40));
    Medium medium(40);
    const int i_scan = fill(map.get(), 480, 0, 20);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    const Version older = version_of(map.get());
    fill(map.get(), 481, i_scan, 30);
    gpom_snapshot_io_t io = medium.io();
    gpom_snapshot_t snapshot;
    io.write = [](void *, std::uint32_t, std::uint32_t offset, const std::uint8_t *) {
        return offset == kBlock ? GPOM_ERR_IO : GPOM_OK;
    };
    REQUIRE(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_OK);
    CHECK(gpom_snapshot_write_step(&snapshot, map.get(), 100) == GPOM_ERR_IO);
    CHECK(gpom_snapshot_write_step(&snapshot, map.get(), 100) == GPOM_ERR_IO);
    CHECK(snapshot.report.is_done == 0);
    io = medium.io();
    io.flush = [](void *, std::uint32_t) { return GPOM_ERR_IO; };
    REQUIRE(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_OK);
    CHECK(gpom_snapshot_write_step(&snapshot, map.get(), 100) == GPOM_ERR_IO);
    io = medium.io();
    io.read = [](void *ctx, std::uint32_t slot, std::uint32_t offset, std::uint8_t *block) {
        return slot == 1 ? GPOM_ERR_IO : Medium::read_block(ctx, slot, offset, block);
    };
    TestMap copy(keeping_config(40));
    REQUIRE(gpom_snapshot_read_begin(&snapshot, copy.get(), &io) == GPOM_OK);
    REQUIRE(gpom_snapshot_read_step(&snapshot, copy.get(), 100) == GPOM_OK);
    CHECK(same_version(version_of(copy.get()), older));
}

// A medium that fails while the map is being filled leaves it empty, and its cells say no more than
// that: nothing is shown that the map no longer holds.
TEST_CASE("a reading that fails half way leaves no cell of the old map")
{
    GPOM_TELL_SEED();
    gpom_config_t config = keeping_config(400);
    config.lowres_nx = config.lowres_ny = 9;
    config.lowres_cell_m = 10.0;
    config.lowres_x0_m = config.lowres_y0_m = -45.0;
    TestMap map(config);
    fill(map.get(), 482, 0, 300);
    settle(map.get());
    Medium medium(400);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    const int n_blocks = static_cast<int>(n_blocks_of(medium.slots[0]));
    const auto fails_late = [](void *ctx, std::uint32_t slot, std::uint32_t offset,
                               std::uint8_t *block) {
        auto &self = *static_cast<Medium *>(ctx);
        return self.n_reads >= self.lost_block ? GPOM_ERR_IO
                                               : Medium::read_block(ctx, slot, offset, block);
    };
    gpom_snapshot_io_t io = medium.io();
    io.read = fails_late;
    medium.n_reads = 0;
    medium.lost_block = n_blocks + n_blocks / 2; // of reading it a second time
    gpom_snapshot_t snapshot;
    REQUIRE(gpom_snapshot_read_begin(&snapshot, map.get(), &io) == GPOM_OK);
    REQUIRE(gpom_snapshot_read_step(&snapshot, map.get(), 1000) == GPOM_ERR_FORMAT);
    CHECK(gpom_map_beam_count(map.get()) == 0);
    gpom_lowres_info_t info;
    REQUIRE(gpom_lowres_info(map.get(), GPOM_LAYER_COARSE, &info) == GPOM_OK);
    CHECK(info.n_dirty == 81);
    gpom_cell_t cell;
    REQUIRE(gpom_lowres_cell(map.get(), GPOM_LAYER_COARSE, 4, 4, &cell) == GPOM_OK);
    CHECK(cell.cls == GPOM_UNKNOWN);
}

// Contracts: what is missing or too small is refused, and a map is not read while it is used.
TEST_CASE("broken contracts of snapshots are refused")
{
    GPOM_TELL_SEED();
    TestMap map(keeping_config(40)), other(keeping_config(40));
    Medium medium(40);
    const int i_scan = fill(map.get(), 490, 0, 30);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    gpom_snapshot_t snapshot;
    gpom_snapshot_io_t io = medium.io();
    CHECK(gpom_snapshot_write_begin(nullptr, map.get(), &io) == GPOM_ERR_ARG);
    CHECK(gpom_snapshot_write_begin(&snapshot, nullptr, &io) == GPOM_ERR_ARG);
    CHECK(gpom_snapshot_write_step(&snapshot, map.get(), 1) == GPOM_ERR_ARG); // not begun
    CHECK(gpom_snapshot_write_begin(&snapshot, map.get(), nullptr) == GPOM_ERR_ARG);
    --io.slot_bytes;
    CHECK(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_ERR_MEM);
    ++io.slot_bytes;
    io.write = nullptr;
    CHECK(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_ERR_ARG);
    REQUIRE(gpom_snapshot_read_begin(&snapshot, map.get(), &io) == GPOM_OK);
    CHECK(gpom_snapshot_write_step(&snapshot, map.get(), 1) == GPOM_ERR_ARG);
    CHECK(gpom_snapshot_read_step(&snapshot, other.get(), 1) == GPOM_ERR_ARG);
    CHECK(gpom_snapshot_read_step(nullptr, map.get(), 1) == GPOM_ERR_ARG);
    for (int i = 0; gpom_map_beam_count(map.get()) > 0; ++i) { // until it is emptied to be filled
        REQUIRE(i < 10);
        REQUIRE(gpom_snapshot_read_step(&snapshot, map.get(), 1) == GPOM_OK);
    }
    fill(map.get(), 491, i_scan, 10);
    CHECK(gpom_snapshot_read_step(&snapshot, map.get(), 100) == GPOM_ERR_ARG);
    CHECK(beams_of(map.get()).size() == 10);
}
