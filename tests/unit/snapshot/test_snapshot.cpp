// Snapshots: what is written is read, in bounded steps, while the map works.
#include "src/map/map.hpp"
#include "tests/common/snapshot_medium.hpp"

#include <map>
#include <tuple>

using namespace reference;

namespace
{

/// A map that keeps what is new, clears what is gone, and has both in it.
gpom_config_t live_config(std::uint32_t beam_max)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), beam_max);
    config.keep_m = 0.25f;
    config.clear_scans = 2;
    config.old_s = 60.0f;
    config.origin_x_m = 1234.5;
    config.origin_y_m = -77.25;
    return config;
}

constexpr Xy kCentre = {1234.5, -77.25};

/// Scans `first` to `end` of one drive to and fro, so that places are seen again.
void go_on(gpom_map_t *map, std::uint64_t stream, int first, int end)
{
    for (int i = first; i < end; ++i) {
        Random random(stream + static_cast<std::uint64_t>(i));
        TestScan scan = yard_scan(random, 0, kCentre);
        scan.stamp_us = 5000000 + 100000 * i;
        REQUIRE(scan.insert_into(map) == GPOM_OK);
    }
}

/// What tells a beam from all others, whatever its id.
using BeamKey = std::tuple<std::int64_t, float, float, float>;

BeamKey key_of(const gpom_beam_t &beam)
{
    return {beam.stamp_us, beam.dir_x, beam.dir_y, beam.range_m};
}

bool is_provisional(const gpom_beam_t &beam) { return beam.provisional != 0; }
bool is_past(const gpom_beam_t &beam) { return beam.past != 0; }

void check_same_answers(const gpom_map_t *a, const gpom_map_t *b)
{
    const std::vector<gpom_point_t> points = random_points(201, 200, 20.0, kCentre);
    CHECK(same_bits(query_points(a, points).all, query_points(b, points).all));
}

} // namespace

// A map that was read answers as the one that was written, bit for bit, before and after either is
// indexed; and holds the same beams, counters and clock.
TEST_CASE("a snapshot gives back the map")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(2000));
    go_on(map.get(), 210, 0, 60);
    REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
    go_on(map.get(), 210, 60, 70);
    const std::vector<gpom_beam_t> beams = beams_of(map.get());
    REQUIRE(std::any_of(beams.begin(), beams.end(), is_provisional));
    REQUIRE(std::any_of(beams.begin(), beams.end(), is_past));
    REQUIRE(map.stats().free_cleared + map.stats().hits_cleared > 0);
    Medium medium(2000);
    const Outcome written = write_snapshot(map.get(), medium);
    REQUIRE(written.status == GPOM_OK);
    CHECK(written.report.n_beams == beams.size());
    CHECK(medium.n_flushes == 1);
    gpom_config_t other = live_config(2000);
    other.origin_x_m = 0.0; // the snapshot's origin replaces it
    TestMap copy(other);
    const Outcome read = read_snapshot(copy.get(), medium);
    REQUIRE(read.status == GPOM_OK);
    CHECK(read.report.n_beams == beams.size());
    CHECK(read.report.n_dropped == 0);
    CHECK(read.report.params_differ == 0);
    CHECK(read.report.sequence == written.report.sequence);
    CHECK(same_beams(beams_of(copy.get()), beams));
    CHECK(gpom_map_beam_count(copy.get()) == beams.size());
    CHECK(same_counters(copy.get(), map.get()));
    check_same_answers(copy.get(), map.get());
    REQUIRE(gpom_map_build(copy.get()) == GPOM_OK);
    check_same_answers(copy.get(), map.get());
    REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
    check_same_answers(copy.get(), map.get());
}

// Where no beam ever waits or loses a part, the map that was read goes on as the other does: later
// scans lead to the same beams, evictions included.
TEST_CASE("a map that was read goes on like the one that was written")
{
    GPOM_TELL_SEED();
    gpom_config_t config = live_config(700);
    config.clear_scans = 0;
    TestMap map(config);
    go_on(map.get(), 220, 0, 40);
    REQUIRE(map.n_evicted() > 0);
    Medium medium(700);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    TestMap copy(config);
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    REQUIRE(gpom_map_build(copy.get()) == GPOM_OK);
    for (int i = 39; i < 60;
         ++i) { // the last one once more: at the same time it counts for nothing
        go_on(map.get(), 220, i, i + 1);
        go_on(copy.get(), 220, i, i + 1);
        REQUIRE(same_beams(beams_of(copy.get()), beams_of(map.get())));
    }
    CHECK(same_counters(copy.get(), map.get()));
    check_same_answers(copy.get(), map.get());
}

