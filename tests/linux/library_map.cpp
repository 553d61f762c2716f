// library-map: what the library makes of scans with the configuration of gpomd: the oracle of its
// tests, without daemon, threads and messages.
//
// usage: library-map CONFIG SCANS CELLS [X Y]...
// Inserts the scans in order, with one gpom_map_step() of the configured budget after each, then
// steps until nothing is left to do. Writes probability and variance-class codes of all cells to
// CELLS, by rows; prints "mean variance probability class" of each point.
#include "ports/host/command_line.hpp"
#include "ports/host/scan_log.hpp"
#include "ports/linux/config/config.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{

void require(gpom_status_t status)
{
    if (status != GPOM_OK) {
        throw std::runtime_error(gpom_status_str(status));
    }
}

/// A map with memory from the heap.
struct LibraryMap {
    explicit LibraryMap(const gpomd::Config &config)
        : memory(gpom_map_bytes(&config.map) / 8 + 1), budget(config.step_ops)
    {
        require(gpom_map_init(&map, &config.map, memory.data(), 8 * memory.size()));
        scratch_memory.resize(gpom_scratch_bytes(map));
        scratch = {scratch_memory.data(), scratch_memory.size()};
    }

    std::uint64_t step()
    {
        std::uint64_t n_used = 0;
        require(gpom_map_step(map, budget, &scratch, &n_used));
        return n_used;
    }

    std::vector<std::uint64_t> memory;
    std::vector<std::uint8_t> scratch_memory;
    std::uint64_t budget;
    gpom_map_t *map = nullptr;
    gpom_scratch_t scratch = {};
};

void insert(LibraryMap &library, const gpomd::Config &config, const gpom_tools::Scan &scan)
{
    const gpom_pose_t pose = {scan.x_m, scan.y_m, scan.theta_rad, nullptr};
    const gpom_scan_t readings = {std::llround(1e6 * scan.t_s), scan.angle_min_rad,
                                  scan.angle_step_rad, scan.ranges_m.data(),
                                  static_cast<std::uint32_t>(scan.ranges_m.size())};
    require(gpom_scan_insert(library.map, &readings, &config.sensors[0].sensor, &pose));
}

void write_cells(const LibraryMap &library, const gpom_config_t &config, const char *path)
{
    std::vector<gpom_cell_t> cells(std::size_t{config.lowres_nx} * config.lowres_ny);
    gpom_lowres_info_t info;
    require(gpom_lowres_copy(library.map, GPOM_LAYER_COARSE, cells.data(),
                             static_cast<std::uint32_t>(cells.size()), &info));
    std::string codes;
    for (const gpom_cell_t &cell : cells) {
        codes += static_cast<char>(gpom_wire_probability_code(cell.probability, cell.cls));
    }
    for (const gpom_cell_t &cell : cells) {
        codes += static_cast<char>(gpom_wire_variance_class_code(cell.variance, cell.cls));
    }
    gpom_tools::replace_files({{path, codes}});
}

void print_answers(const LibraryMap &library, int n_numbers, char **numbers)
{
    for (int i = 0; i + 1 < n_numbers; i += 2) {
        const gpom_point_t point = {std::atof(numbers[i]), std::atof(numbers[i + 1])};
        gpom_answer_t answer;
        require(gpom_query_points(library.map, &point, 1, &answer, &library.scratch));
        std::printf("%.9g %.9g %.9g %d\n", static_cast<double>(answer.mean),
                    static_cast<double>(answer.variance), static_cast<double>(answer.probability),
                    answer.cls);
    }
}

} // namespace

int main(int argc, char **argv)
{
    if (argc < 4) {
        return gpom_tools::fail("library-map", "usage: library-map CONFIG SCANS CELLS [X Y]...");
    }
    try {
        static gpomd::Config config;
        gpomd::read_config(argv[1], config);
        LibraryMap library(config);
        for (const gpom_tools::Scan &scan : gpom_tools::read_scans(argv[2], {})) {
            insert(library, config, scan);
            library.step();
        }
        while (library.step() > 0) {
        }
        write_cells(library, config.map, argv[3]);
        print_answers(library, argc - 4, argv + 4);
        return 0;
    } catch (const std::exception &error) {
        return gpom_tools::fail("library-map", error.what());
    }
}
