// The low-resolution map: what its cells hold and how they are read.
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

namespace
{

/// The same of a layer whose cells are numbered from the map frame's zero.
void check_equals_points(TestMap &map, const gpom_config_t &config, const Raster &raster)
{
    const Answers answers = query_points(map.get(), numbered_centres(raster.info.raster));
    std::size_t n_wrong = 0;
    for (std::size_t i = 0; i < answers.all.size(); ++i) {
        const gpom_cell_t expected = quantised(config, answers.all[i], raster.info.newest_ms);
        n_wrong += same_cell(raster.cells[i], expected) ? 0u : 1u;
    }
    CHECK(n_wrong == 0);
}

std::vector<TestScan> yard_scans(std::uint64_t stream, int n)
{
    Random random(stream);
    std::vector<TestScan> scans;
    for (int i = 0; i < n; ++i) {
        scans.push_back(yard_scan(random, i, {0.0, 0.0}));
    }
    return scans;
}

} // namespace

// In the end every cell holds what the query says of its centre, whatever the order of the scans,
// the budgets and the steps between them: bit for bit.
TEST_CASE("a settled raster equals the raster query")
{
    GPOM_TELL_SEED();
    for (const std::uint64_t stream : {200u, 201u, 202u}) {
        Random random(stream);
        const gpom_config_t config = lowres_config();
        TestMap map(config);
        std::vector<TestScan> scans = yard_scans(203, 6);
        std::shuffle(scans.begin(), scans.end(), random.bits);
        for (const TestScan &scan : scans) {
            REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
            for (std::uint32_t i = random.below(4); i > 0; --i) {
                step(map.get(), random.below(400000));
            }
            if (random.below(3) == 0) {
                REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
            }
        }
        settle(map.get());
        check_equals_query(map, config);
    }
}

// The same for each kernel and both frames, in which the prior variance may vary with the place.
TEST_CASE("a settled raster equals the raster query for every model")
{
    GPOM_TELL_SEED();
    for (int i = 0; i < 10; ++i) {
        CAPTURE(std::string(kKernelNames[i % 5]));
        gpom_config_t config = lowres_config(21, 13, 2.5);
        config.params = params_of(kKernels[i % 5], kFrames[i / 5]);
        TestMap map(config);
        drive(map.get(), 204, 4);
        settle(map.get());
        check_equals_query(map, config);
    }
}

// A cell that nobody evaluated is unknown, has the prior and no stamp; one far from all beams is
// unknown, too.
TEST_CASE("what nobody saw is unknown")
{
    const gpom_config_t config = lowres_config(80, 80, 5.0);
    TestMap map(config);
    for (const gpom_cell_t &cell : raster_of(map.get()).cells) {
        REQUIRE(is_unknown(cell, config.params));
    }
    drive(map.get(), 210, 3);
    settle(map.get());
    const Raster raster = raster_of(map.get());
    CHECK(raster.at(0, 0).cls == GPOM_UNKNOWN);
    CHECK(raster.at(79, 79).cls == GPOM_UNKNOWN);
    gpom_cell_t middle;
    const gpom_point_t sensor = {map.beams()[0].x_m, map.beams()[0].y_m};
    REQUIRE(gpom_lowres_at(map.get(), GPOM_LAYER_COARSE, &sensor, &middle) == GPOM_OK);
    CHECK(middle.cls != GPOM_UNKNOWN);
}