// Where beams are gone, few enough to be searched by their ids, none of them comes back.
TEST_CASE("a snapshot of few beams with gaps between their ids")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(1000));
    go_on(map.get(), 225, 0, 3);
    const std::vector<gpom_beam_t> all = beams_of(map.get());
    REQUIRE(all.back().id < 1000 / 8 + 32);
    const gpom_disc_t disc = {all.front().x_m, all.front().y_m, 6.0};
    REQUIRE(gpom_map_forget(map.get(), &disc) == GPOM_OK);
    const std::vector<gpom_beam_t> left = beams_of(map.get());
    REQUIRE(left.size() < all.size());
    REQUIRE(left.size() > 10);
    Medium medium(1000);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    TestMap copy(live_config(1000));
    go_on(copy.get(), 226, 0, 3); // its lists are not empty
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), left));
    check_same_answers(copy.get(), map.get());
    TestMap fresh(live_config(1000));
    REQUIRE(read_snapshot(fresh.get(), medium).status == GPOM_OK);
    check_same_answers(fresh.get(), map.get());
}

// With beams that wait and slots that are empty, two maps read from the same bytes stay the same,
// and what waits can still be confirmed or given up.
TEST_CASE("maps read from the same bytes go on in the same way")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(500));
    go_on(map.get(), 230, 0, 50);
    Medium medium(500);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    TestMap one(live_config(500)), two(live_config(500));
    REQUIRE(read_snapshot(one.get(), medium, 1).status == GPOM_OK);
    REQUIRE(read_snapshot(two.get(), medium, 77).status == GPOM_OK);
    const gpom_stats_t before = one.stats();
    go_on(one.get(), 230, 50, 90);
    go_on(two.get(), 230, 50, 90);
    CHECK(same_beams(beams_of(one.get()), beams_of(two.get())));
    CHECK(same_counters(one.get(), two.get()));
    CHECK(one.stats().beams_not_confirmed > before.beams_not_confirmed);
    CHECK(one.stats().scans_inserted == before.scans_inserted + 40);
}

// The layout is fixed: every field of every beam stands at its place, low byte first.
TEST_CASE("a snapshot has a fixed layout")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(100));
    go_on(map.get(), 240, 0, 3);
    Medium medium(100);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    const Bytes &bytes = medium.slots[0];
    const auto float_at = [&](std::size_t at) {
        const auto bits = static_cast<std::uint32_t>(number_at(bytes, at, 4));
        float value;
        std::memcpy(&value, &bits, 4);
        return value;
    };
    const std::uint32_t n_slots = gpom_map_slot_count(map.get());
    std::vector<std::uint8_t> n_in_block((n_slots + 12) / 13);
    for (std::uint32_t slot = 0; slot < n_slots; ++slot) { // 13 a block, empty ones left out
        gpom_beam_t beam;
        REQUIRE(gpom_map_beam(map.get(), slot, &beam) == GPOM_OK);
        if (beam.is_hit == 0 && beam.is_free == 0) {
            continue;
        }
        const std::size_t at = slot / 13 * kBlock + 20 + n_in_block[slot / 13]++ * 36u;
        CHECK(kCentre.x + static_cast<double>(float_at(at)) == beam.x_m);
        CHECK(kCentre.y + static_cast<double>(float_at(at + 4)) == beam.y_m);
        CHECK(float_at(at + 8) == beam.dir_x);
        CHECK(float_at(at + 12) == beam.dir_y);
        CHECK(float_at(at + 16) == beam.range_m);
        CHECK(number_at(bytes, at + 24, 4) == beam.id);
        CHECK(number_at(bytes, at + 28, 4) * 1000 + 5000000 ==
              static_cast<std::uint64_t>(beam.stamp_us));
        const std::uint64_t bits = number_at(bytes, at + 34, 2);
        CHECK((bits & 1) == beam.returned);
        const int state = beam.is_hit == 0 ? 0 : beam.provisional != 0 ? 1 : beam.past != 0 ? 2 : 3;
        CHECK((bits >> 1 & 3) == state);
        CHECK((bits >> 3 & 1) == beam.is_free);
        if (beam.past == 0) { // else the counts hold the time since which it is past
            CHECK((bits >> 4 & 15) == beam.n_agreed);
            CHECK((bits >> 8 & 3) == beam.n_against);
            CHECK((bits >> 10 & 1) == beam.arrived);
        }
    }
    const std::size_t n_blocks = n_blocks_of(bytes);
    REQUIRE(n_blocks == n_in_block.size() + 1);
    for (std::uint8_t i = 0; i + 1u < n_blocks; ++i) {
        const Bytes head = {'G', 'P', 'M', 'S', 3, 0, 0, n_in_block[i], 1, 0, 0, 0, 0,
                            0,   0,   0,   i,   0, 0, 0};
        CHECK(std::equal(head.begin(), head.end(), bytes.begin() + i * std::ptrdiff_t{kBlock}));
    }
    Bytes mended = bytes;
    mend(mended, n_blocks);
    CHECK(mended == bytes);
}

