// Stamps are kept in 32 bits of milliseconds, 49 days; the clock may be set, and a map may be kept
// for years.
#include "tests/common/lowres_fixture.hpp"
#include "tests/common/snapshot_medium.hpp"

using namespace reference;

namespace
{

constexpr std::int64_t kMinute_us = INT64_C(60000000), kDay_us = 1440 * kMinute_us;
constexpr std::int64_t kYear_us = 365 * kDay_us;
constexpr std::int64_t kSpan_us = INT64_C(1000) * UINT32_MAX;
constexpr std::int64_t kStart_us = INT64_C(1700000000000000);
constexpr std::int64_t kLow = INT64_MIN, kHigh = INT64_MAX;

/// A yard that is scanned, with a path of interest.
struct Drive {
    TestMap map{lowres_config()};
    Random random{230};

    Drive()
    {
        const gpom_point_t path[] = {{-3.0, 0.0}, {5.0, 2.0}};
        REQUIRE(gpom_lowres_focus(map.get(), path, 2, 1.0, 0.25) == GPOM_OK);
    }

    void scan(std::int64_t stamp_us)
    {
        TestScan scan = yard_scan(random, 0, {});
        scan.stamp_us = stamp_us;
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    }
};

/// Of two stamps that are not more than 2 ms apart.
bool is_close(std::int64_t a_us, std::int64_t b_us)
{
    const std::int64_t low = std::min(a_us, b_us), high = std::max(a_us, b_us);
    return static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low) <= 2000;
}

std::int64_t newest_us(const gpom_lowres_info_t &info)
{
    return info.stamp0_us + INT64_C(1000) * info.newest_ms;
}

/// A stamp, held within what is counted from the first on.
std::int64_t held_us(const gpom_lowres_info_t &info, std::int64_t stamp_us)
{
    if (stamp_us < info.stamp0_us) {
        return info.stamp0_us;
    }
    const bool has_end = info.stamp0_us < kHigh - kSpan_us;
    return has_end ? std::min(stamp_us, info.stamp0_us + kSpan_us) : stamp_us;
}

void check_cells(const Raster &before, const Raster &after)
{
    std::size_t n_evaluated = 0;
    for (std::size_t i = 0; i < before.cells.size(); ++i) {
        const gpom_cell_t &was = before.cells[i], &is = after.cells[i];
        CHECK((was.probability == is.probability && was.cls == is.cls));
        if (was.stamp_ms == 0) {
            CHECK(is.stamp_ms == 0);
            continue;
        }
        ++n_evaluated;
        const std::int64_t was_us = before.info.stamp0_us + INT64_C(1000) * was.stamp_ms;
        const std::int64_t is_us = after.info.stamp0_us + INT64_C(1000) * is.stamp_ms;
        CHECK(is_close(is_us, held_us(after.info, was_us)));
    }
    CHECK((n_evaluated > 20 && n_evaluated < before.cells.size()));
}

} // namespace

// Wherever the clock goes, from its second scan there on stamps are true to 2 ms; those of beams
// and cells from before stay as they were as far as they can be told, and cells never evaluated
// have none.
TEST_CASE("stamps follow the clock wherever it goes")
{
    GPOM_TELL_SEED();
    const std::int64_t table_us[][2] = {{kStart_us, kStart_us + 40 * kDay_us},
                                        {kStart_us, kStart_us + 50 * kDay_us},
                                        {kStart_us, kStart_us + 70 * kDay_us},
                                        {kStart_us, kStart_us + 30 * kYear_us},
                                        {0, kStart_us},
                                        {kStart_us, kStart_us - 2 * kMinute_us},
                                        {kStart_us, kStart_us - 40 * kDay_us},
                                        {kStart_us, 0},
                                        {kLow, kHigh - kMinute_us},
                                        {kHigh - kMinute_us, kLow},
                                        {kLow + 40 * kDay_us, kLow},
                                        {-999, kLow + 808}};
    for (const auto &row : table_us) {
        Drive drive;
        for (int i = 0; i < 5; ++i) {
            drive.scan(row[0] + 100000 * i);
        }
        step(drive.map.get(), 30 * group_ops(drive.map.get()));
        drive.scan(row[1]);
        const std::vector<gpom_beam_t> before = beams_of(drive.map.get());
        const Raster coarse = raster_of(drive.map.get());
        const Raster focus = raster_of(drive.map.get(), GPOM_LAYER_FOCUS);
        drive.scan(row[1] + 100000);
        const Raster after = raster_of(drive.map.get());
        CHECK(is_close(newest_us(after.info), row[1] + 100000));
        check_cells(coarse, after);
        check_cells(focus, raster_of(drive.map.get(), GPOM_LAYER_FOCUS));
        drive.scan(row[1] + 200000);
        const std::vector<gpom_beam_t> beams = beams_of(drive.map.get());
        REQUIRE(beams.size() == before.size() + 100);
        for (std::size_t i = 0; i < beams.size(); ++i) {
            if (i < before.size()) {
                REQUIRE(beams[i].id == before[i].id);
                CHECK(is_close(beams[i].stamp_us, held_us(after.info, before[i].stamp_us)));
            } else {
                CHECK(
                    is_close(beams[i].stamp_us, row[1] + (i < beams.size() - 50 ? 1 : 2) * 100000));
            }
        }
    }
}

