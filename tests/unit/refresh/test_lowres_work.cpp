// The low-resolution map at work: which cells are marked, in which order they are made, at what
// cost.
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

// No step takes more than its budget (asserted in step()); one that is too small does nothing.
TEST_CASE("a budget too small for one group does nothing")
{
    TestMap map(lowres_config());
    drive(map.get(), 205, 1);
    const Raster before = raster_of(map.get());
    const std::uint64_t needed = group_ops(map.get());
    for (const std::uint64_t budget : {std::uint64_t{0}, std::uint64_t{1}, needed - 1}) {
        CHECK(step(map.get(), budget) == 0);
    }
    CHECK(same_cells(raster_of(map.get()).cells, before.cells));
    CHECK(step(map.get(), needed) > 0);
    const Raster after = raster_of(map.get());
    CHECK(after.info.n_dirty == before.info.n_dirty - GPOM_LANES_MAX);
}

// Looking for dirty cells costs, too: a group finds none in its 64 looks and takes as many.
TEST_CASE("each look counts one operation")
{
    TestMap map(lowres_config(60, 60, 1.0));
    settle(map.get());
    gpom::lowres_mark_box(map.get()->lowres, {-20.0f, -20.0f}, {-19.0f, -19.0f}, 0.0f);
    REQUIRE(raster_of(map.get()).info.n_dirty > 0);
    CHECK(step(map.get(), group_ops(map.get())) == 64);
    CHECK(step(map.get(), group_ops(map.get()) + 100) == 164);
}

// Work that is done is not done again: a settled map takes no operations.
TEST_CASE("a settled map takes no operations")
{
    TestMap map(lowres_config());
    drive(map.get(), 206, 2);
    settle(map.get());
    CHECK(step(map.get(), UINT64_MAX) == 0);
    drive(map.get(), 207, 1);
    CHECK(step(map.get(), group_ops(map.get())) > 0);
}

// The same scans and budgets make the same map at every moment, not only in the end.
TEST_CASE("the same budgets give the same cells at every step")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = rolling_config();
    TestMap a(config), b(config);
    Random random(208), scans_a(209), scans_b(209);
    for (int i = 0; i < 8; ++i) {
        REQUIRE(yard_scan(scans_a, i, {0, 0}).insert_into(a.get()) == GPOM_OK);
        REQUIRE(yard_scan(scans_b, i, {0, 0}).insert_into(b.get()) == GPOM_OK);
        const std::uint64_t budget = random.below(2000000);
        CHECK(step(a.get(), budget) == step(b.get(), budget));
        REQUIRE(gpom_map_build(b.get()) == GPOM_OK); // an index changes nothing
        CHECK(same_cells(raster_of(a.get()).cells, raster_of(b.get()).cells));
    }
}

// Each cell whose centre is within reach of a segment is marked, none beyond sqrt(2) of it,
// wherever the window lies in its torus.
TEST_CASE("marking a segment marks all cells in reach and no others")
{
    GPOM_TELL_SEED();
    Random random(212);
    for (int round = 0; round < 400; ++round) {
        gpom_config_t config = rolling_config(37, 23, 0.4);
        config.focus_cell_max = 0;
        TestMap map(config);
        gpom::Lowres &lowres = map.get()->lowres;
        const Xy robot = {random.uniform(-50, 50), random.uniform(-50, 50)};
        gpom::lowres_follow(lowres, point_of(robot), 0);
        settle(map.get());
        const Xy a = {robot.x + random.uniform(-12, 12), robot.y + random.uniform(-12, 12)};
        Xy b = {robot.x + random.uniform(-12, 12), robot.y + random.uniform(-12, 12)};
        b = round % 5 == 0 ? a : b;
        b.x = round % 5 == 1 ? a.x : b.x;
        b.y = round % 5 == 2 ? a.y : b.y;
        const float reach_m = round % 7 == 0 ? 0.0f : random.uniform_f(0.0, 4.0);
        gpom::lowres_mark_segment(lowres, point_of(a), point_of(b), reach_m);
        const std::vector<bool> dirty = dirty_cells(map.get());
        gpom_lowres_info_t info;
        REQUIRE(gpom_lowres_info(map.get(), GPOM_LAYER_COARSE, &info) == GPOM_OK);
        const std::vector<gpom_point_t> centres = numbered_centres(info.raster);
        std::size_t n_dirty = 0, n_missed = 0, n_beyond = 0;
        for (std::size_t i = 0; i < centres.size(); ++i) {
            const double d_m = distance_to_segment({centres[i].x_m, centres[i].y_m}, a, b);
            n_dirty += dirty[i] ? 1u : 0u;
            n_missed += !dirty[i] && d_m <= static_cast<double>(reach_m) ? 1u : 0u;
            n_beyond += dirty[i] && d_m > 1.415 * static_cast<double>(reach_m) + 1e-3 ? 1u : 0u;
        }
        CHECK(n_missed == 0);
        CHECK(n_beyond == 0);
        CHECK(info.n_dirty == n_dirty);
    }
}

