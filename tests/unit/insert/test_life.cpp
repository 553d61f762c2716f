// Whole lives of maps: whatever happens to one, in whatever order, its answers are those of its
// beams, and when it was stepped changes nothing.
#include "tests/common/lowres_fixture.hpp"
#include "tests/common/sweep_fixture.hpp"

using namespace reference;

namespace
{

constexpr double kHallX_m = 24.0, kHallY_m = 12.0; // half sides

gpom_params_t random_params(Random &random)
{
    gpom_params_t p = params_of(kKernels[random.below(5)]);
    p.gap_m = random.below(2) == 0 ? 0.1f : random.uniform_f(0.0, 2.0);
    p.depth_m = random.below(2) == 0 ? 0.0f : random.uniform_f(0.0, 1.0);
    p.n_hits = static_cast<std::uint16_t>(1 + random.below(9));
    p.n_free = static_cast<std::uint16_t>(1 + random.below(9));
    p.sn2_once = random.below(2) == 0 ? 0.0f : 3.0f * p.sn2;
    return p;
}

gpom_config_t random_config(Random &random)
{
    const std::uint32_t beam_max[] = {1 + random.below(20), 64 + random.below(400), 2000};
    gpom_config_t config = config_of(random_params(random), beam_max[random.below(3)]);
    config.keep_m = random.below(4) == 0 ? 0.0f : random.uniform_f(0.02, 0.5);
    config.clear_scans = config.keep_m > 0.0f && random.below(4) > 0 ? 2 + random.below(3) : 0;
    config.far_m = random.below(3) > 0 ? 0.0f : random.uniform_f(1.0, 50.0);
    config.old_s = random.below(3) > 0 ? 0.0f : random.uniform_f(0.1, 20.0);
    config.rebase_m = random.below(2) == 0 ? 0.0f : random.uniform_f(1.0, 30.0);
    config.origin_x_m = random.below(3) > 0 ? 0.0 : random.uniform(-1e5, 1e5);
    config.lowres_nx = static_cast<std::uint16_t>(1 + random.below(30));
    config.lowres_ny = static_cast<std::uint16_t>(1 + random.below(30));
    config.lowres_cell_m = random.uniform(0.3, 2.0);
    config.lowres_rolling = random.below(2) == 0 ? 0 : 1;
    config.lowres_x0_m = config.origin_x_m - random.uniform(0.0, 20.0);
    config.lowres_y0_m = -random.uniform(0.0, 20.0);
    config.focus_cell_max = random.below(2) == 0 ? 0 : 4 + random.below(900);
    return config;
}

/// Two maps to which the same happens, but that only the first is ever stepped or built.
struct Life {
    gpom_config_t config;
    TestMap worked, idle;
    Random &random;
    Xy robot;
    std::int64_t stamp_us = 0;

    Life(const gpom_config_t &made_for, Random &draws)
        : config(made_for), worked(made_for), idle(made_for),
          random(draws), robot{made_for.origin_x_m, 0.0}
    {
    }

    /// From a place to the hall's wall, or now and then to something else, or nothing.
    float range_from(Xy at, double yaw_rad)
    {
        if (random.below(12) == 0) {
            return random.below(3) == 0 ? kInf : random.uniform_f(0.05, 30.0);
        }
        const double dx = std::cos(yaw_rad), dy = std::sin(yaw_rad);
        const double x = at.x - config.origin_x_m;
        const double to_x_m = ((dx > 0.0 ? kHallX_m : -kHallX_m) - x) / dx;
        const double to_y_m = ((dy > 0.0 ? kHallY_m : -kHallY_m) - at.y) / dy;
        return static_cast<float>(std::min(to_x_m, to_y_m));
    }

    void drive_on()
    {
        const double towards = robot.x < config.origin_x_m + 20.0 ? 1.0 : -1.0;
        robot.x += towards * random.uniform(-0.5, random.below(6) == 0 ? 12.0 : 2.0);
        robot.x = std::clamp(robot.x, config.origin_x_m - 20.0, config.origin_x_m + 23.0);
        robot.y = std::clamp(robot.y + random.uniform(-1.0, 1.0), -10.0, 10.0);
        stamp_us += random.below(4) == 0 ? 0 : random.below(200000);
    }

    /// A scan, or a sweep whose sensor moves on.
    void see()
    {
        drive_on();
        TestSweep sweep;
        sweep.pose = {robot.x, robot.y, random.uniform(-3.0, 3.0), nullptr};
        sweep.stamp_us = stamp_us;
        sweep.sensor.range_max_m = 30.0f;
        const bool moves = random.below(3) == 0;
        const double first_rad = random.uniform(-3.0, 3.0), step_rad = random.uniform(0.005, 0.1);
        const std::uint32_t n = random.below(90);
        for (std::uint32_t i = 0; i < n; ++i) {
            gpom_pose_t own = sweep.pose;
            own.x_m += moves ? 0.02 * i : 0.0;
            const float bearing_rad = static_cast<float>(first_rad + step_rad * i);
            const double yaw_rad = own.yaw_rad + static_cast<double>(bearing_rad);
            sweep.add(range_from({own.x_m, own.y_m}, yaw_rad), bearing_rad, own);
        }
        for (TestMap *map : {&worked, &idle}) {
            REQUIRE(sweep.insert_into(map->get()) == GPOM_OK);
        }
    }