// Scans of a wrong clock move nothing as long as none comes straight after another on its side:
// what the others say of time stays true.
TEST_CASE("one wild stamp moves no other")
{
    GPOM_TELL_SEED();
    for (const std::int64_t wild_us :
         {kStart_us + 60 * kDay_us, kStart_us - kDay_us, kLow, kHigh}) {
        Drive drive;
        for (int i = 0; i < 20; ++i) {
            drive.scan(kStart_us + 100000 * i);
            if (i % 2 == 1) {
                drive.scan(wild_us);
            }
            if (i % 4 == 3) {
                drive.scan(kStart_us + (wild_us < kStart_us ? 60 : -60) * kDay_us);
            }
        }
        drive.scan(kStart_us + 100000 * 20);
        const gpom_lowres_info_t info = raster_of(drive.map.get()).info;
        CHECK(info.stamp0_us == kStart_us);
        CHECK(info.newest_ms == 2000);
    }
}

// A sensor whose scans arrive late has some before the first, which stays what stamps count from;
// by more than a minute it is the clock.
TEST_CASE("scans before the first are late up to a minute")
{
    const std::int64_t second_us = 1000000;
    for (const std::int64_t late_s : {1, 60, 61}) {
        Drive drive;
        drive.scan(kStart_us);
        drive.scan(kStart_us - late_s * second_us);
        drive.scan(kStart_us - late_s * second_us);
        CHECK((raster_of(drive.map.get()).info.stamp0_us == kStart_us) == (late_s <= 60));
    }
}

// The clock may be set while a snapshot is being written: what is read has the stamps of the map.
TEST_CASE("a snapshot begins anew when stamps are counted from elsewhere")
{
    GPOM_TELL_SEED();
    for (const std::int64_t clock_us : {kStart_us + 90 * kDay_us, kStart_us - 90 * kDay_us}) {
        Drive drive;
        for (int i = 0; i < 8; ++i) {
            drive.scan(kStart_us + 100000 * i);
        }
        Medium medium(1024);
        const gpom_snapshot_io_t io = medium.io();
        gpom_snapshot_t snapshot;
        REQUIRE(gpom_snapshot_write_begin(&snapshot, drive.map.get(), &io) == GPOM_OK);
        while (snapshot.report.is_done == 0) {
            REQUIRE(gpom_snapshot_write_step(&snapshot, drive.map.get(), 1) == GPOM_OK);
            if (medium.n_writes == 5 && snapshot.report.n_restarts == 0) {
                drive.scan(clock_us);
                drive.scan(clock_us + 100000);
            }
        }
        CHECK(snapshot.report.n_restarts == 1);
        TestMap read(lowres_config());
        REQUIRE(read_snapshot(read.get(), medium).status == GPOM_OK);
        const std::vector<gpom_beam_t> written = beams_of(drive.map.get());
        const std::vector<gpom_beam_t> beams = beams_of(read.get());
        REQUIRE(beams.size() == written.size());
        CHECK(std::equal(beams.begin(), beams.end(), written.begin(), same_beam));
    }
}
