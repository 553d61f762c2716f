// Counts what searches visit on dense maps (tests/visits.py). The library must be compiled with
// GPOM_COUNT_VISITS. The counts are the same in every run and on every machine.
//
// usage: count-visits [LOG]
#include "bench/log_map.hpp"

#include <cstdio>

using namespace gpom_bench;

namespace
{

constexpr std::size_t kPatches = 64;

/// A row of counts a packet: boxes, items and offers of hits, then of free segments.
void print_row(const std::string &map, double n_packets)
{
    std::printf("%s", map.c_str());
    for (const gpom_visits &visits : {gpom_hit_visits, gpom_free_visits}) {
        std::printf(",%.3f,%.3f,%.3f", static_cast<double>(visits.boxes) / n_packets,
                    static_cast<double>(visits.items) / n_packets,
                    static_cast<double>(visits.offers) / n_packets);
    }
    std::printf("\n");
}

/// Query the patches and print what their searches visited.
template <class PatchOf>
void count(const std::string &name, const gpom_map_t *map, const gpom_scratch_t &scratch,
           const PatchOf &patch_of)
{
    std::vector<gpom_answer_t> answers(1024);
    gpom_hit_visits = gpom_free_visits = {};
    for (std::size_t i = 0; i < kPatches; ++i) {
        const gpom_raster_t patch = patch_of(i);
        require(gpom_query_raster(map, &patch, answers.data(), &scratch));
    }
    print_row(name, static_cast<double>(kPatches * answers.size()) / gpom_lanes());
}

void count_place(const Data &data, std::size_t n)
{
    Place place(data, params_of(data.kernel, n));
    count(std::string(data.name) + "/n" + std::to_string(n), place.map(), place.scratch(),
          [&](std::size_t i) {
              return gpom_raster_t{place.corner(i).x_m, place.corner(i).y_m, 0.25, 32, 32};
          });
}

void count_log(const std::string &name, const std::string &path, Keep keep)
{
    LogMap &log = log_map(path, keep);
    const gpom_scratch_t scratch = {log.scratch.data(), log.scratch.size()};
    count(name, log.map->get(), scratch, [&](std::size_t i) { return log.patch(i); });
}

} // namespace

int main(int argc, char **argv)
{
    std::printf("map,hit boxes,hit items,hit offers,free boxes,free items,free offers\n");
    for (const Data &data : {kDense, kDenseLate, kThinned}) {
        count_place(data, 16);
    }
    if (argc > 1) {
        count_log("log-live/n16", argv[1], Keep::live);
        count_log("log-live-late/n16", argv[1], Keep::live_late);
    }
    return 0;
}