// Slots are written in turn, the newest is read, and numbers go on past their greatest.
TEST_CASE("slots take turns and the newest wins")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(300));
    Medium medium(300);
    for (std::uint32_t i = 0; i < 5; ++i) {
        go_on(map.get(), 250, static_cast<int>(i), static_cast<int>(i) + 1);
        const Outcome written = write_snapshot(map.get(), medium);
        REQUIRE(written.status == GPOM_OK);
        CHECK(written.report.slot == i % 2);
        CHECK(written.report.sequence == i + 1);
        TestMap copy(live_config(300));
        REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
        CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
    }
    Bytes &slot = medium.slots[0]; // the newest
    const std::size_t n_blocks = n_blocks_of(slot);
    for (std::size_t i = 0; i < n_blocks; ++i) {
        set_number(slot, i * kBlock + 8, 8, UINT64_MAX);
    }
    mend(slot, n_blocks);
    medium.slots[1].assign(slot.size(), 0xff);
    for (const std::uint64_t sequence : {UINT64_C(0), UINT64_C(1)}) {
        go_on(map.get(), 250, 10 + static_cast<int>(sequence), 11 + static_cast<int>(sequence));
        CHECK(write_snapshot(map.get(), medium).report.sequence == sequence);
        TestMap copy(live_config(300));
        CHECK(read_snapshot(copy.get(), medium).report.sequence == sequence);
        CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
    }
}

// No step does more than it may, and all together no more than is documented.
TEST_CASE("every step is bounded")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(400));
    go_on(map.get(), 260, 0, 20);
    Medium medium(400);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    const int slot_blocks = static_cast<int>(medium.slots[0].size() / kBlock);
    for (const int n_blocks : {0, 1, 2, 7}) {
        CAPTURE(n_blocks);
        gpom_snapshot_t snapshot;
        const gpom_snapshot_io_t io = medium.io();
        TestMap copy(live_config(400));
        for (const bool is_write : {true, false}) {
            const gpom_status_t begun = is_write
                                            ? gpom_snapshot_write_begin(&snapshot, map.get(), &io)
                                            : gpom_snapshot_read_begin(&snapshot, copy.get(), &io);
            REQUIRE(begun == GPOM_OK);
            int total = 0;
            for (int i = 0; i < 300 && snapshot.report.is_done == 0; ++i) {
                medium.n_reads = medium.n_writes = 0;
                const auto n = static_cast<std::uint32_t>(n_blocks);
                REQUIRE((is_write ? gpom_snapshot_write_step(&snapshot, map.get(), n)
                                  : gpom_snapshot_read_step(&snapshot, copy.get(), n)) == GPOM_OK);
                CHECK(medium.n_reads + medium.n_writes <= n_blocks);
                total += medium.n_reads + medium.n_writes;
            }
            CHECK((snapshot.report.is_done != 0) == (n_blocks > 0));
            CHECK(total <= 2 + (is_write ? 2 : 4) * slot_blocks);
        }
    }
}