// Rounding keeps the class, keeps probability within half a step and never lowers the variance.
TEST_CASE("quantising never hides an obstacle and never looks surer")
{
    GPOM_TELL_SEED();
    gpom_config_t config = lowres_config();
    TestMap map(config);
    const gpom_params_t &params = config.params;
    const double prior = static_cast<double>(gpom_params_prior_variance(&params));
    Random random(211);
    for (int i = 0; i < 20000; ++i) {
        gpom_answer_t answer = {};
        answer.probability = random.uniform_f(0.0, 1.0);
        if (i % 3 == 0) { // next to a threshold
            const float edge = i % 2 == 0 ? params.p_occupied : params.p_free;
            answer.probability = std::nextafter(edge, static_cast<float>(random.below(2)));
        }
        answer.variance = static_cast<float>(prior) * random.uniform_f(0.0, 1.0);
        answer.cls = answer.probability >= params.p_occupied ? GPOM_OCCUPIED
                     : answer.probability <= params.p_free   ? GPOM_FREE
                                                             : GPOM_UNSURE;
        const std::uint32_t value = gpom::lowres_value(map.get()->lowres, answer);
        const std::uint32_t cls = gpom::class_of_value(value);
        const bool is_vague = answer.variance > 0.95f * static_cast<float>(prior);
        const bool may_vanish = is_vague && answer.cls != GPOM_OCCUPIED;
        REQUIRE(cls == (may_vanish ? static_cast<std::uint32_t>(GPOM_UNKNOWN) : answer.cls));
        const double p = (value & 0xffff) / 65535.0;
        REQUIRE(std::abs(p - static_cast<double>(answer.probability)) <= 0.5 / 65535.0 + 1e-12);
        const double part = (value >> 16 & 0xff) / 255.0;
        const double exact = static_cast<double>(answer.variance) / prior;
        REQUIRE(part >= exact - 1e-12);
        REQUIRE(part < exact + 1.0 / 255.0);
    }
}

// An answer that is only a prior with a flag is no knowledge.
TEST_CASE("cells out of reach are unknown")
{
    gpom_config_t config = lowres_config(6, 6, 5.0);
    config.lowres_x0_m = GPOM_REACH_M - 10.0;
    config.lowres_unknown = 1.0f; // no variance exceeds this
    TestMap map(config);
    settle(map.get());
    const Raster raster = raster_of(map.get());
    CHECK(raster.at(5, 0).cls == GPOM_UNKNOWN);
    CHECK(raster.at(5, 0).variance == 255);
}

// The window follows the robot within an eighth of its sides, its corners stay whole multiples of
// the cell, what it keeps is untouched and what it gains is unknown and dirty.
TEST_CASE("a rolling window moves by whole cells and keeps what it covers")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = rolling_config(40, 24, 0.7);
    TestMap map(config);
    drive(map.get(), 214, 2);
    Random random(215);
    Xy robot = {0.0, 0.0};
    for (int i = 0; i < 60; ++i) {
        settle(map.get());
        const Raster before = raster_of(map.get());
        const double stride_m = i % 10 == 9 ? 60.0 : 4.0;
        robot.x += random.uniform(-stride_m, stride_m);
        robot.y += random.uniform(-stride_m, stride_m);
        gpom::lowres_follow(map.get()->lowres, point_of(robot), 200000);
        const Raster after = raster_of(map.get());
        const gpom_raster_t &r = after.info.raster;
        const double ix0 = r.x0_m / r.cell_m;
        CHECK(std::abs(ix0 - std::round(ix0)) < 1e-9);
        CHECK(std::abs(robot.x - r.x0_m - 20 * r.cell_m) <= (5 + 1) * r.cell_m);
        CHECK(std::abs(robot.y - r.y0_m - 12 * r.cell_m) <= (3 + 1) * r.cell_m);
        const auto shift_x = std::lround((r.x0_m - before.info.raster.x0_m) / r.cell_m);
        const auto shift_y = std::lround((r.y0_m - before.info.raster.y0_m) / r.cell_m);
        std::uint32_t n_gained = 0;
        for (std::uint32_t iy = 0; iy < r.ny; ++iy) {
            for (std::uint32_t ix = 0; ix < r.nx; ++ix) {
                const auto old_ix = ix + shift_x;
                const auto old_iy = iy + shift_y;
                const bool was_there = old_ix >= 0 && old_ix < 40 && old_iy >= 0 && old_iy < 24;
                n_gained += was_there ? 0u : 1u;
                REQUIRE((was_there ? same_cell(after.at(ix, iy),
                                               before.at(static_cast<std::uint32_t>(old_ix),
                                                         static_cast<std::uint32_t>(old_iy)))
                                   : is_unknown(after.at(ix, iy), config.params)));
            }
        }
        CHECK(after.info.n_dirty == n_gained);
    }
}

