// Distances against a search of all cells.
#include "gpom/distances.h"
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

namespace
{

constexpr double kCell_m = 0.25;

/// A map whose cells the test sets, and its field.
struct Field {
    TestMap map;
    GuardedMemory memory;
    gpom_distances_t *field = nullptr;

    explicit Field(const gpom_config_t &config)
        : map(config), memory(GPOM_DISTANCES_BYTES(config.lowres_nx, config.lowres_ny))
    {
        REQUIRE(gpom_distances_init(&field, map.get(), memory.mem(), memory.bytes()) == GPOM_OK);
    }
    ~Field() { CHECK(memory.is_intact()); }
    Field(const Field &) = delete;
    Field &operator=(const Field &) = delete;

    gpom::Lowres &lowres() { return map.get()->lowres; }
    gpom::Layer &layer() { return lowres().layers[GPOM_LAYER_COARSE]; }
    void set(std::uint32_t slot, std::uint32_t cls) { layer().cells[slot].value = cls << 24; }

    gpom_distances_info_t info() const
    {
        gpom_distances_info_t info;
        REQUIRE(gpom_distances_info(field, &info) == GPOM_OK);
        return info;
    }
    /// One call. Returns the operations.
    std::uint64_t step(std::uint64_t budget)
    {
        std::uint64_t used = 0;
        CHECK(gpom_distances_step(field, map.get(), budget, &used) == GPOM_OK);
        CHECK(used <= budget);
        return used;
    }
    std::vector<gpom_offsets_t> copy() const
    {
        gpom_distances_info_t info_now = info();
        std::vector<gpom_offsets_t> offsets(info_now.raster.nx * info_now.raster.ny);
        CHECK(gpom_distances_copy(field, offsets.data(), std::uint32_t(offsets.size()),
                                  &info_now) == GPOM_OK);
        return offsets;
    }
};

struct Cell {
    int ix, iy;
};

/// Cells of the copied raster for which `is_target` is true of their class.
template <class Fn> std::vector<Cell> cells_where(const Raster &raster, Fn is_target)
{
    std::vector<Cell> cells;
    for (std::uint32_t iy = 0; iy < raster.info.raster.ny; ++iy) {
        for (std::uint32_t ix = 0; ix < raster.info.raster.nx; ++ix) {
            if (is_target(raster.at(ix, iy).cls)) {
                cells.push_back({int(ix), int(iy)});
            }
        }
    }
    return cells;
}

bool is_one_of(const std::vector<Cell> &cells, int ix, int iy)
{
    return std::any_of(cells.begin(), cells.end(),
                       [&](const Cell &c) { return c.ix == ix && c.iy == iy; });
}

/// True if an offset leads to a target, and to none that is farther than another.
bool is_nearest(const std::vector<Cell> &targets, int ix, int iy, int dx, int dy)
{
    if (dx == GPOM_OFFSET_NONE || dy == GPOM_OFFSET_NONE) {
        return dx == dy && targets.empty();
    }
    int least = INT32_MAX;
    for (const Cell &c : targets) {
        least = std::min(least, (c.ix - ix) * (c.ix - ix) + (c.iy - iy) * (c.iy - iy));
    }
    return dx * dx + dy * dy == least && is_one_of(targets, ix + dx, iy + dy);
}

void check_every_cell(const Field &f, const gpom_map_t *map)
{
    const Raster raster = raster_of(map);
    const std::vector<gpom_offsets_t> offsets = f.copy();
    const auto occupied = cells_where(raster, [](int cls) { return cls == GPOM_OCCUPIED; });
    const auto not_free = cells_where(raster, [](int cls) { return cls != GPOM_FREE; });
    std::size_t n_wrong = 0;
    const int nx = int(raster.info.raster.nx);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
        const int ix = int(i) % nx, iy = int(i) / nx;
        const gpom_offsets_t &o = offsets[i];
        n_wrong += is_nearest(occupied, ix, iy, o.occupied_dx, o.occupied_dy) ? 0u : 1u;
        n_wrong += is_nearest(not_free, ix, iy, o.not_free_dx, o.not_free_dy) ? 0u : 1u;
    }
    CHECK(n_wrong == 0);
}

/// Change some cells, or many, or move the window.
void change(Field &f, Random &random)
{
    const std::uint32_t n_cells = f.layer().cell_max;
    const std::uint32_t kind = random.below(10);
    if (kind == 0) {
        gpom::lowres_follow(f.lowres(), {random.uniform_f(-3, 3), random.uniform_f(-3, 3)}, 0);
    }
    const std::uint32_t n = kind < 6 ? 1 + random.below(4) : random.below(n_cells);
    const std::uint32_t n_kinds = kind == 9 ? 1 : 4; // now and then all that changes becomes free
    for (std::uint32_t i = 0; i < n; ++i) {
        f.set(random.below(n_cells), random.below(n_kinds));
    }
    gpom::lowres_count_change(f.lowres());
}

/// Steps until the field has seen the last change and swept all of it.
void settle(Field &f, Random &random, std::uint64_t least)
{
    gpom_lowres_info_t map_info;
    REQUIRE(gpom_lowres_info(f.map.get(), GPOM_LAYER_COARSE, &map_info) == GPOM_OK);
    for (int n_steps = 0; n_steps < 10000; ++n_steps) {
        (void)f.step(least + random.below(3000));
        if (f.info().map_sequence == map_info.map_sequence && f.info().n_left == 0) {
            return;
        }
    }
    FAIL("the field never settles");
}

} // namespace