// The same of a box.
TEST_CASE("marking a box marks all cells in it")
{
    GPOM_TELL_SEED();
    Random random(213);
    TestMap map(rolling_config(37, 23, 0.4));
    for (int round = 0; round < 60; ++round) {
        settle(map.get());
        const Xy low = {random.uniform(-12, 10), random.uniform(-8, 6)};
        const Xy high = {low.x + random.uniform(0, 9), low.y + random.uniform(0, 9)};
        gpom::lowres_mark_box(map.get()->lowres, point_of(low), point_of(high), 0.3f);
        const std::vector<bool> dirty = dirty_cells(map.get());
        const std::vector<gpom_point_t> centres =
            numbered_centres(raster_of(map.get()).info.raster);
        for (std::size_t i = 0; i < centres.size(); ++i) {
            const double out_m =
                std::max(std::max(low.x - centres[i].x_m, centres[i].x_m - high.x),
                         std::max(low.y - centres[i].y_m, centres[i].y_m - high.y));
            REQUIRE((dirty[i] || out_m > 0.3));
            REQUIRE((!dirty[i] || out_m < 0.3 + 1e-3));
        }
    }
}

// Beams farther than lowres_reach_m do not mark, and still their cells are right in the end.
TEST_CASE("a scan marks the cells near its beams only")
{
    gpom_config_t config = lowres_config(60, 60, 1.0);
    config.lowres_reach_m = 1.5f;
    TestMap map(config);
    settle(map.get());
    TestScan scan;
    scan.pose = {6.3, 0.2, 0.0, nullptr};
    scan.ranges_m = {10.0f};
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    const std::vector<bool> dirty = dirty_cells(map.get());
    const auto n_dirty = std::count(dirty.begin(), dirty.end(), true);
    CHECK(n_dirty >= 30);
    CHECK(n_dirty <= 60);
    settle(map.get());
    check_equals_query(map, config);
}

// The nearest dirty cells about the robot come first: those of one group lie in the smallest rings.
TEST_CASE("the cells nearest the robot are evaluated first")
{
    const gpom_config_t config = lowres_config(60, 60, 1.0);
    TestMap map(config);
    gpom::lowres_follow(map.get()->lowres, {6.0f, 0.0f}, 0);
    REQUIRE(step(map.get(), group_ops(map.get())) > 0);
    const std::vector<bool> dirty = dirty_cells(map.get());
    const std::int32_t robot_ix = map.get()->lowres.robot_ix;
    const std::int32_t robot_iy = map.get()->lowres.robot_iy;
    std::vector<std::int32_t> rings;
    for (std::int32_t i = 0; i < 3600; ++i) {
        if (!dirty[static_cast<std::size_t>(i)]) {
            rings.push_back(std::max(std::abs(i % 60 - robot_ix), std::abs(i / 60 - robot_iy)));
        }
    }
    std::sort(rings.begin(), rings.end());
    CHECK(rings == std::vector<std::int32_t>({0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2}));
}

// Scans that keep the surroundings of the robot dirty starve no cell: with one group a step each
// marked cell is evaluated within the steps that lowres.h states.
TEST_CASE("no dirty cell waits longer than stated")
{
    gpom_config_t config = lowres_config(34, 25, 1.0); // sides rounded up: 36 and 28
    TestMap map(config);
    const gpom_point_t path[] = {{0.0, 0.0}, {3.0, 1.0}};
    REQUIRE(gpom_lowres_focus(map.get(), path, 2, 1.0, 0.25) == GPOM_OK);
    const gpom_raster_t focus = raster_of(map.get(), GPOM_LAYER_FOCUS).info.raster;
    const std::size_t n_focus = (focus.nx + 3) / 4 * 4 * ((focus.ny + 3) / 4 * 4);
    const std::size_t bounds[] = {8 + 36 * 28 / 6, 8 + n_focus / 2};
    std::vector<std::size_t> waited[2];
    waited[0].resize(34 * 25);
    waited[1].resize(focus.nx * focus.ny);
    std::size_t longest[2] = {0, 0};
    for (int i = 0; i < 700; ++i) {
        gpom::lowres_follow(map.get()->lowres, {6.0f, 0.0f}, 0);
        gpom::lowres_mark_box(map.get()->lowres, {2.0f, -4.0f}, {10.0f, 4.0f}, 0.0f);
        step(map.get(), group_ops(map.get()));
        for (const std::uint32_t layer : {GPOM_LAYER_COARSE, GPOM_LAYER_FOCUS}) {
            const std::vector<bool> dirty = dirty_cells(map.get(), layer);
            for (std::size_t k = 0; k < dirty.size(); ++k) {
                waited[layer][k] = dirty[k] ? waited[layer][k] + 1 : 0;
                longest[layer] = std::max(longest[layer], waited[layer][k]);
            }
        }
    }
    CHECK(longest[0] <= bounds[0]);
    CHECK(longest[1] <= bounds[1]);
    CHECK(longest[0] > 8); // it was a contest
}

// When the origin moves, marks still land where the beams are.
TEST_CASE("marks follow a moved origin")
{
    TestMap a(lowres_config()), b(lowres_config());
    for (TestMap *map : {&a, &b}) {
        settle(map->get());
    }
    gpom::lowres_mark_segment(a.get()->lowres, {1.0f, 2.0f}, {9.0f, -3.0f}, 1.0f);
    gpom::lowres_rebase(b.get()->lowres, 4.0, -8.0);
    gpom::lowres_mark_segment(b.get()->lowres, {-3.0f, 10.0f}, {5.0f, 5.0f}, 1.0f);
    CHECK(dirty_cells(a.get()) == dirty_cells(b.get()));
}