// Wherever it has rolled, a settled window equals the query of its cells' centres.
TEST_CASE("a settled rolling window equals the query")
{
    GPOM_TELL_SEED();
    gpom_config_t config = rolling_config(25, 18, 0.7);
    config.origin_x_m = 5800000.0;
    config.origin_y_m = -4000.0;
    TestMap map(config);
    Random random(216);
    for (int i = 0; i < 12; ++i) {
        REQUIRE(yard_scan(random, 3 * i, {config.origin_x_m, config.origin_y_m})
                    .insert_into(map.get()) == GPOM_OK);
        step(map.get(), random.below(1000000));
        if (i % 4 == 3) {
            settle(map.get());
            check_equals_points(map, config, raster_of(map.get()));
        }
    }
}

// Reading by index, by point and by copy gives the same cell; edges belong to the cell above them.
TEST_CASE("a cell reads the same by index, point and copy")
{
    TestMap map(rolling_config(20, 12, 0.5));
    drive(map.get(), 217, 3);
    settle(map.get());
    const Raster raster = raster_of(map.get());
    const gpom_raster_t &r = raster.info.raster;
    for (std::uint32_t iy = 0; iy < r.ny; ++iy) {
        for (std::uint32_t ix = 0; ix < r.nx; ++ix) {
            gpom_cell_t by_index, by_point;
            REQUIRE(gpom_lowres_cell(map.get(), GPOM_LAYER_COARSE, ix, iy, &by_index) == GPOM_OK);
            for (const double place : {0.0, 0.5, 0.99}) {
                const gpom_point_t point = {r.x0_m + (ix + place) * r.cell_m,
                                            r.y0_m + (iy + place) * r.cell_m};
                REQUIRE(gpom_lowres_at(map.get(), GPOM_LAYER_COARSE, &point, &by_point) == GPOM_OK);
                REQUIRE(same_cell(by_point, raster.at(ix, iy)));
            }
            REQUIRE(same_cell(by_index, raster.at(ix, iy)));
        }
    }
    gpom_cell_t cell;
    for (const gpom_point_t &outside :
         {gpom_point_t{r.x0_m - 0.01, r.y0_m + 1.0}, gpom_point_t{r.x0_m + 10.01, r.y0_m + 1.0},
          gpom_point_t{r.x0_m + 1.0, r.y0_m + 6.01}, gpom_point_t{1e300, r.y0_m + 1.0},
          gpom_point_t{static_cast<double>(kNan), r.y0_m + 1.0}}) {
        CHECK(gpom_lowres_at(map.get(), GPOM_LAYER_COARSE, &outside, &cell) == GPOM_ERR_REACH);
    }
}

// Stamps count from the first scan; a cell carries the newest scan's when it was evaluated.
TEST_CASE("a cell's stamp is that of the newest scan at its evaluation")
{
    TestMap map(lowres_config());
    std::vector<TestScan> scans = yard_scans(218, 3);
    scans[0].stamp_us = 5000000;
    scans[1].stamp_us = 7250999;
    scans[2].stamp_us = 6000000; // late
    const std::uint32_t expected_ms[] = {0, 2250, 2250};
    for (std::size_t i = 0; i < 3; ++i) {
        REQUIRE(scans[i].insert_into(map.get()) == GPOM_OK);
        settle(map.get());
        const Raster raster = raster_of(map.get());
        CHECK(raster.info.stamp0_us == 5000000);
        CHECK(raster.info.newest_ms == expected_ms[i]);
        for (const gpom_cell_t &cell : raster.cells) {
            REQUIRE(cell.stamp_ms == expected_ms[i]);
        }
    }
    scans[0].stamp_us = std::numeric_limits<std::int64_t>::max();
    REQUIRE(scans[0].insert_into(map.get()) == GPOM_OK);
    CHECK(raster_of(map.get()).info.newest_ms == UINT32_MAX);
    scans[0].stamp_us = std::numeric_limits<std::int64_t>::min();
    REQUIRE(scans[0].insert_into(map.get()) == GPOM_OK);
    CHECK(raster_of(map.get()).info.newest_ms == 0);
}

