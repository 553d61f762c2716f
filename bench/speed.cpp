// Compares the library with its alternatives on the same data in the same run, by Google Benchmark
// with repetitions interleaved at random. Times are for one core.
#include "bench/fma_peak.hpp"
#include "bench/log_map.hpp"
#include "bench/place.hpp"
#include "bench/plain_gp.hpp"
#include "bench/processor.hpp"
#include "bench/solve.hpp"
#include "gpom/gpom.h"

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>

using namespace gpom_bench;
using namespace gpom_tools;

namespace
{

/// Maps are made once and kept.
Place &place_of(const Data &data, std::size_t n)
{
    static std::map<std::pair<std::string, std::size_t>, std::unique_ptr<Place>> places;
    auto &place = places[{data.name, n}];
    if (!place) {
        place = std::make_unique<Place>(data, params_of(data.kernel, n));
    }
    return *place;
}

void set_queries(benchmark::State &state, std::size_t n_each)
{
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(n_each));
}

/// Query patches of 32 x 32 cells of 0.25 m.
void raster(benchmark::State &state, const Data &data, std::size_t n)
{
    Place &place = place_of(data, n);
    std::vector<gpom_answer_t> answers(1024);
    const gpom_scratch_t scratch = place.scratch();
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom_point_t at = place.corner(i++);
        const gpom_raster_t patch = {at.x_m, at.y_m, 0.25, 32, 32};
        require(gpom_query_raster(place.map(), &patch, answers.data(), &scratch));
    }
    set_queries(state, answers.size());
}

/// Query lists of 256 random points in patches of 8 m x 8 m.
void random_points(benchmark::State &state, const Data &data, std::size_t n)
{
    Place &place = place_of(data, n);
    std::vector<gpom_point_t> points(256);
    std::vector<gpom_answer_t> answers(points.size());
    const gpom_scratch_t scratch = place.scratch();
    std::mt19937_64 bits(1);
    std::uniform_real_distribution<double> side(0.0, 8.0);
    std::size_t i = 0;
    for (auto _ : state) {
        state.PauseTiming();
        for (gpom_point_t &point : points) {
            point = {place.corner(i).x_m + side(bits), place.corner(i).y_m + side(bits)};
        }
        ++i;
        state.ResumeTiming();
        require(
            gpom_query_points(place.map(), points.data(), points.size(), answers.data(), &scratch));
    }
    set_queries(state, answers.size());
}

enum class Search { force, tree };

void plain(benchmark::State &state, const Data &data, std::size_t n, Search search)
{
    const Place &place = place_of(data, n);
    const gpom::Index &index = place.index();
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom::Offset<float> at = place.offset(place.corner(i++));
        const bool tree = search == Search::tree;
        const auto hits = tree ? nearest_by_tree(index, index.hit_part, at, n / 2)
                               : nearest_by_force(index, index.hit_part, at, n / 2);
        const auto free = tree ? nearest_by_tree(index, index.free_part, at, n / 2)
                               : nearest_by_force(index, index.free_part, at, n / 2);
        benchmark::DoNotOptimize(plain_probability(place.params(), hits, free));
    }
    set_queries(state, 1);
}

