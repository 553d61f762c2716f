// The library against what users would take instead, on the same data in the same run: Google
// Benchmark, repetitions interleaved at random. Times are for one core.
#include "bench/fma_peak.hpp"
#include "bench/plain_gp.hpp"
#include "gpom/gpom.h"
#include "tools/lib/params_toml.hpp"
#include "tools/lib/street.hpp"

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>

#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>

using namespace gpom_bench;
using namespace gpom_tools;

namespace
{

/// What a map is made of: the street repeated `tiles` times each way, scans of `n_beams`.
struct Data {
    const char *name;
    int tiles, n_scans, n_beams;
    double step_m;
    float keep_m; ///< 0: every beam is kept.
};

constexpr Data kSparse = {"sparse", 1, 28, 17, 8.0, 0.0f};
constexpr Data kWide[] = {{"wide-12k", 5, 28, 17, 8.0, 0.0f}, {"wide-500k", 33, 28, 17, 8.0, 0.0f}};
constexpr Data kDense = {"dense-50k", 1, 280, 181, 0.8, 0.0f};
constexpr Data kThinned = {"thinned-50k", 1, 280, 181, 0.8, 0.5f};

std::vector<Scan> scans_of(const Data &data, StreetConfig &street)
{
    street.n_scans = data.n_scans;
    street.n_beams = data.n_beams;
    street.step_m = data.step_m;
    const std::vector<Scan> one = simulate_scans(make_street_world(street), street, {});
    std::vector<Scan> all;
    for (int tile = 0; tile < data.tiles * data.tiles; ++tile) {
        for (Scan scan : one) {
            scan.x_m += (tile % data.tiles) * street.width_m;
            scan.y_m += (tile / data.tiles) * street.height_m;
            all.push_back(scan);
        }
    }
    return all;
}

/// A map in the caller's memory, and places in its middle tile.
class Place {
public:
    Place(const Data &data, std::size_t n) : scans_(scans_of(data, street_))
    {
        params_ = read_params("tests/golden/params_matern12_query.toml");
        params_.n_hits = params_.n_free = static_cast<std::uint16_t>(n / 2);
        gpom_config_init(&config_);
        config_.params = params_;
        config_.keep_m = data.keep_m;
        config_.beam_max =
            static_cast<std::uint32_t>(scans_.size()) * static_cast<std::uint32_t>(street_.n_beams);
        middle_ = {street_.width_m * (data.tiles / 2), street_.height_m * (data.tiles / 2)};
        memory_.resize(gpom_map_bytes(&config_) / 8 + 1);
        clear();
        for (std::size_t i = 0; i < scans_.size(); ++i) {
            insert(i);
        }
        require(gpom_map_build(map_));
        scratch_memory_.resize(gpom_scratch_bytes(map_));
    }

    static void require(gpom_status_t status)
    {
        if (status != GPOM_OK) {
            throw std::runtime_error(gpom_status_str(status));
        }
    }

    void clear() { require(gpom_map_init(&map_, &config_, memory_.data(), 8 * memory_.size())); }

    void insert(std::size_t i)
    {
        const Scan &scan = scans_[i];
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        sensor.range_max_m = static_cast<float>(scan.range_max_m);
        const gpom_pose_t pose = {scan.x_m, scan.y_m, scan.theta_rad, nullptr};
        const gpom_scan_t readings = {static_cast<std::int64_t>(i) * 100000, scan.angle_min_rad,
                                      scan.angle_step_rad, scan.ranges_m.data(),
                                      static_cast<std::uint32_t>(scan.ranges_m.size())};
        require(gpom_scan_insert(map_, &readings, &sensor, &pose));
    }

    /// Corner of the i-th of many patches, spread over the middle tile.
    gpom_point_t corner(std::size_t i) const
    {
        const double k = static_cast<double>(i % 64);
        return {middle_.x_m + std::fmod(5.5 + 37.0 * k, street_.width_m - 10.0),
                middle_.y_m + std::fmod(3.5 + 53.0 * k, street_.height_m - 10.0)};
    }