// A scan whose clock was ahead makes no cell look fresh for long: the next one of the true time
// sets the newest back, and cells get its stamp as they are evaluated.
TEST_CASE("a scan from the future is forgotten with the next")
{
    TestMap map(lowres_config());
    std::vector<TestScan> scans = yard_scans(219, 5);
    const std::int64_t stamps_s[] = {100, 3701, 102, 103, 104};
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].stamp_us = 1000000 * stamps_s[i];
        REQUIRE(scans[i].insert_into(map.get()) == GPOM_OK);
        const auto expected_ms = static_cast<std::uint32_t>(1000 * (stamps_s[i] - 100));
        CHECK(raster_of(map.get()).info.newest_ms == expected_ms);
        settle(map.get());
        for (const gpom_cell_t &cell : raster_of(map.get()).cells) {
            REQUIRE(cell.stamp_ms == expected_ms);
        }
    }
}

// Each scan and each other change counts; only a new epoch changes the epoch.
TEST_CASE("sequence and epoch are visible to readers")
{
    TestMap map(lowres_config());
    const gpom_lowres_info_t first = raster_of(map.get()).info;
    drive(map.get(), 219, 2);
    const gpom_lowres_info_t driven = raster_of(map.get()).info;
    CHECK(driven.map_sequence == first.map_sequence + 2);
    CHECK(driven.frame_epoch == first.frame_epoch);
    gpom::lowres_start_epoch(map.get()->lowres, false);
    CHECK(raster_of(map.get()).info.frame_epoch == first.frame_epoch + 1);
    CHECK(raster_of(map.get()).info.map_sequence != driven.map_sequence);
}

// A cleared map knows nothing, and settles to what a new one holds.
TEST_CASE("clearing makes all cells unknown")
{
    const gpom_config_t config = lowres_config();
    TestMap map(config);
    drive(map.get(), 220, 3);
    settle(map.get());
    REQUIRE(gpom_map_clear(map.get()) == GPOM_OK);
    for (const gpom_cell_t &cell : raster_of(map.get()).cells) {
        REQUIRE(is_unknown(cell, config.params));
    }
    settle(map.get());
    check_equals_query(map, config);
}

// The focus covers the band's bounding box with the smallest doubling that fits; only the band is
// evaluated, and there it equals the query.
TEST_CASE("the focus is a finer raster about a path")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = lowres_config();
    TestMap map(config);
    drive(map.get(), 221, 4);
    const std::vector<gpom_point_t> path = {{-2.0, -3.0}, {6.0, 1.0}, {7.0, 6.0}};
    REQUIRE(gpom_lowres_focus(map.get(), path.data(), path.size(), 1.1, 0.1) == GPOM_OK);
    settle(map.get());
    const Raster raster = raster_of(map.get(), GPOM_LAYER_FOCUS);
    const gpom_raster_t &r = raster.info.raster;
    CHECK(r.cell_m == 0.4); // 11.2 m x 11.2 m in 900 cells: 0.1 and 0.2 are too small
    CHECK(r.x0_m <= -3.1);
    CHECK(r.x0_m > -3.1 - 0.4);
    CHECK(r.y0_m + r.ny * 0.4 >= 7.1);
    CHECK(r.nx * r.ny <= 900);
    const std::vector<gpom_point_t> centres = numbered_centres(r);
    const Answers answers = query_points(map.get(), centres);
    std::size_t n_in = 0;
    for (std::size_t i = 0; i < centres.size(); ++i) {
        const Xy c = {centres[i].x_m, centres[i].y_m};
        const double d_m = std::min(distance_to_segment(c, {-2.0, -3.0}, {6.0, 1.0}),
                                    distance_to_segment(c, {6.0, 1.0}, {7.0, 6.0}));
        if (d_m > 1.1 - 1e-3 && d_m < 1.1 * 1.415) {
            continue; // either
        }
        n_in += d_m < 1.1 ? 1u : 0u;
        const gpom_cell_t expected = quantised(config, answers.all[i], raster.info.newest_ms);
        REQUIRE((d_m < 1.1 ? same_cell(raster.cells[i], expected)
                           : is_unknown(raster.cells[i], config.params)));
    }
    CHECK(n_in > 100);
    check_equals_query(map, config);
    REQUIRE(gpom_lowres_focus(map.get(), nullptr, 0, 0.0, 0.0) == GPOM_OK);
    CHECK(raster_of(map.get(), GPOM_LAYER_FOCUS).cells.empty());
    CHECK(step(map.get(), UINT64_MAX) == 0);
}