/// The hits in the form that nanoflann needs.
struct Cloud {
    std::vector<gpom::Point> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const
    {
        return axis == 0 ? points[i].x_m : points[i].y_m;
    }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

/// Search the hits of the same patches: no free segments, no Gaussian process.
void nanoflann_hits(benchmark::State &state, const Data &data, std::size_t n)
{
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>,
                                                     Cloud, 2, std::uint32_t>;
    const Place &place = place_of(data, n);
    Cloud cloud;
    for (std::uint32_t slot = 0; slot < place.index().n_slots; ++slot) {
        if (gpom::HitPart::is_seen(place.index().beams[slot])) {
            cloud.points.push_back(gpom::end_of(place.index().beams[slot]));
        }
    }
    const Tree tree(2, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
    std::vector<std::uint32_t> found(n / 2);
    std::vector<float> d2(n / 2);
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom::Offset<float> at = place.offset(place.corner(i++));
        for (int cell = 0; cell < 1024; ++cell) {
            const float query[] = {at.x_m + 0.25f * static_cast<float>(cell % 32),
                                   at.y_m + 0.25f * static_cast<float>(cell / 32)};
            benchmark::DoNotOptimize(tree.knnSearch(query, n / 2, found.data(), d2.data()));
        }
    }
    set_queries(state, 1024);
}

void build(benchmark::State &state, const Data &data)
{
    Place &place = place_of(data, 16);
    for (auto _ : state) {
        require(gpom_map_build(place.map()));
    }
    state.counters["beams"] = gpom_map_beam_count(place.map());
    state.counters["bytes_per_beam"] = place.bytes_per_beam();
}

/// Insert all scans into an empty map, with a step of 20,000 operations after each.
void insert(benchmark::State &state, const Data &data)
{
    Place place(data, params_of(data.kernel, 16));
    for (auto _ : state) {
        place.clear();
        for (std::size_t i = 0; i < place.n_scans(); ++i) {
            std::uint64_t used = 0;
            place.insert(i);
            require(gpom_map_step(place.map(), 20000, nullptr, &used));
        }
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(place.n_scans()));
    state.counters["beams"] = gpom_map_beam_count(place.map());
}

/// Query a whole raster at once. It begins at the lower left corner of the middle tile.
void whole_map(benchmark::State &state, const Data &data, double cell_m, std::uint32_t nx,
               std::uint32_t ny)
{
    Place &place = place_of(data, 16);
    std::vector<gpom_answer_t> answers(static_cast<std::size_t>(nx) * ny);
    const gpom_scratch_t scratch = place.scratch();
    const gpom_point_t corner = place.corner(0);
    const gpom_raster_t area = {corner.x_m, corner.y_m, cell_m, nx, ny};
    for (auto _ : state) {
        require(gpom_query_raster(place.map(), &area, answers.data(), &scratch));
    }
    set_queries(state, answers.size());
}

/// Share of pairs of neighbours at a place that are within ell of each other. It is the share of
/// nonzeros in K.
double nonzero_share(const Place &place, const gpom::Offset<float> &at)
{
    const gpom_params_t &params = place.params();
    auto points = nearest_by_tree(place.index(), place.index().hit_part, at, params.n_hits);
    const auto free = nearest_by_tree(place.index(), place.index().free_part, at, params.n_free);
    points.insert(points.end(), free.begin(), free.end());
    double n_near = 0.0;
    for (const Neighbour &a : points) {
        for (const Neighbour &b : points) {
            n_near += (a.at - b.at).norm() < params.ell_m ? 1.0 : 0.0;
        }
    }
    return n_near / static_cast<double>(points.size() * points.size());
}

enum class Solve { dense, sparse };

/// Query packets of 4 x 4 cells of 0.25 m with the Askey covariance of this length, by either
/// solve.
void many_neighbours(benchmark::State &state, std::size_t n, float ell_m, Solve solve)
{
    gpom_params_t params = params_of("askey", n);
    params.ell_m = ell_m;
    Place place(kWide[0], params);
    place.map()->dense_max = solve == Solve::dense ? GPOM_SPARSE_POINTS_MAX : GPOM_POINTS_MAX;
    std::vector<std::uint8_t> memory(gpom_scratch_bytes(place.map()));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    gpom_answer_t answers[16];
    double nonzeros = 0.0;
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom_point_t at = place.corner(i++);
        const gpom_raster_t patch = {at.x_m, at.y_m, 0.25, 4, 4};
        require(gpom_query_raster(place.map(), &patch, answers, &scratch));
    }
    for (i = 0; i < 64; ++i) {
        nonzeros += nonzero_share(place, place.offset(place.corner(i))) / 64.0;
    }
    set_queries(state, 16);
    state.counters["nonzeros"] = nonzeros;
}