// 1,000 changes of one raster and 100 of others, from one cell to all of them, in slices of any
// size. The window moves, too.
TEST_CASE("distances equal a search of all cells in every cell after each change")
{
    GPOM_TELL_SEED();
    Random random(741);
    constexpr std::uint16_t kSides[][2] = {{24, 17}, {1, 30}, {30, 1}, {9, 40}};
    for (const auto &side : kSides) {
        Field f(rolling_config(side[0], side[1], kCell_m));
        for (std::uint32_t i = 0; i < f.layer().cell_max; ++i) {
            f.set(i, random.below(20) == 0 ? 1 + random.below(3) : 0);
        }
        const int n_changes = side[0] == 24 ? 1000 : 100;
        for (int i = 0; i < n_changes; ++i) {
            change(f, random);
            settle(f, random, GPOM_DISTANCES_OPS_MIN(side[0], side[1]));
            check_every_cell(f, f.map.get());
        }
    }
}

// A change between two calls of one pass is not lost.
TEST_CASE("cells may change between any two slices")
{
    GPOM_TELL_SEED();
    Random random(742);
    Field f(rolling_config(20, 20, kCell_m));
    for (int round = 0; round < 100; ++round) {
        for (int i = 0; i < 30; ++i) {
            change(f, random);
            (void)f.step(GPOM_DISTANCES_OPS_MIN(20, 20));
        }
        gpom::lowres_count_change(f.lowres());
        settle(f, random, GPOM_DISTANCES_OPS_MIN(20, 20));
        check_every_cell(f, f.map.get());
    }
}

TEST_CASE("the distance at a point and its gradient are those of its cell")
{
    Field f(lowres_config(20, 16, kCell_m));
    for (std::uint32_t i = 0; i < f.layer().cell_max; ++i) {
        f.set(i, GPOM_FREE);
    }
    (void)f.step(UINT64_MAX);
    const gpom_raster_t r = f.info().raster;
    const gpom_point_t point = {r.x0_m + 7.7 * kCell_m, r.y0_m + 9.2 * kCell_m};
    gpom_distance_t occupied, not_free;
    REQUIRE(gpom_distances_at(f.field, &point, &occupied, &not_free) == GPOM_OK);
    CHECK(std::isinf(occupied.distance_m));
    CHECK(occupied.grad_x == 0.0f);
    f.set(5 * 20 + 10, GPOM_OCCUPIED); // three to the right and four below
    f.set(9 * 20 + 6, GPOM_UNKNOWN);   // one to the left
    (void)f.step(UINT64_MAX);
    REQUIRE(gpom_distances_at(f.field, &point, &occupied, &not_free) == GPOM_OK);
    CHECK(occupied.distance_m == doctest::Approx(5 * kCell_m));
    CHECK(occupied.grad_x == doctest::Approx(-0.6));
    CHECK(occupied.grad_y == doctest::Approx(0.8));
    CHECK(not_free.distance_m == doctest::Approx(kCell_m));
    CHECK(not_free.grad_x == doctest::Approx(1.0));
    CHECK(not_free.grad_y == 0.0f);
    const gpom_point_t outside = {r.x0_m - 0.01, r.y0_m};
    CHECK(gpom_distances_at(f.field, &outside, nullptr, nullptr) == GPOM_ERR_REACH);
}

TEST_CASE("a field needs a raster, its memory and its own map")
{
    TestMap bare(config_of(params_of(GPOM_KERNEL_MATERN12)));
    TestMap map(lowres_config(20, 16, kCell_m));
    GuardedMemory memory(GPOM_DISTANCES_BYTES(20, 16));
    gpom_distances_t *field = nullptr;
    CHECK(gpom_distances_init(&field, bare.get(), memory.mem(), memory.bytes()) == GPOM_ERR_ARG);
    CHECK(gpom_distances_init(&field, nullptr, memory.mem(), memory.bytes()) == GPOM_ERR_ARG);
    CHECK(gpom_distances_init(&field, map.get(), nullptr, 1u << 20) == GPOM_ERR_MEM);
    CHECK(gpom_distances_init(&field, map.get(), memory.mem(), 8u * 20 * 16) == GPOM_ERR_MEM);
    CHECK(field == nullptr);
    REQUIRE(gpom_distances_init(&field, map.get(), memory.mem(), memory.bytes()) == GPOM_OK);
    TestMap other(lowres_config(16, 20, kCell_m));
    CHECK(gpom_distances_step(field, other.get(), 1000000, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_distances_step(nullptr, map.get(), 1000000, nullptr) == GPOM_ERR_ARG);
    gpom_offsets_t offsets;
    gpom_distances_info_t info;
    CHECK(gpom_distances_cell(field, 20, 0, &offsets) == GPOM_ERR_ARG);
    CHECK(gpom_distances_cell(field, 0, 16, &offsets) == GPOM_ERR_ARG);
    CHECK(gpom_distances_copy(field, &offsets, 1, &info) == GPOM_ERR_MEM);
    CHECK(info.raster.nx == 20);
    CHECK(memory.is_intact());
}