// A scan after the focus began makes the band follow; one point is a disc.
TEST_CASE("the focus stays fresh")
{
    const gpom_config_t config = lowres_config();
    TestMap map(config);
    const gpom_point_t place = {2.0, 0.5};
    REQUIRE(gpom_lowres_focus(map.get(), &place, 1, 100.0, 0.25) == GPOM_OK);
    CHECK(raster_of(map.get(), GPOM_LAYER_FOCUS).info.raster.cell_m == 8.0);
    REQUIRE(gpom_lowres_focus(map.get(), &place, 1, 2.0, 0.25) == GPOM_OK);
    settle(map.get());
    drive(map.get(), 222, 3);
    settle(map.get());
    const Raster raster = raster_of(map.get(), GPOM_LAYER_FOCUS);
    const Answers answers = query_points(map.get(), numbered_centres(raster.info.raster));
    gpom_cell_t cell;
    REQUIRE(gpom_lowres_at(map.get(), GPOM_LAYER_FOCUS, &place, &cell) == GPOM_OK);
    const std::size_t i = 8 * raster.info.raster.nx + 8;
    CHECK(same_cell(cell, raster.cells[raster.info.raster.nx * 10 + 8]) ==
          same_cell(raster.cells[i], raster.cells[raster.info.raster.nx * 10 + 8]));
    CHECK(same_cell(raster.cells[i], quantised(config, answers.all[i], raster.info.newest_ms)));
}