    gpom::Offset<float> offset(const gpom_point_t &p) const
    {
        return {static_cast<float>(p.x_m), static_cast<float>(p.y_m)};
    }

    gpom_map_t *map() { return map_; }
    const gpom::Index &index() const { return map_->index; }
    const gpom_params_t &params() const { return params_; }
    std::size_t n_scans() const { return scans_.size(); }
    gpom_scratch_t scratch() { return {scratch_memory_.data(), scratch_memory_.size()}; }

private:
    StreetConfig street_;
    std::vector<Scan> scans_;
    gpom_params_t params_;
    gpom_config_t config_;
    gpom_point_t middle_ = {};
    std::vector<std::uint64_t> memory_;
    std::vector<std::uint8_t> scratch_memory_;
    gpom_map_t *map_ = nullptr;
};

/// Maps are made once and stay.
Place &place_of(const Data &data, std::size_t n)
{
    static std::map<std::pair<std::string, std::size_t>, std::unique_ptr<Place>> places;
    auto &place = places[{data.name, n}];
    if (!place) {
        place = std::make_unique<Place>(data, n);
    }
    return *place;
}

void set_queries(benchmark::State &state, std::size_t n_each)
{
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(n_each));
}

/// Patches of 32 x 32 cells of 0.25 m.
void raster(benchmark::State &state, const Data &data, std::size_t n)
{
    Place &place = place_of(data, n);
    std::vector<gpom_answer_t> answers(1024);
    const gpom_scratch_t scratch = place.scratch();
    std::size_t i = 0;
    for (auto _ : state) {
        const gpom_point_t at = place.corner(i++);
        const gpom_raster_t patch = {at.x_m, at.y_m, 0.25, 32, 32};
        Place::require(gpom_query_raster(place.map(), &patch, answers.data(), &scratch));
    }
    set_queries(state, answers.size());
}

/// Lists of 256 points at random in patches of 8 m x 8 m.
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
        Place::require(
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

/// The hits as nanoflann wants them.
struct Cloud {
    std::vector<gpom::Point> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const
    {
        return axis == 0 ? points[i].x_m : points[i].y_m;
    }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

/// The same patches, hits alone: no free segments, no Gaussian process.
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
        Place::require(gpom_map_build(place.map()));
    }
    state.counters["beams"] = gpom_map_beam_count(place.map());
}

/// All scans into an empty map, a step of 20,000 operations after each.
void insert(benchmark::State &state, const Data &data)
{
    Place place(data, 16);
    for (auto _ : state) {
        place.clear();
        for (std::size_t i = 0; i < place.n_scans(); ++i) {
            std::uint64_t used = 0;
            place.insert(i);
            Place::require(gpom_map_step(place.map(), 20000, nullptr, &used));
        }
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(place.n_scans()));
    state.counters["beams"] = gpom_map_beam_count(place.map());
}

void fma_peak(benchmark::State &state, float (*peak)(std::int64_t), int width)
{
    constexpr std::int64_t kRounds = 10000;
    for (auto _ : state) {
        benchmark::DoNotOptimize(peak(kRounds));
    }
    state.SetItemsProcessed(state.iterations() * kRounds * kChains * width);
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

void add_all()
{
    for (const std::size_t n : {16u, 24u, 32u, 48u, 64u}) {
        add_queries(kSparse, n);
    }
    for (const std::size_t n : {16u, 32u}) {
        for (const Data &data : {kWide[0], kWide[1], kDense, kThinned}) {
            add_queries(data, n);
        }
    }
    for (const Data &data : {kSparse, kWide[0], kDense}) {
        add(std::string("build/") + data.name, build, data);
    }
    for (const Data &data : {kSparse, kThinned}) {
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

int main(int argc, char **argv)
{
    benchmark::Initialize(&argc, argv);
    benchmark::AddCustomContext("lanes", std::to_string(gpom_lanes()));
    benchmark::AddCustomContext("compiler", __VERSION__);
    add_all();
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