/// Query patches of 32 x 32 cells of 0.25 m around 64 poses.
void log_raster(benchmark::State &state, const std::string &path, Keep keep)
{
    LogMap &log = log_map(path, keep);
    const gpom_scratch_t scratch = {log.scratch.data(), log.scratch.size()};
    std::vector<gpom_answer_t> answers(1024);
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom_raster_t patch = log.patch(i++);
        require(gpom_query_raster(log.map->get(), &patch, answers.data(), &scratch));
    }
    set_queries(state, answers.size());
    state.counters["beams"] = gpom_map_beam_count(log.map->get());
}

/// Neighbourhoods and their answers, for comparison in other processes.
nlohmann::ordered_json neighbourhoods_json(std::size_t n)
{
    Place &place = place_of(kSparse, n);
    const gpom::Index &index = place.index();
    const gpom_scratch_t scratch = place.scratch();
    nlohmann::ordered_json queries = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < 64; ++i) {
        const gpom_point_t point = place.corner(i);
        gpom_answer_t answer;
        require(gpom_query_points(place.map(), &point, 1, &answer, &scratch));
        const auto places_of = [](const std::vector<Neighbour> &found) {
            std::vector<std::array<float, 2>> places;
            for (const Neighbour &neighbour : found) {
                places.push_back({neighbour.at.x(), neighbour.at.y()});
            }
            return places;
        };
        const gpom::Offset<float> at = place.offset(point);
        queries.push_back({{"hits", places_of(nearest_by_tree(index, index.hit_part, at, n / 2))},
                           {"free", places_of(nearest_by_tree(index, index.free_part, at, n / 2))},
                           {"mean", answer.mean},
                           {"variance", answer.variance}});
    }
    return queries;
}

void write_neighbourhoods(const std::string &path)
{
    const gpom_params_t params = params_of("matern12", 16);
    nlohmann::ordered_json all = {{"sf2", params.sf2},
                                  {"ell_m", params.ell_m},
                                  {"sn2", params.sn2},
                                  {"sn2_free", params.sn2_free}};
    for (const std::size_t n : {16u, 24u, 32u, 48u, 64u}) {
        all["n" + std::to_string(n)] = neighbourhoods_json(n);
    }
    std::ofstream file(path);
    file << all.dump() << "\n";
    if (!file.flush()) {
        throw std::runtime_error(path + ": cannot be written");
    }
}

void fma_peak(benchmark::State &state, float (*peak)(std::int64_t), int width)
{
    constexpr std::int64_t kRounds = 10000;
    for (auto _ : state) {
        benchmark::DoNotOptimize(peak(kRounds));
    }
    state.SetItemsProcessed(state.iterations() * kRounds * kChains * width);
}

/// The solve for the lanes that the library has chosen.
gpom_bench_solve solve_in_use()
{
#if GPOM_DISPATCH
    if (gpom_lanes() == 16) {
        return gpom_avx512::bench_solve_here();
    }
    if (gpom_lanes() == 8) {
        return gpom_avx2::bench_solve_here();
    }
#endif
    return gpom::bench_solve_here();
}

/// Operations a second of the solve only. An item is one operation, half of a multiply-add.
void solve_alone(benchmark::State &state, const char *kernel, std::size_t n)
{
    const gpom_bench_solve chosen = solve_in_use();
    const gpom_params_t params = params_of(kernel, n);
    constexpr std::size_t kRounds = 100;
    for (auto _ : state) {
        benchmark::DoNotOptimize(chosen.solve(params, kRounds));
    }
    const double flops = solve_flops(static_cast<double>(n)) * chosen.lanes * kRounds;
    state.SetItemsProcessed(
        static_cast<std::int64_t>(flops * static_cast<double>(state.iterations())));
}

