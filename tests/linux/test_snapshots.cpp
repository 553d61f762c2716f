#include "ports/linux/map/mapping.hpp"
#include "ports/linux/map/snapshots.hpp"

#include "tests/common/reference.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <memory>
#include <random>
#include <thread>
#include <vector>

using namespace gpomd;

namespace
{

/// Two slots of a disk that hangs in its first write until it is let go.
class HungDisk {
public:
    explicit HungDisk(std::size_t slot_bytes) : slots_{Slot(slot_bytes), Slot(slot_bytes)} {}

    gpom_snapshot_io_t io()
    {
        return {this, static_cast<std::uint32_t>(slots_[0].size()), read, write, nullptr};
    }
    void wait_until_hung()
    {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return is_hung_; });
    }
    void let_go()
    {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            is_free_ = true;
        }
        changed_.notify_all();
    }

private:
    using Slot = std::vector<std::uint8_t>;

    static gpom_status_t read(void *disk, std::uint32_t slot, std::uint32_t at, std::uint8_t *block)
    {
        const HungDisk &self = *static_cast<HungDisk *>(disk);
        std::memcpy(block, self.slots_[slot].data() + at, GPOM_SNAPSHOT_BLOCK_BYTES);
        return GPOM_OK;
    }
    static gpom_status_t write(void *disk, std::uint32_t slot, std::uint32_t at,
                               const std::uint8_t *block)
    {
        HungDisk &self = *static_cast<HungDisk *>(disk);
        std::unique_lock<std::mutex> lock(self.mutex_);
        self.is_hung_ = true;
        self.changed_.notify_all();
        self.changed_.wait(lock, [&self] { return self.is_free_; });
        std::memcpy(self.slots_[slot].data() + at, block, GPOM_SNAPSHOT_BLOCK_BYTES);
        return GPOM_OK;
    }

    Slot slots_[2];
    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_hung_ = false;
    bool is_free_ = false;
};

/// A map of its own memory, and the snapshots of it.
struct Snapped {
    std::unique_ptr<Config> config = std::make_unique<Config>();
    Counts counts;
    Snapshots snapshots;
    Memory memory;
    std::vector<std::uint64_t> map_memory;
    gpom_map_t *map = nullptr;

    explicit Snapped(const gpom_snapshot_io_t &disk)
    {
        gpom_config_init(&config->map);
        config->map.lowres_cell_m = 1.0;
        config->map.lowres_nx = config->map.lowres_ny = 4;
        std::strcpy(config->snapshot_path, "on a disk");
        config->snapshot_period_us = 1000;
        map_memory.resize(gpom_map_bytes(&config->map) / 8 + 1);
        REQUIRE(gpom_map_init(&map, &config->map, map_memory.data(), 8 * map_memory.size()) ==
                GPOM_OK);
        REQUIRE(memory.reserve(Snapshots::need(*config)));
        snapshots.init(*config, memory, disk, counts);
    }

    void see_something(std::int64_t stamp_us, double bearing_rad)
    {
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        const float range_m = 5.0f;
        const gpom_scan_t scan = {stamp_us, bearing_rad, 0.0, &range_m, 1};
        const gpom_pose_t pose = {0.0, 0.0, 0.0, nullptr};
        REQUIRE(gpom_scan_insert(map, &scan, &sensor, &pose) == GPOM_OK);
    }
};

} // namespace

// A snapshot that takes no more than twice as long as the longest of the last eight, and half a
// period at most, is on disk a period after the one before was begun; so is the very first one.
TEST_CASE("a snapshot is begun so early that it is on disk when the period is over")
{
    GPOM_TELL_SEED();
    constexpr std::int64_t kPeriod_us = 1000000;
    std::mt19937_64 random(reference::seed());
    SnapshotPace pace;
    pace.init(kPeriod_us);
    pace.begin(5000000);
    std::deque<std::int64_t> last_us = {kPeriod_us / 4};
    for (int i = 0; i < 1000; ++i) {
        const std::int64_t longest_us = *std::max_element(last_us.begin(), last_us.end());
        std::uniform_int_distribution<std::int64_t> any(0,
                                                        std::min(2 * longest_us, kPeriod_us / 2));
        const std::int64_t before_us = pace.begun_us(), took_us = any(random);
        pace.begin(pace.due_us());
        REQUIRE(pace.begun_us() >= before_us + kPeriod_us / 2); // no more often than need be
        REQUIRE(pace.begun_us() + took_us <= before_us + kPeriod_us);
        pace.note(took_us);
        last_us.push_back(took_us);
        if (i == 0 || last_us.size() > 8) { // the first one was not taken, but assumed
            last_us.pop_front();
        }
    }
}

// While the disk hangs, the mapping thread's turns come back and take no second snapshot; once the
// disk goes on, that one is written, and the next one has what came meanwhile.
TEST_CASE("a disk that hangs does not hold the mapping thread")
{
    HungDisk disk(GPOM_SNAPSHOT_SLOT_BYTES(1024));
    Snapped snapped(disk.io());
    std::thread writer([&] { snapped.snapshots.run(); });
    std::int64_t now_us = 1;
    for (bool is_taken = false; !is_taken; now_us += 500) {
        const bool was_writing = snapped.snapshots.step(snapped.map, now_us);
        is_taken = now_us > 1000 && !was_writing;
    }
    disk.wait_until_hung();
    for (int i = 0; i < 500; ++i, now_us += 500) {
        snapped.see_something(now_us, 1e-3 * static_cast<double>(now_us));
        REQUIRE(!snapped.snapshots.step(snapped.map, now_us));
    }
    CHECK(snapped.counts[GPOM_WIRE_SNAPSHOTS_WRITTEN] == 0);
    disk.let_go();
    snapped.snapshots.finish(snapped.map);
    snapped.snapshots.stop();
    writer.join();
    CHECK(snapped.counts[GPOM_WIRE_SNAPSHOTS_WRITTEN] == 2);
    CHECK(snapped.counts[GPOM_WIRE_SNAPSHOTS_FAILED] == 0);
    Snapped again(disk.io());
    gpom_snapshot_report_t report = {};
    REQUIRE(again.snapshots.restore(again.map, report));
    CHECK(report.sequence == 2);
    CHECK(report.n_beams == 500);
}

// Any program may write a snapshot, with stamps that no scan of gpomd's can have: what gpomd takes
// for the newest scan's is one from which differences do not overflow.
TEST_CASE("the newest stamp of a snapshot is brought to what gpomd lets in")
{
    const std::int64_t most_us = INT64_MAX / 4;
    for (const std::int64_t stamp_us : {INT64_MIN, std::int64_t{-1000}, std::int64_t{0},
                                        std::int64_t{5000000}, most_us, INT64_MAX}) {
        CAPTURE(stamp_us);
        HungDisk disk(GPOM_SNAPSHOT_SLOT_BYTES(1024));
        disk.let_go();
        Snapped written(disk.io());
        written.see_something(stamp_us, 0.0);
        std::thread writer([&] { written.snapshots.run(); });
        written.snapshots.finish(written.map);
        written.snapshots.stop();
        writer.join();
        Snapped read(disk.io());
        Memory memory;
        REQUIRE(memory.reserve(MapThread::need(*read.config)));
        MapThread thread;
        REQUIRE(thread.init(*read.config, memory,
                            {nullptr, nullptr, nullptr, &read.snapshots, &read.counts, nullptr}) ==
                nullptr);
        gpom_snapshot_report_t report = {};
        REQUIRE(thread.restore(report));
        CHECK(thread.state().stamp_us == std::clamp<std::int64_t>(stamp_us, 0, most_us));
    }
}