// Each wrong argument is refused with its status and changes nothing.
TEST_CASE("wrong arguments of the low-resolution map are refused")
{
    TestMap map(lowres_config());
    gpom_cell_t cell, cells[4];
    gpom_lowres_info_t info;
    const gpom_point_t here = {6.0, 0.0};
    const auto no_layer = std::uint32_t{2};
    CHECK(gpom_lowres_info(nullptr, GPOM_LAYER_COARSE, &info) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_info(map.get(), no_layer, &info) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_info(map.get(), GPOM_LAYER_COARSE, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_copy(nullptr, GPOM_LAYER_COARSE, cells, 4, &info) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_copy(map.get(), no_layer, cells, 4, &info) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_copy(map.get(), GPOM_LAYER_COARSE, nullptr, 4, &info) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_copy(map.get(), GPOM_LAYER_COARSE, cells, 4, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_copy(map.get(), GPOM_LAYER_COARSE, cells, 4, &info) == GPOM_ERR_MEM);
    CHECK(info.raster.nx == 44);
    CHECK(gpom_lowres_cell(nullptr, GPOM_LAYER_COARSE, 0, 0, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_cell(map.get(), no_layer, 0, 0, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_cell(map.get(), GPOM_LAYER_COARSE, 44, 0, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_cell(map.get(), GPOM_LAYER_COARSE, 0, 30, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_cell(map.get(), GPOM_LAYER_FOCUS, 0, 0, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_cell(map.get(), GPOM_LAYER_COARSE, 0, 0, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_at(nullptr, GPOM_LAYER_COARSE, &here, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_at(map.get(), GPOM_LAYER_COARSE, nullptr, &cell) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_at(map.get(), GPOM_LAYER_FOCUS, &here, &cell) == GPOM_ERR_REACH);
    const double nan = static_cast<double>(kNan);
    CHECK(gpom_lowres_focus(nullptr, &here, 1, 1.0, 0.5) == GPOM_ERR_ARG);
    CHECK(gpom_lowres_focus(map.get(), nullptr, 1, 1.0, 0.5) == GPOM_ERR_ARG);
    for (const double bad : {nan, -1.0, GPOM_REACH_M * 1.01}) {
        CHECK(gpom_lowres_focus(map.get(), &here, 1, bad, 0.5) == GPOM_ERR_ARG);
    }
    for (const double bad : {nan, 0.0, -1.0, 1e7}) {
        CHECK(gpom_lowres_focus(map.get(), &here, 1, 1.0, bad) == GPOM_ERR_ARG);
    }
    for (const double bad : {nan, 1e300, GPOM_REACH_M * 1.01}) {
        const gpom_point_t far_away = {bad, 0.0};
        CHECK(gpom_lowres_focus(map.get(), &far_away, 1, 1.0, 0.5) == GPOM_ERR_REACH);
    }
    CHECK(raster_of(map.get(), GPOM_LAYER_FOCUS).cells.empty());
    gpom_config_t config = lowres_config();
    config.focus_cell_max = 0;
    TestMap without(config);
    CHECK(gpom_lowres_focus(without.get(), &here, 1, 1.0, 0.5) == GPOM_ERR_MEM);
}

// Each configuration that makes no sense is refused; the macro suffices for those that do.
TEST_CASE("configurations of the low-resolution map")
{
    const auto init = [](const gpom_config_t &config) {
        std::vector<std::uint64_t> memory(1 << 16);
        gpom_map_t *map;
        return gpom_map_init(&map, &config, memory.data(), memory.size() * 8);
    };
    gpom_config_t good = lowres_config(5, 4, 1.0);
    good.focus_cell_max = 9;
    CHECK(init(good) == GPOM_OK);
    const double nan = static_cast<double>(kNan);
    const auto refused = [&](auto change) {
        gpom_config_t config = good;
        change(config);
        CHECK(init(config) == GPOM_ERR_ARG);
    };
    for (const double bad : {nan, 0.0, -1.0, 1e7}) {
        refused([bad](gpom_config_t &c) { c.lowres_cell_m = bad; });
    }
    for (const double bad : {nan, 1e300}) {
        refused([bad](gpom_config_t &c) { c.lowres_x0_m = bad; });
        refused([bad](gpom_config_t &c) { c.lowres_y0_m = bad; });
    }
    for (const float bad : {kNan, -0.1f, 1.1f}) {
        refused([bad](gpom_config_t &c) { c.lowres_unknown = bad; });
    }
    for (const float bad : {kNan, -1.0f, 9000.0f}) {
        refused([bad](gpom_config_t &c) { c.lowres_reach_m = bad; });
    }
    refused([](gpom_config_t &c) { c.lowres_nx = 0; });
    refused([](gpom_config_t &c) { c.lowres_ny = 0; });
    refused([](gpom_config_t &c) { c.lowres_nx = c.lowres_ny = 0; }); // a focus alone
    refused([](gpom_config_t &c) { c.focus_cell_max = GPOM_CELL_MAX; });
    refused([](gpom_config_t &c) { c.focus_cell_max = 3; }); // a path may cross both axes
    refused([](gpom_config_t &c) {
        c.lowres_rolling = 1;
        c.origin_x_m = 1e12;
    });
    for (const std::uint32_t n : {1u, 7u, 400u, 65535u}) {
        good.lowres_nx = static_cast<std::uint16_t>(n);
        const std::size_t exact = gpom_map_bytes(&good);
        const std::size_t macro = GPOM_MAP_BYTES(good.beam_max, 4 * n + 9);
        CHECK(exact <= macro);
        CHECK(exact + 2048 >= macro);
    }
}

// A map without rasters has nothing to read and nothing to do.
TEST_CASE("a map without rasters does no work")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    drive(map.get(), 223, 2);
    CHECK(raster_of(map.get()).cells.empty());
    CHECK(step(map.get(), UINT64_MAX) == 0);
    gpom::lowres_mark_all(map.get()->lowres);
    CHECK(step(map.get(), UINT64_MAX) == 0);
}
