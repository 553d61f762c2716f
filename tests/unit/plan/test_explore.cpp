// Exploration against a flood of its own.
#include "tests/common/lowres_fixture.hpp"

#include <map>

using namespace reference;

namespace
{

struct Goals {
    std::vector<gpom_goal_t> all;
    gpom_status_t status;
};

Goals explore(const gpom_map_t *map, gpom_point_t from, std::uint32_t n_goals_max)
{
    gpom_lowres_info_t info;
    REQUIRE(gpom_lowres_info(map, GPOM_LAYER_COARSE, &info) == GPOM_OK);
    GuardedMemory memory(GPOM_EXPLORE_BYTES(info.raster.nx, info.raster.ny), 1);
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    Goals goals = {std::vector<gpom_goal_t>(n_goals_max), GPOM_OK};
    gpom_goals_t list = {goals.all.data(), n_goals_max, 77};
    goals.status = gpom_explore(map, &from, &list, &scratch);
    goals.all.resize(list.n_goals);
    CHECK(memory.is_intact());
    return goals;
}

/// All goals in order: relaxation over the whole raster until no number of steps falls.
std::vector<gpom_goal_t> brute_force(const Raster &raster, std::uint32_t start)
{
    const std::uint32_t nx = raster.info.raster.nx;
    const std::uint32_t n_cells = nx * raster.info.raster.ny;
    std::vector<std::uint32_t> steps(n_cells, UINT32_MAX);
    steps[start] = 0;
    for (bool is_changed = true; is_changed;) {
        is_changed = false;
        for (std::uint32_t i = 0; i < n_cells; ++i) {
            const bool is_passable = i == start || raster.cells[i].cls == GPOM_FREE;
            for (std::uint32_t j = 0; j < n_cells && is_passable; ++j) {
                const std::uint32_t dx = i % nx > j % nx ? i % nx - j % nx : j % nx - i % nx;
                const std::uint32_t dy = i / nx > j / nx ? i / nx - j / nx : j / nx - i / nx;
                if (dx + dy == 1 && steps[i] != UINT32_MAX && steps[i] + 1 < steps[j]) {
                    steps[j] = steps[i] + 1;
                    is_changed = true;
                }
            }
        }
    }
    std::map<std::tuple<int, std::uint32_t, std::uint32_t>, gpom_goal_t> ranked;
    for (std::uint32_t i = 0; i < n_cells; ++i) {
        const gpom_cell_t &cell = raster.cells[i];
        if (i != start && steps[i] != UINT32_MAX && cell.cls != GPOM_OCCUPIED) {
            ranked[{-cell.variance, steps[i], i}] = {i % nx, i / nx, steps[i], cell.variance,
                                                     cell.cls};
        }
    }
    std::vector<gpom_goal_t> goals;
    for (const auto &entry : ranked) {
        goals.push_back(entry.second);
    }
    return goals;
}

bool same_goals(const std::vector<gpom_goal_t> &a, const std::vector<gpom_goal_t> &b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const gpom_goal_t &g, const gpom_goal_t &h) {
                          return g.ix == h.ix && g.iy == h.iy && g.n_steps == h.n_steps &&
                                 g.variance == h.variance && g.cls == h.cls;
                      });
}

/// Cells of random classes and variances, many of them alike.
void scatter(gpom_map_t *map, Random &random, std::uint32_t percent_free)
{
    const gpom::Layer &layer = map->lowres.layers[GPOM_LAYER_COARSE];
    for (std::uint32_t i = 0; i < layer.cell_max; ++i) {
        const std::uint32_t other = 1 + random.below(3);
        const std::uint32_t cls = random.below(100) < percent_free ? 0 : other;
        layer.cells[i].value = cls << 24 | random.below(6) << 16;
    }
}

} // namespace

// Goals, their steps and their order equal a brute-force flood, on mazes of any density, wherever
// the window lies in its torus.
TEST_CASE("goals equal a brute-force flood")
{
    GPOM_TELL_SEED();
    Random random(310);
    for (int round = 0; round < 40; ++round) {
        TestMap map(rolling_config(17, 11, 1.0));
        gpom::lowres_follow(map.get()->lowres,
                            {random.uniform_f(-30, 30), random.uniform_f(-30, 30)}, 0);
        scatter(map.get(), random, 30 + 10 * random.below(7));
        const Raster raster = raster_of(map.get());
        const std::uint32_t start = random.below(17 * 11);
        const gpom_raster_t &r = raster.info.raster;
        const gpom_point_t from = {r.x0_m + start % 17 + 0.5, r.y0_m + start / 17 + 0.5};
        std::vector<gpom_goal_t> expected = brute_force(raster, start);
        const Goals all = explore(map.get(), from, 17 * 11);
        CHECK(all.status == GPOM_OK);
        CHECK(same_goals(all.all, expected));
        expected.resize(std::min<std::size_t>(expected.size(), 5));
        CHECK(same_goals(explore(map.get(), from, 5).all, expected));
    }
}

// In a map made of scans the best goal is the nearest end of the known world.
TEST_CASE("the best goal lies where the map knows least")
{
    TestMap map(lowres_config());
    drive(map.get(), 311, 4);
    settle(map.get());
    const gpom_beam_t beam = map.beams()[0];
    const Goals goals = explore(map.get(), {beam.x_m, beam.y_m}, 10);
    REQUIRE(goals.all.size() == 10);
    const Raster raster = raster_of(map.get());
    for (const gpom_goal_t &goal : goals.all) {
        CHECK(goal.cls != GPOM_OCCUPIED);
        CHECK(goal.variance == raster.at(goal.ix, goal.iy).variance);
        CHECK(goal.variance <= goals.all[0].variance);
    }
}

// Each wrong argument is refused, and the list is empty then.
TEST_CASE("wrong arguments of exploration are refused")
{
    TestMap map(lowres_config(5, 4, 1.0));
    gpom_goal_t goal;
    std::vector<unsigned char> mem(GPOM_EXPLORE_BYTES(5, 4));
    const gpom_scratch_t scratch = {mem.data(), mem.size()};
    const gpom_scratch_t short_scratch = {mem.data(), mem.size() - 1};
    const gpom_point_t from = {6.3, 0.2};
    const gpom_point_t outside = {1e300, 0.2};
    const auto check = [](gpom_status_t status, const gpom_goals_t &list, gpom_status_t expected) {
        CHECK(status == expected);
        CHECK(list.n_goals == 0);
    };
    gpom_goals_t list = {&goal, 1, 9};
    check(gpom_explore(nullptr, &from, &list, &scratch), list, GPOM_ERR_ARG);
    check(gpom_explore(map.get(), nullptr, &list, &scratch), list, GPOM_ERR_ARG);
    check(gpom_explore(map.get(), &from, &list, nullptr), list, GPOM_ERR_ARG);
    check(gpom_explore(map.get(), &from, &list, &short_scratch), list, GPOM_ERR_MEM);
    check(gpom_explore(map.get(), &outside, &list, &scratch), list, GPOM_ERR_REACH);
    CHECK(gpom_explore(map.get(), &from, nullptr, &scratch) == GPOM_ERR_ARG);
    list = {nullptr, 1, 9};
    check(gpom_explore(map.get(), &from, &list, &scratch), list, GPOM_ERR_ARG);
    list = {&goal, 0, 9};
    check(gpom_explore(map.get(), &from, &list, &scratch), list, GPOM_ERR_ARG);
    TestMap without(config_of(params_of(GPOM_KERNEL_MATERN12)));
    list = {&goal, 1, 9};
    check(gpom_explore(without.get(), &from, &list, &scratch), list, GPOM_ERR_ARG);
}