// While the map changes between steps every beam of the snapshot is whole and there once; those
// that were in the map all the time are all in it, but for those that waited for confirmation when
// they were written, of which no more have a place than in any map: who has none is counted.
TEST_CASE("a map may change while it is written")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(600));
    go_on(map.get(), 270, 0, 40);
    Medium medium(600);
    for (int round = 0; round < 5; ++round) {
        std::map<BeamKey, std::vector<gpom_beam_t>> versions; // all that ever were
        std::map<BeamKey, int> n_seen;
        int n_looks = 0;
        const auto look = [&] {
            ++n_looks;
            for (const gpom_beam_t &beam : beams_of(map.get())) {
                versions[key_of(beam)].push_back(beam);
                ++n_seen[key_of(beam)];
            }
        };
        look();
        gpom_snapshot_t snapshot;
        const gpom_snapshot_io_t io = medium.io();
        REQUIRE(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_OK);
        for (int i = 0; snapshot.report.is_done == 0; ++i) {
            REQUIRE(gpom_snapshot_write_step(&snapshot, map.get(), 5) == GPOM_OK);
            if (snapshot.report.is_done == 0) {
                go_on(map.get(), 270, 100 * (round + 1) + i, 100 * (round + 1) + i + 1);
                look();
            }
        }
        TestMap copy(live_config(600));
        const auto read = read_snapshot(copy.get(), medium);
        REQUIRE(read.status == GPOM_OK);
        std::map<BeamKey, int> n_copied;
        for (const gpom_beam_t &beam : beams_of(copy.get())) {
            ++n_copied[key_of(beam)];
            const std::vector<gpom_beam_t> &known = versions[key_of(beam)];
            CHECK(std::any_of(known.begin(), known.end(),
                              [&](const gpom_beam_t &b) { return same_beam(b, beam); }));
        }
        std::size_t n_kept = 0, n_missing = 0;
        for (const auto &[key, n] : n_seen) {
            CHECK(n_copied[key] <= 1);
            n_kept += n == n_looks ? 1u : 0u;
            if (n == n_looks && n_copied[key] == 0) {
                ++n_missing;
                CHECK(is_provisional(versions[key].front()));
            }
        }
        CHECK(n_missing <= read.report.n_dropped);
        CHECK(n_kept < n_seen.size());
        CHECK(same_counters(copy.get(), map.get()));
    }
}

// Clearing the map between steps starts the writing over, so that old and new never mix.
TEST_CASE("clearing the map while it is written starts over")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(600));
    go_on(map.get(), 280, 0, 20);
    Medium medium(600);
    gpom_snapshot_t snapshot;
    const gpom_snapshot_io_t io = medium.io();
    REQUIRE(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_OK);
    REQUIRE(gpom_snapshot_write_step(&snapshot, map.get(), 20) == GPOM_OK);
    REQUIRE(medium.n_writes > 0);
    REQUIRE(snapshot.report.is_done == 0);
    REQUIRE(gpom_map_clear(map.get()) == GPOM_OK);
    go_on(map.get(), 281, 30, 50);
    while (snapshot.report.is_done == 0) {
        REQUIRE(gpom_snapshot_write_step(&snapshot, map.get(), 1) == GPOM_OK);
    }
    CHECK(snapshot.report.n_restarts == 1);
    TestMap copy(live_config(600));
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
}

// So does a jump of the frame, and an origin that moves with the robot.
TEST_CASE("a jump or a moved origin while the map is written starts over")
{
    GPOM_TELL_SEED();
    gpom_config_t config = live_config(600);
    config.rebase_m = 50.0f;
    for (const bool is_jump : {true, false}) {
        TestMap map(config);
        go_on(map.get(), 284, 0, 20);
        Medium medium(600);
        gpom_snapshot_t snapshot;
        const gpom_snapshot_io_t io = medium.io();
        REQUIRE(gpom_snapshot_write_begin(&snapshot, map.get(), &io) == GPOM_OK);
        REQUIRE(gpom_snapshot_write_step(&snapshot, map.get(), 20) == GPOM_OK);
        TestScan far;
        far.pose.x_m = kCentre.x + 75.0;
        far.pose.y_m = kCentre.y;
        far.stamp_us = 9000000;
        far.ranges_m = {5.0f};
        REQUIRE((is_jump ? gpom_map_jump(map.get(), GPOM_JUMP_KEEP, nullptr)
                         : far.insert_into(map.get())) == GPOM_OK);
        while (snapshot.report.is_done == 0) {
            REQUIRE(gpom_snapshot_write_step(&snapshot, map.get(), 1) == GPOM_OK);
        }
        CHECK(snapshot.report.n_restarts == 1);
        TestMap copy(config);
        REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
        CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
        gpom_point_t origins[2];
        REQUIRE(gpom_map_origin(map.get(), &origins[0]) == GPOM_OK);
        REQUIRE(gpom_map_origin(copy.get(), &origins[1]) == GPOM_OK);
        CHECK(origins[0].x_m == origins[1].x_m);
        CHECK(origins[0].x_m == (is_jump ? kCentre.x : kCentre.x + 75.0));
    }
}