template <class Fn, class... Args> void add(const std::string &name, Fn fn, Args... args)
{
    benchmark::RegisterBenchmark(name.c_str(), fn, args...);
}

void add_queries(const Data &data, std::size_t n)
{
    const std::string of = std::string("/") + data.name + "/n" + std::to_string(n);
    add("raster" + of, raster, data, n);
    add("points" + of, random_points, data, n);
    add("nanoflann-hits" + of, nanoflann_hits, data, n);
    add("eigen-tree" + of, plain, data, n, Search::tree);
    add("eigen-brute" + of, plain, data, n, Search::force);
}

/// Add the logs in the folder GPOM_DATA, if they exist.
void add_logs()
{
    const char *const folder = std::getenv("GPOM_DATA");
    const std::string path =
        std::string(folder == nullptr ? "../shared/data" : folder) + "/campus-west.log.gz";
    if (!std::filesystem::exists(path)) {
        std::fprintf(stderr, "speed: no %s: its rows are left out\n", path.c_str());
        return;
    }
    add("log/campus-west-live/n16", log_raster, path, Keep::live);
    add("log/campus-west-live-late/n16", log_raster, path, Keep::live_late);
    add("log/campus-west-all/n16", log_raster, path, Keep::all);
}

void add_many_neighbours()
{
    for (const std::size_t n : {128u, 256u, 512u}) {
        for (const float ell_m : {2.0f, 5.0f, 12.0f, 36.0f}) {
            const std::string of =
                "/ell" + std::to_string(static_cast<int>(ell_m)) + "/n" + std::to_string(n);
            add("solve-dense" + of, many_neighbours, n, ell_m, Solve::dense);
            add("solve-sparse" + of, many_neighbours, n, ell_m, Solve::sparse);
        }
    }
}

void add_all()
{
    add("map/coarse-120000-m2", whole_map, kWide[0], 5.0, 80u, 60u);
    add("map/street-100-m-20-m", whole_map, kSparse, 0.1, 1000u, 200u);
    add_logs();
    add_many_neighbours();
    for (const std::size_t n : {16u, 24u, 32u, 48u, 64u}) {
        add_queries(kSparse, n);
        add_queries(kPaper, n);
        for (const char *const kernel : {"matern12", "nn", "askey"}) {
            add(std::string("solve/") + kernel + "/n" + std::to_string(n), solve_alone, kernel, n);
        }
    }
    for (const std::size_t n : {16u, 32u}) {
        for (const Data &data : {kWide[0], kWide[1], kDense, kDenseLate, kThinned}) {
            add_queries(data, n);
        }
    }
    for (const Data &data : {kSparse, kWide[0], kWide[1], kDense}) {
        add(std::string("build/") + data.name, build, data);
    }
    for (const Data &data : {kSparse, kDense, kThinned}) {
        add(std::string("insert/") + data.name, insert, data);
    }
    add("multiply-add/4", fma_peak, peak_sse2, 4);
#ifdef __x86_64__
    if (gpom_lanes() >= 8) {
        add("multiply-add/8", fma_peak, peak_avx2, 8);
    }
    if (gpom_lanes() >= 16) {
        add("multiply-add/16", fma_peak, peak_avx512, 16);
    }
#endif
}

} // namespace

// usage: speed [flags of Google Benchmark]
// speed --neighbourhoods FILE   only writes the input of bench/sklearn_gp.py
int main(int argc, char **argv)
{
    benchmark::Initialize(&argc, argv);
    if (argc == 3 && std::string(argv[1]) == "--neighbourhoods") {
        write_neighbourhoods(argv[2]);
        return 0;
    }
    benchmark::AddCustomContext("lanes", std::to_string(gpom_lanes()));
    benchmark::AddCustomContext("compiler", __VERSION__);
    benchmark::AddCustomContext("processor", processor_name());
    add_all();
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
