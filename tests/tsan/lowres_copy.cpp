// Copies of the low-resolution map beside the thread that works on it, for ThreadSanitizer: any
// unordered access ends the program. What is copied is checked against what lowres.h promises.
// Returns 0 if all holds.
#include "gpom/gpom.h"
#include "src/map/map.hpp"
#include "src/refresh/lowres_step.hpp"

#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace
{

constexpr double kCell_m = 0.5;
constexpr int kScans = 150;
constexpr int kRanges = 40;
constexpr int kMoves = 4000;

std::atomic<bool> is_done{false};
std::atomic<int> n_failed{0};

void expect(bool holds, const char *what)
{
    if (!holds && n_failed++ == 0) {
        std::fprintf(stderr, "lowres_copy: does not hold: %s\n", what);
    }
}

struct SharedMap {
    std::vector<std::uint64_t> memory, scratch_memory;
    gpom_map_t *map = nullptr;

    SharedMap()
    {
        gpom_config_t config;
        gpom_config_init(&config);
        config.beam_max = kScans * kRanges;
        config.lowres_nx = 48;
        config.lowres_ny = 32;
        config.lowres_cell_m = kCell_m;
        config.lowres_rolling = 1;
        config.focus_cell_max = 600;
        memory.resize(gpom_map_bytes(&config) / 8 + 1);
        expect(gpom_map_init(&map, &config, memory.data(), memory.size() * 8) == GPOM_OK, "a map");
        scratch_memory.resize(gpom_scratch_bytes(map) / 8 + 1);
    }
    gpom_scratch_t scratch() { return {scratch_memory.data(), scratch_memory.size() * 8}; }
};

/// At 10 Hz, but every 60th time two months have passed.
std::int64_t stamp_us(int i) { return 100000 * i + i / 60 * INT64_C(60) * 86400 * 1000000; }

void insert_scan(gpom_map_t *map, int i)
{
    std::vector<float> ranges_m;
    for (int j = 0; j < kRanges; ++j) {
        ranges_m.push_back(4.0f + 3.0f * static_cast<float>(std::sin(0.7 * i + 0.3 * j)));
    }
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    const gpom_pose_t pose = {10.0 * std::sin(0.1 * i), 0.3 * i, 0.2 * i, nullptr};
    const gpom_scan_t scan = {stamp_us(i), -3.0, 0.15, ranges_m.data(), kRanges};
    expect(gpom_scan_insert(map, &scan, &sensor, &pose) == GPOM_OK, "a scan is taken");
}

/// The mapping thread as it is: scans, steps, now and then another focus, a clearing, an epoch.
void drive(SharedMap &shared)
{
    gpom_map_t *const map = shared.map;
    for (int i = 0; i < kScans; ++i) {
        insert_scan(map, i);
        gpom::lowres_step(*map, shared.scratch(), 400000);
        if (i % 5 == 4) {
            const gpom_point_t path[] = {{0.1 * i, 0.3 * i}, {4.0, 0.3 * i + 3.0}};
            expect(gpom_lowres_focus(map, path, 2, 1.0, 0.2) == GPOM_OK, "a focus is taken");
        }
        if (i % 50 == 49) {
            expect(gpom_map_jump(map, GPOM_JUMP_CLEAR, nullptr) == GPOM_OK, "the frame may jump");
        }
    }
    is_done = true;
}

struct Copy {
    std::vector<gpom_cell_t> cells = std::vector<gpom_cell_t>(48 * 32);
    gpom_lowres_info_t info = {};
    bool is_taken = false;
};

void take(Copy &copy, const gpom_map_t *map, std::uint32_t layer)
{
    const gpom_status_t status = gpom_lowres_copy(
        map, layer, copy.cells.data(), static_cast<std::uint32_t>(copy.cells.size()), &copy.info);
    expect(status == GPOM_OK || status == GPOM_ERR_BUSY, "a copy is taken, or it is busy");
    copy.is_taken = status == GPOM_OK;
}

std::int32_t first_number(double corner_m, double cell_m)
{
    const double number = corner_m / cell_m;
    expect(std::abs(number - std::round(number)) < 1e-6, "corners are whole multiples of a cell");
    return static_cast<std::int32_t>(std::lround(number));
}

void check_plausible(const Copy &copy)
{
    const gpom_raster_t &r = copy.info.raster;
    (void)first_number(r.x0_m, r.cell_m);
    (void)first_number(r.y0_m, r.cell_m);
    for (std::size_t i = 0; i < std::size_t{r.nx} * r.ny; ++i) {
        const gpom_cell_t &cell = copy.cells[i];
        const std::int64_t cell_us = copy.info.stamp0_us + INT64_C(1000) * cell.stamp_ms;
        expect(cell_us <= stamp_us(kScans), "no stamp is newer than the last scan");
        expect(cell.cls != GPOM_UNKNOWN || cell.variance >= 242, "unknown is vague");
        expect(cell.cls != GPOM_FREE || cell.probability < 32768, "free is improbable");
        expect(cell.cls != GPOM_OCCUPIED || cell.probability > 32768, "occupied is probable");
    }
}

/// Sectors, too, are read beside the mapping thread.
void look_about(const gpom_map_t *map)
{
    const gpom_lookout_t lookout = {1.0, 2.0, 0.5, 20.0f, 0.5f};
    gpom_sector_t sectors[16];
    const gpom_status_t status = gpom_sectors(map, &lookout, sectors, 16, nullptr);
    expect(status == GPOM_OK || status == GPOM_ERR_REACH || status == GPOM_ERR_BUSY,
           "sectors are read, or it is busy");
    for (const gpom_sector_t &sector : sectors) {
        expect(status == GPOM_ERR_BUSY || sector.distance_m <= 20.0f,
               "no sector exceeds the range");
    }
}

int read_along(const gpom_map_t *map, std::uint32_t layer)
{
    int n_copies = 0;
    std::uint32_t epoch = 0;
    Copy copy;
    while (!is_done) {
        take(copy, map, layer);
        look_about(map);
        if (copy.is_taken) {
            ++n_copies;
            check_plausible(copy);
            expect(copy.info.frame_epoch >= epoch, "epochs grow");
            epoch = copy.info.frame_epoch;
        }
    }
    return n_copies;
}

/// A value that tells where its cell lies in the map frame; the stamp tells the same.
std::uint32_t value_of_place(std::int32_t ix, std::int32_t iy)
{
    return static_cast<std::uint32_t>(ix * 131 + iy) & 0xffff;
}

/// Nothing but moves, with cells that tell where they lie, written as an evaluation writes them.
void move_about(SharedMap &shared)
{
    gpom::Lowres &lowres = shared.map->lowres;
    gpom::Layer &layer = lowres.layers[GPOM_LAYER_COARSE];
    for (int i = 0; i < kMoves; ++i) {
        const float x_m = 40.0f * static_cast<float>(std::sin(0.003 * i));
        gpom::lowres_follow(lowres, {x_m, -0.7f * x_m}, 0);
        const gpom::Window &w = layer.window;
        for (std::int32_t iy = w.iy0; iy < w.iy0 + static_cast<std::int32_t>(w.ny); ++iy) {
            for (std::int32_t ix = w.ix0; ix < w.ix0 + static_cast<std::int32_t>(w.nx); ++ix) {
                gpom::Cell &cell = layer.cells[gpom::slot_of(w, ix, iy)];
                gpom::store(cell.value, value_of_place(ix, iy));
                gpom::store(cell.stamp_ms, value_of_place(ix, iy) + 1);
            }
        }
    }
    is_done = true;
}

void check_places(const Copy &copy)
{
    const gpom_raster_t &r = copy.info.raster;
    const std::int32_t ix0 = first_number(r.x0_m, r.cell_m);
    const std::int32_t iy0 = first_number(r.y0_m, r.cell_m);
    for (std::uint32_t i = 0; i < r.nx * r.ny; ++i) {
        const gpom_cell_t &cell = copy.cells[i];
        const std::uint32_t expected = value_of_place(ix0 + static_cast<std::int32_t>(i % r.nx),
                                                      iy0 + static_cast<std::int32_t>(i / r.nx));
        const bool is_blank = cell.cls == GPOM_UNKNOWN && cell.stamp_ms == 0;
        expect(is_blank || cell.probability == expected, "a cell lies where the raster says");
        expect(cell.stamp_ms == 0 || (cell.stamp_ms == expected + 1 && !is_blank),
               "a stamp is its cell's and comes after its value");
    }
}

int read_places(const gpom_map_t *map)
{
    int n_copies = 0;
    Copy copy;
    while (!is_done) {
        take(copy, map, GPOM_LAYER_COARSE);
        if (copy.is_taken) {
            ++n_copies;
            check_places(copy);
        }
    }
    return n_copies;
}

/// One writer and two readers until the writer is done; copies taken.
template <class Writer, class First, class Second>
int run(Writer writer, First first, Second second)
{
    is_done = false;
    int n_first = 0, n_second = 0;
    std::thread reader_a([&] { n_first = first(); });
    std::thread reader_b([&] { n_second = second(); });
    std::thread mapping([&] { writer(); });
    mapping.join();
    reader_a.join();
    reader_b.join();
    expect(n_first > 0 && n_second > 0, "both readers got copies");
    return n_first + n_second;
}

} // namespace

int main()
{
    SharedMap driven;
    const int n_driven =
        run([&] { drive(driven); }, [&] { return read_along(driven.map, GPOM_LAYER_COARSE); },
            [&] { return read_along(driven.map, GPOM_LAYER_FOCUS); });
    SharedMap moved;
    const int n_moved = run([&] { move_about(moved); }, [&] { return read_places(moved.map); },
                            [&] { return read_places(moved.map); });
    std::printf("%d copies while mapping, %d while moving\n", n_driven, n_moved);
    return n_failed == 0 ? 0 : 1;
}