// What is left of beams after forgetting can be stored, at the edge of reach, too.
TEST_CASE("beams cut by forgetting survive")
{
    GPOM_TELL_SEED();
    gpom_config_t config = live_config(100);
    TestMap map(config);
    TestScan scan;
    scan.sensor.range_max_m = 8000.0f;
    scan.pose.x_m = kCentre.x + 7990.0;
    scan.pose.y_m = kCentre.y;
    scan.angle_step_rad = 0.3;
    scan.ranges_m = {7000.0f, 30.0f, 5000.0f, kInf};
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    const gpom_disc_t disc = {scan.pose.x_m, scan.pose.y_m, 6000.0};
    REQUIRE(gpom_map_forget(map.get(), &disc) == GPOM_OK);
    REQUIRE(gpom_map_beam_count(map.get()) == 1);
    Medium medium(100);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    TestMap copy(config);
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
}

// Every cell of the low-resolution map is evaluated anew, and its clock and epoch go on.
TEST_CASE("the low-resolution map follows what was read")
{
    GPOM_TELL_SEED();
    gpom_config_t config = live_config(1000);
    config.lowres_cell_m = 1.0;
    config.lowres_nx = 40;
    config.lowres_ny = 30;
    config.lowres_rolling = 1;
    TestMap map(config), copy(config);
    go_on(map.get(), 286, 0, 20);
    REQUIRE(gpom_map_jump(map.get(), GPOM_JUMP_KEEP, nullptr) == GPOM_OK);
    Medium medium(1000);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    go_on(copy.get(), 287, 0, 5);
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    gpom_lowres_info_t info[2];
    int i = 0;
    for (gpom_map_t *const one : {map.get(), copy.get()}) {
        REQUIRE(gpom_map_jump(one, GPOM_JUMP_KEEP, nullptr) == GPOM_OK);
        REQUIRE(gpom_lowres_info(one, GPOM_LAYER_COARSE, &info[i]) == GPOM_OK);
        ++i;
    }
    CHECK(info[0].frame_epoch == 2);
    CHECK(info[1].frame_epoch == 2);
    CHECK(info[1].stamp0_us == info[0].stamp0_us);
    CHECK(info[1].newest_ms == info[0].newest_ms);
    CHECK(info[1].n_dirty == 40 * 30);
}

// A smaller map takes the youngest beams that fit; a greater one all.
TEST_CASE("a smaller map keeps the youngest beams")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(900));
    go_on(map.get(), 290, 0, 60);
    Medium medium(900);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    std::vector<gpom_beam_t> all = beams_of(map.get());
    const auto by_id = [](const gpom_beam_t &a, const gpom_beam_t &b) { return a.id < b.id; };
    std::sort(all.begin(), all.end(), by_id);
    for (const std::uint32_t beam_max : {1u, 2u, 100u, 333u, 899u, 5000u}) {
        CAPTURE(beam_max);
        gpom_config_t config = live_config(beam_max);
        TestMap copy(config);
        const Outcome read = read_snapshot(copy.get(), medium);
        REQUIRE(read.status == GPOM_OK);
        std::vector<gpom_beam_t> kept = beams_of(copy.get());
        CHECK(kept.size() == read.report.n_beams);
        CHECK(kept.size() + read.report.n_dropped == all.size());
        std::vector<gpom_beam_t> expected = all;
        if (all.size() > beam_max) {
            expected.assign(all.end() - static_cast<std::ptrdiff_t>(beam_max), all.end());
        }
        // Of those that wait, no more than a map of this size lets wait.
        std::size_t n_excess = std::count_if(expected.begin(), expected.end(), is_provisional);
        n_excess -= std::min<std::size_t>(n_excess, beam_max / 16 + 8);
        for (auto beam = expected.begin(); n_excess > 0;) {
            n_excess -= is_provisional(*beam) ? 1u : 0u;
            beam = is_provisional(*beam) ? expected.erase(beam) : beam + 1;
        }
        std::sort(kept.begin(), kept.end(), by_id);
        CHECK(same_beams(kept, expected));
        go_on(copy.get(), 291, 70, 80); // and works
        REQUIRE(gpom_map_build(copy.get()) == GPOM_OK);
        CHECK(beams_of(copy.get()).size() == gpom_map_beam_count(copy.get()));
    }
}