    gpom_disc_t disc(double radius_max_m)
    {
        return {robot.x + random.uniform(-10.0, 10.0), robot.y + random.uniform(-10.0, 10.0),
                random.uniform(0.05, radius_max_m)};
    }

    void forget()
    {
        const gpom_disc_t where = disc(6.0);
        for (TestMap *map : {&worked, &idle}) {
            REQUIRE(gpom_map_forget(map->get(), &where) == GPOM_OK);
        }
    }

    void jump()
    {
        const gpom_disc_t where = disc(3.0);
        const auto rule = static_cast<gpom_jump_t>(random.below(3));
        for (TestMap *map : {&worked, &idle}) {
            REQUIRE(gpom_map_jump(map->get(), rule, &where) == GPOM_OK);
        }
    }

    void look_closer()
    {
        const gpom_point_t path[2] = {{robot.x + random.uniform(-15.0, 15.0), robot.y},
                                      {robot.x, robot.y + random.uniform(-15.0, 15.0)}};
        const double half_width_m = random.uniform(0.0, 5.0);
        REQUIRE(gpom_lowres_focus(worked.get(), path, 1 + random.below(2), half_width_m,
                                  random.uniform(0.1, 1.0)) ==
                (config.focus_cell_max > 0 ? GPOM_OK : GPOM_ERR_MEM));
    }

    std::uint64_t work(std::uint64_t budget)
    {
        GuardedMemory memory(gpom_scratch_bytes(worked.get()), 1);
        const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
        std::uint64_t used = 0;
        REQUIRE(gpom_map_step(worked.get(), budget, &scratch, &used) == GPOM_OK);
        CHECK(used <= budget);
        return used;
    }

    void happen()
    {
        switch (random.below(20)) {
        case 0:
            return forget();
        case 1:
            return random.below(3) == 0 ? jump() : look_closer();
        case 2:
            REQUIRE(gpom_map_build(worked.get()) == GPOM_OK);
            return;
        case 3:
        case 4:
        case 5:
            work(random.below(1000000));
            return;
        default:
            return see();
        }
    }
};

/// Counters but of cells that were evaluated, and of segments: of a provisional beam that a scan
/// both clears and contradicts, which comes first depends on the trees.
bool same_counters(gpom_stats_t a, gpom_stats_t b)
{
    a.cells_cut = b.cells_cut;
    a.free_cleared = b.free_cleared;
    return std::memcmp(&a, &b, sizeof a) == 0;
}

void check_same(Life &life)
{
    REQUIRE(same_counters(life.worked.stats(), life.idle.stats()));
    const std::vector<gpom_beam_t> a = life.worked.beams(), b = life.idle.beams();
    REQUIRE(a.size() == b.size());
    REQUIRE((a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0));
    std::vector<gpom_point_t> points(20);
    for (gpom_point_t &point : points) {
        point = {life.robot.x + life.random.uniform(-15.0, 15.0),
                 life.robot.y + life.random.uniform(-15.0, 15.0)};
    }
    REQUIRE(same_bits(query_points(life.worked.get(), points).all,
                      query_points(life.idle.get(), points).all));
}

/// Cells of a layer that are not the query's answer, of those that are evaluated at all.
std::size_t n_wrong_cells(Life &life, std::uint32_t i_layer)
{
    const Raster raster = raster_of(life.worked.get(), i_layer);
    CHECK(raster.info.n_dirty == 0);
    const gpom_raster_t &r = raster.info.raster;
    std::vector<gpom_point_t> centres;
    std::vector<gpom_cell_t> cells;
    for (std::uint32_t i = 0; i < r.nx * r.ny; ++i) {
        const gpom_cell_t &cell = raster.cells[i];
        if (i_layer == GPOM_LAYER_COARSE || !is_unknown(cell, life.config.params)) {
            centres.push_back(
                {r.x0_m + (i % r.nx + 0.5) * r.cell_m, r.y0_m + (i / r.nx + 0.5) * r.cell_m});
            cells.push_back(cell);
        }
    }
    const Answers answers = query_points(life.worked.get(), centres);
    std::size_t n_wrong = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        // a centre's place in the raster and in the map frame may differ by a rounding
        const double asked = 65535.0 * static_cast<double>(answers.all[i].probability);
        n_wrong += std::abs(asked - cells[i].probability) > 1.0 ? 1u : 0u;
    }
    return n_wrong;
}

} // namespace

// Scans, sweeps, forgetting, jumps and an origin that follows: a map that is worked on at any time
// keeps the same beams in the same slots as one that never is, gives the same answers to the last
// bit, and once nothing is left to do every cell of its rasters is the query's answer.
TEST_CASE("when a map is worked on changes nothing, whatever happens to it" *
          doctest::test_suite("sanitized campaign"))
{
    GPOM_TELL_SEED();
    for (std::uint64_t i_life = 0; i_life < 120; ++i_life) {
        CAPTURE(i_life);
        Random random(900 + i_life);
        Life life(random_config(random), random);
        const std::uint32_t n_events = 20 + random.below(100);
        for (std::uint32_t i = 0; i < n_events; ++i) {
            CAPTURE(i);
            life.happen();
            check_same(life);
        }
        while (life.work(UINT64_C(5000000)) > 0) {
        }
        CHECK(n_wrong_cells(life, GPOM_LAYER_COARSE) == 0);
        CHECK(n_wrong_cells(life, GPOM_LAYER_FOCUS) == 0);
    }
}
