// Keeping up distances: gpom_distances_step() and dynamicEDT3D (B. Lau, C. Sprunk, W. Burgard,
// 2013) after the same changes of the same raster, on one core, in turn in one run. Both keep the
// distances to occupied cells and to cells that are not free. Times are of the thread's processor.
//
// usage: bench-distances PARAMS.toml [SCANS.log] [CELL_M]
//        Without a log, the scans are those of a simulated street.
#include "ports/host/params_toml.hpp"
#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <dynamicEDT3D/dynamicEDT3D.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <vector>

using namespace gpom_tools;

namespace
{

constexpr std::uint32_t kSideMax = 512;

double processor_s()
{
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void require(gpom_status_t status)
{
    if (status != GPOM_OK) {
        throw std::runtime_error(gpom_status_str(status));
    }
}

bool is_target(const gpom_cell_t &cell, int kind)
{
    return kind == 0 ? cell.cls == GPOM_OCCUPIED : cell.cls != GPOM_FREE;
}

/// dynamicEDT3D for one kind of target, without a limit of the distance.
class Rival {
public:
    Rival(int nx, int ny) : edt_(nx * nx + ny * ny + 1) { edt_.initializeEmpty(nx, ny, 1); }
    void change(int ix, int iy, bool is_target)
    {
        is_target ? edt_.occupyCell(ix, iy, 0) : edt_.clearCell(ix, iy, 0);
    }
    void update() { edt_.update(); }
    int square(int ix, int iy) const { return edt_.getSQCellDistance(ix, iy, 0); }

private:
    DynamicEDT3D edt_;
};

/// The library's field of a map.
class Ours {
public:
    Ours(const HostMap &map, std::size_t nx, std::size_t ny)
        : map_(map), memory_(GPOM_DISTANCES_BYTES(nx, ny) / 8 + 1)
    {
        require(gpom_distances_init(&field_, map.get(), memory_.data(), 8 * memory_.size()));
    }
    void update() { require(gpom_distances_step(field_, map_.get(), UINT64_MAX, nullptr)); }
    int square(int ix, int iy, int kind) const
    {
        gpom_offsets_t o;
        require(gpom_distances_cell(field_, static_cast<std::uint32_t>(ix),
                                    static_cast<std::uint32_t>(iy), &o));
        const int dx = kind == 0 ? o.occupied_dx : o.not_free_dx;
        const int dy = kind == 0 ? o.occupied_dy : o.not_free_dy;
        return dx * dx + dy * dy;
    }

private:
    const HostMap &map_;
    std::vector<std::uint64_t> memory_;
    gpom_distances_t *field_ = nullptr;
};

std::vector<Scan> street_scans()
{
    StreetConfig street;
    street.n_scans = 400;
    street.step_m = 0.5;
    street.n_beams = 181;
    return simulate_scans(make_street_world(street), street, {});
}

gpom_config_t config_of(const gpom_params_t &params, const std::vector<Scan> &scans, double cell_m)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (const Scan &scan : scans) {
        low[0] = std::min(low[0], scan.x_m), high[0] = std::max(high[0], scan.x_m);
        low[1] = std::min(low[1], scan.y_m), high[1] = std::max(high[1], scan.y_m);
    }
    gpom_config_t config = live_config(params, {}, middle_of(scans));
    config.lowres_cell_m = cell_m;
    std::uint16_t *const sides[2] = {&config.lowres_nx, &config.lowres_ny};
    double *const corners[2] = {&config.lowres_x0_m, &config.lowres_y0_m};
    for (int i = 0; i < 2; ++i) { // 15 m about all places, as far as it fits
        const double cells = std::ceil((high[i] - low[i] + 30.0) / cell_m);
        *sides[i] = static_cast<std::uint16_t>(std::min<double>(cells, kSideMax));
        *corners[i] = 0.5 * (low[i] + high[i] - *sides[i] * cell_m);
    }
    return config;
}

struct Totals {
    double ours_s = 0.0, rival_s = 0.0;
    std::size_t n_updates = 0, n_changes = 0, n_faster = 0, n_different = 0;
};

/// Both sides after the changes of one scan.
void compare(const std::vector<gpom_cell_t> &before, const std::vector<gpom_cell_t> &after, int nx,
             Ours &ours, Rival (&rivals)[2], Totals &totals)
{
    std::size_t n_changes = 0;
    const double start_s = processor_s();
    ours.update();
    const double ours_s = processor_s() - start_s;
    double rival_s = 0.0;
    for (int kind = 0; kind < 2; ++kind) {
        std::vector<std::size_t> changed; // found before the time is taken
        for (std::size_t i = 0; i < after.size(); ++i) {
            if (before.empty() ? is_target(after[i], kind)
                               : is_target(before[i], kind) != is_target(after[i], kind)) {
                changed.push_back(i);
            }
        }
        n_changes += changed.size();
        const double begin_s = processor_s();
        for (const std::size_t i : changed) {
            const int cell = static_cast<int>(i);
            rivals[kind].change(cell % nx, cell / nx, is_target(after[i], kind));
        }
        rivals[kind].update();
        rival_s += processor_s() - begin_s;
    }
    if (!before.empty() && n_changes > 0) { // the first update fills an empty map
        totals.ours_s += ours_s, totals.rival_s += rival_s;
        totals.n_updates += 1, totals.n_changes += n_changes;
        totals.n_faster += ours_s < rival_s ? 1u : 0u;
    }
}

std::size_t count_different(const Ours &ours, const Rival (&rivals)[2], int nx, int ny)
{
    std::size_t n = 0;
    for (int i = 0; i < nx * ny; ++i) {
        for (int kind = 0; kind < 2; ++kind) {
            n += ours.square(i % nx, i / nx, kind) != rivals[kind].square(i % nx, i / nx) ? 1u : 0u;
        }
    }
    return n;
}

void run(const gpom_params_t &params, const std::vector<Scan> &scans, double cell_m)
{
    const gpom_config_t config = config_of(params, scans, cell_m);
    HostMap map(config);
    const int nx = config.lowres_nx, ny = config.lowres_ny;
    Ours ours(map, config.lowres_nx, config.lowres_ny);
    Rival rivals[2] = {{nx, ny}, {nx, ny}};
    Totals totals;
    std::vector<gpom_cell_t> before;
    for (std::size_t i = 0; i < scans.size(); ++i) {
        map.insert(scans[i]);
        (void)map.step(20'000'000);
        std::vector<gpom_cell_t> after = map.cells();
        compare(before, after, nx, ours, rivals, totals);
        before = std::move(after);
        if (i % 50 == 49) {
            totals.n_different += count_different(ours, rivals, nx, ny);
        }
    }
    const double n = static_cast<double>(totals.n_updates);
    std::printf("raster %d x %d, cells of %.2f m\n", nx, ny, cell_m);
    std::printf("updates %zu, changed cells an update %.1f\n", totals.n_updates,
                static_cast<double>(totals.n_changes) / n);
    std::printf("gpom_distances_step %.1f us an update, dynamicEDT3D %.1f us: ratio %.3f\n",
                1e6 * totals.ours_s / n, 1e6 * totals.rival_s / n, totals.ours_s / totals.rival_s);
    std::printf("faster in %zu of %zu updates; distances that differ at every 50th scan: %zu\n",
                totals.n_faster, totals.n_updates, totals.n_different);
}

} // namespace

int main(int argc, char **argv)
{
    if (argc < 2 || argc > 4) {
        std::fprintf(stderr, "usage: bench-distances PARAMS.toml [SCANS.log] [CELL_M]\n");
        return 2;
    }
    try {
        const gpom_params_t params = read_params(argv[1]);
        const bool has_log = argc > 2 && argv[2][0] != '\0';
        run(params, has_log ? read_scans(argv[2], {}) : street_scans(),
            argc > 3 ? std::atof(argv[3]) : 0.25);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bench-distances: %s\n", error.what());
        return 1;
    }
    return 0;
}