// Other hyperparameters are no obstacle, but are told.
TEST_CASE("a map with other hyperparameters takes the beams and says so")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(200));
    go_on(map.get(), 300, 0, 3);
    Medium medium(200);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    gpom_config_t config = live_config(200);
    config.params.ell_m *= 2.0f;
    TestMap copy(config);
    const Outcome read = read_snapshot(copy.get(), medium);
    CHECK(read.status == GPOM_OK);
    CHECK(read.report.params_differ == 1);
    CHECK(beams_of(copy.get()).size() == beams_of(map.get()).size());
}

// A snapshot of the format before differs in the record of the hyperparameters alone, which had
// fewer fields: 98 bytes behind the 72 of the commit.
TEST_CASE("a snapshot of the format before is read")
{
    GPOM_TELL_SEED();
    TestMap map(live_config(200));
    go_on(map.get(), 300, 0, 3);
    Medium medium(200);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    Bytes &slot = medium.slots[0];
    const std::size_t n_blocks = n_blocks_of(slot);
    for (std::size_t i = 0; i < n_blocks; ++i) {
        set_number(slot, i * kBlock + 4, 2, 2);
    }
    const auto commit = slot.begin() + static_cast<std::ptrdiff_t>((n_blocks - 1) * kBlock);
    const auto record = commit + 20 + 72;
    const auto end = commit + kBlock - 4;
    const auto record_end = record + GPOM_PARAMS_RECORD_BYTES;
    std::copy(record_end, end, record + 98);
    std::copy(record_end - 4, record_end, record + 94);
    mend(slot, n_blocks);
    for (const bool has_new : {false, true}) {
        gpom_config_t config = live_config(200);
        config.params.n_fading = has_new ? 2 : 0;
        TestMap copy(config);
        const Outcome read = read_snapshot(copy.get(), medium);
        REQUIRE(read.status == GPOM_OK);
        CHECK(read.report.params_differ == (has_new ? 1 : 0));
        CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
        CHECK(same_counters(copy.get(), map.get()));
    }
}

// An empty map has a snapshot too, and reading it empties.
TEST_CASE("reading replaces what the map held, and ids start again")
{
    GPOM_TELL_SEED();
    TestMap empty(live_config(200));
    Medium medium(200);
    REQUIRE(write_snapshot(empty.get(), medium).status == GPOM_OK);
    TestMap map(live_config(200));
    go_on(map.get(), 310, 0, 4);
    REQUIRE(read_snapshot(map.get(), medium).status == GPOM_OK);
    CHECK(gpom_map_beam_count(map.get()) == 0);
    CHECK(same_counters(map.get(), empty.get()));
    go_on(map.get(), 310, 4, 5);
    CHECK(beams_of(map.get()).front().id == 0);
}

// However often a map is cleared, or written and read again, ids do not run out: beams that were
// not kept because all were spent are kept again, and answers stay the same bits.
TEST_CASE("ids that are spent come back when a map is read or cleared")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = live_config(200);
    TestMap map(config);
    gpom::Index &index = map.get()->index;
    index.next_id = gpom::kIdEnd / 16 * 16;
    index.hit_tree.id_end = index.next_id;
    index.free_tree.id_end = index.next_id;
    go_on(map.get(), 320, 0, 2);
    const std::uint64_t n_spent = map.stats().beams_ids_spent;
    CHECK(n_spent > 0);
    const std::size_t n_kept = beams_of(map.get()).size();
    CHECK(n_kept <= 15);
    Medium medium(200);
    REQUIRE(write_snapshot(map.get(), medium).status == GPOM_OK);
    TestMap copy(config);
    REQUIRE(read_snapshot(copy.get(), medium).status == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
    check_same_answers(copy.get(), map.get());
    REQUIRE(gpom_map_clear(map.get()) == GPOM_OK);
    for (gpom_map_t *const again : {map.get(), copy.get()}) {
        go_on(again, 320, 2, 4);
        CHECK(beams_of(again).size() > n_kept);
    }
    CHECK(map.stats().beams_ids_spent == n_spent);
    CHECK(copy.stats().beams_ids_spent == n_spent);
}
