/// \file reference.hpp
/// The oracle of the unit tests: the equations in double precision by brute force, written from the
/// paper and Rasmussen & Williams (2006) and sharing no formula with src/; and the fixtures (a map
/// in guarded memory, a random world) that several tests stand on.
#pragma once

#include "gpom/gpom.h"
#include "src/lane/lane.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace reference
{

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr double kPi = 3.14159265358979323846;

constexpr gpom_kernel_t kKernels[] = {GPOM_KERNEL_NN, GPOM_KERNEL_MATERN12, GPOM_KERNEL_MATERN32,
                                      GPOM_KERNEL_SE, GPOM_KERNEL_ASKEY};
constexpr const char *kKernelNames[] = {"nn", "matern12", "matern32", "se", "askey"};
constexpr gpom_frame_t kFrames[] = {GPOM_FRAME_QUERY, GPOM_FRAME_MAP};

// ---- random numbers --------------------------------------------------------------------------

/// Seed of every random test: GPOM_SEED, or 1.
inline std::uint64_t seed()
{
    const char *const text = std::getenv("GPOM_SEED");
    return text == nullptr || *text == '\0' ? 1 : std::strtoull(text, nullptr, 10);
}

/// `stream` keeps tests independent of each other's draws.
struct Random {
    std::mt19937_64 bits;

    explicit Random(std::uint64_t stream) : bits(seed() * 1000003u + stream) {}

    double uniform(double low, double high)
    {
        return low + (high - low) * std::ldexp(static_cast<double>(bits() >> 11), -53);
    }
    float uniform_f(double low, double high) { return static_cast<float>(uniform(low, high)); }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(bits() % n); }
};

#define GPOM_TELL_SEED() INFO("replay with GPOM_SEED=", reference::seed())

// ---- lanes -----------------------------------------------------------------------------------

template <int W> using Lanes = typename gpom::lane::Lane<W>::F;

/// f of each x, computed W at a time; the last packet is padded with its first x.
template <int W, class Fn> std::vector<float> on_lanes(const std::vector<float> &xs, Fn f)
{
    std::vector<float> ys(xs.size());
    for (std::size_t first = 0; first < xs.size(); first += W) {
        Lanes<W> x = gpom::lane::splat<Lanes<W>>(xs[first]);
        const int n = static_cast<int>(std::min<std::size_t>(W, xs.size() - first));
        for (int i = 0; i < n; ++i) {
            gpom::lane::set(x, i, xs[first + static_cast<std::size_t>(i)]);
        }
        const Lanes<W> y = f(x);
        for (int i = 0; i < n; ++i) {
            ys[first + static_cast<std::size_t>(i)] = gpom::lane::get(y, i);
        }
    }
    return ys;
}

inline bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

inline bool same_bits(const std::vector<float> &a, const std::vector<float> &b)
{
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

inline bool same_bits(const gpom_answer_t &a, const gpom_answer_t &b)
{
    return same_bits(a.mean, b.mean) && same_bits(a.variance, b.variance) &&
           same_bits(a.probability, b.probability) && a.cls == b.cls && a.flags == b.flags &&
           a.n_hits == b.n_hits && a.n_free == b.n_free;
}

inline bool same_bits(const std::vector<gpom_answer_t> &a, const std::vector<gpom_answer_t> &b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const auto &p, const auto &q) { return same_bits(p, q); });
}

/// x as a float32 a few representable values further up (n > 0) or down.
inline float step_float(float x, int n)
{
    for (; n > 0; --n) {
        x = std::nextafter(x, kInf);
    }
    for (; n < 0; ++n) {
        x = std::nextafter(x, -kInf);
    }
    return x;
}

// ---- Gaussian process in double --------------------------------------------------------------

struct Xy {
    double x, y;
};

/// Eq. 4 and Rasmussen & Williams (2006), eqs. 4.9, 4.14, 4.17; Askey as documented in params.h.
inline double kernel(const gpom_params_t &p, Xy a, Xy b)
{
    const double sf2 = p.sf2;
    const double r = std::hypot(a.x - b.x, a.y - b.y);
    const double ell = p.ell_m;
    switch (p.kernel) {
    case GPOM_KERNEL_NN: {
        const auto form = [&p](Xy u, Xy v) {
            return 2.0 * (static_cast<double>(p.s0) +
                          static_cast<double>(p.s1) * (u.x * v.x + u.y * v.y));
        };
        const double arg = form(a, b) / std::sqrt((1.0 + form(a, a)) * (1.0 + form(b, b)));
        return sf2 * std::asin(std::clamp(arg, -1.0, 1.0));
    }
    case GPOM_KERNEL_MATERN12:
        return sf2 * std::exp(-r / ell);
    case GPOM_KERNEL_MATERN32:
        return sf2 * (1.0 + std::sqrt(3.0) * r / ell) * std::exp(-std::sqrt(3.0) * r / ell);
    case GPOM_KERNEL_SE:
        return sf2 * std::exp(-r * r / (2.0 * ell * ell));
    case GPOM_KERNEL_ASKEY:
        return r < ell ? sf2 * std::pow(1.0 - r / ell, 3.0) : 0.0;
    }
    return std::numeric_limits<double>::quiet_NaN();
}

struct LabelledPoint {
    Xy at; ///< In the covariance's frame.
    double label, noise;
};

struct Moments {
    double mean, variance;
};

/// Eqs. 2 and 3 by a dense solve.
inline Moments predict(const gpom_params_t &p, const std::vector<LabelledPoint> &points, Xy query)
{
    const double prior = kernel(p, query, query);
    const auto n = static_cast<Eigen::Index>(points.size());
    if (n == 0) {
        return {0.0, prior};
    }
    Eigen::MatrixXd K(n, n);
    Eigen::VectorXd ks(n), y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const LabelledPoint &a = points[static_cast<std::size_t>(i)];
        for (Eigen::Index j = 0; j < n; ++j) {
            K(i, j) = kernel(p, a.at, points[static_cast<std::size_t>(j)].at);
        }
        K(i, i) += a.noise;
        ks(i) = kernel(p, query, a.at);
        y(i) = a.label;
    }
    const Eigen::LLT<Eigen::MatrixXd> llt(K);
    return {ks.dot(llt.solve(y)), prior - ks.dot(llt.solve(ks))};
}

inline double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

/// Eq. 7 with its square root.
inline double squash(const gpom_params_t &p, const Moments &m)
{
    const double alpha = p.alpha;
    return normal_cdf((alpha * m.mean + static_cast<double>(p.beta)) /
                      std::sqrt(1.0 + alpha * alpha * m.variance));
}

/// Legal parameters of one kernel, with lengths that fit the worlds below.
inline gpom_params_t params_of(gpom_kernel_t which, gpom_frame_t frame = GPOM_FRAME_QUERY)
{
    gpom_params_t p;
    gpom_params_init(&p);
    p.kernel = which;
    p.frame = frame;
    p.s0 = 20.0f;
    p.s1 = 0.5f;
    p.ell_m = which == GPOM_KERNEL_ASKEY ? 9.0f : which == GPOM_KERNEL_SE ? 1.5f : 4.0f;
    p.sn2 = 0.15f;
    p.sn2_free = 0.1f;
    p.alpha = 3.0f;
    p.beta = 0.5f;
    return p;
}

// ---- beams in double -------------------------------------------------------------------------

struct Beam {
    Xy origin, dir;
    double range;
    bool is_hit;
    double hit_noise, free_noise;
    std::uint32_t id;
    bool is_free = true;
    bool returned = is_hit; ///< A gap is left before its end.
};

/// What queries see of a kept beam.
inline Beam beam_of(const gpom_beam_t &b)
{
    return {{b.x_m, b.y_m}, {b.dir_x, b.dir_y}, b.range_m, b.is_hit == 1 && b.provisional == 0,
            b.hit_noise,    b.free_noise,       b.id,      b.is_free == 1,
            b.returned == 1};
}

struct Neighbour {
    Xy at;
    double distance, noise;
    std::uint32_t id;
};

/// Order by (distance, id) and keep k. `*is_clear` falls if float32 rounding could choose
/// otherwise: the last kept and the first left out are almost, but not exactly, the same distance
/// away.
inline void keep_nearest(std::vector<Neighbour> &all, std::size_t k, bool *is_clear)
{
    std::sort(all.begin(), all.end(), [](const Neighbour &a, const Neighbour &b) {
        return a.distance != b.distance ? a.distance < b.distance : a.id < b.id;
    });
    if (all.size() <= k) {
        return;
    }
    const Neighbour &in = all[k - 1];
    const Neighbour &out = all[k];
    const bool is_same = in.at.x == out.at.x && in.at.y == out.at.y;
    if (!is_same && out.distance - in.distance < 1e-4) {
        *is_clear = false;
    }
    all.resize(k);
}

/// The whole answer by brute force: eq. 10, nearest, eqs. 2 and 3.
struct Neighbourhood {
    std::vector<LabelledPoint> points;
    bool is_clear = true;
};

inline Neighbourhood neighbourhood_of(const gpom_params_t &p, const std::vector<Beam> &beams, Xy q)
{
    std::vector<Neighbour> hits, free;
    for (const Beam &b : beams) {
        if (b.is_free) {
            const double length =
                b.returned ? std::max(0.0, b.range - static_cast<double>(p.gap_m)) : b.range;
            const double along = (q.x - b.origin.x) * b.dir.x + (q.y - b.origin.y) * b.dir.y;
            const double t = std::clamp(along, 0.0, length);
            const Xy foot = {b.origin.x + t * b.dir.x, b.origin.y + t * b.dir.y};
            free.push_back({foot, std::hypot(foot.x - q.x, foot.y - q.y), b.free_noise, b.id});
        }
        if (b.is_hit) {
            const Xy hit = {b.origin.x + b.range * b.dir.x, b.origin.y + b.range * b.dir.y};
            hits.push_back({hit, std::hypot(hit.x - q.x, hit.y - q.y), b.hit_noise, b.id});
        }
    }
    Neighbourhood out;
    keep_nearest(hits, p.n_hits, &out.is_clear);
    keep_nearest(free, p.n_free, &out.is_clear);
    for (const Neighbour &h : hits) {
        out.points.push_back({h.at, 1.0, h.noise});
    }
    for (const Neighbour &f : free) {
        out.points.push_back({f.at, -1.0, f.noise});
    }
    return out;
}

// ---- fixtures --------------------------------------------------------------------------------

/// Memory of an exact size between two canaries, at a chosen offset from a 64-byte boundary.
class GuardedMemory {
public:
    explicit GuardedMemory(std::size_t bytes, std::size_t offset = 0)
        : bytes_(bytes), store_(bytes + 2 * kGuard + 128, kCanary)
    {
        const auto at = reinterpret_cast<std::uintptr_t>(store_.data() + kGuard);
        first_ = kGuard + (64 - at % 64) % 64 + offset;
    }

    void *mem() { return store_.data() + first_; }
    std::size_t bytes() const { return bytes_; }

    bool is_intact() const
    {
        const auto is_canary = [](unsigned char byte) { return byte == kCanary; };
        const auto begin = store_.begin() + static_cast<std::ptrdiff_t>(first_);
        return std::all_of(store_.begin(), begin, is_canary) &&
               std::all_of(begin + static_cast<std::ptrdiff_t>(bytes_), store_.end(), is_canary);
    }

private:
    static constexpr std::size_t kGuard = 64;
    static constexpr unsigned char kCanary = 0xa5;
    std::size_t bytes_;
    std::vector<unsigned char> store_;
    std::size_t first_ = 0;
};

/// A map in exactly the memory it asks for. The canaries are checked when it goes.
class TestMap {
public:
    explicit TestMap(const gpom_config_t &config) : memory_(gpom_map_bytes(&config))
    {
        REQUIRE(gpom_map_init(&map_, &config, memory_.mem(), memory_.bytes()) == GPOM_OK);
    }
    ~TestMap() { CHECK(memory_.is_intact()); }
    TestMap(const TestMap &) = delete;
    TestMap &operator=(const TestMap &) = delete;

    gpom_map_t *get() { return map_; }

    gpom_stats_t stats() const
    {
        gpom_stats_t stats;
        REQUIRE(gpom_map_stats(map_, &stats) == GPOM_OK);
        return stats;
    }

    /// Beams that made room so far.
    std::uint64_t n_evicted() const
    {
        const gpom_stats_t now = stats();
        return gpom_stats_evicted(&now);
    }

    /// All kept beams, slot by slot.
    std::vector<gpom_beam_t> beams() const
    {
        std::vector<gpom_beam_t> all;
        for (std::uint32_t i = 0; i < gpom_map_slot_count(map_); ++i) {
            gpom_beam_t beam;
            REQUIRE(gpom_map_beam(map_, i, &beam) == GPOM_OK);
            if (beam.is_hit == 1 || beam.is_free == 1) {
                all.push_back(beam);
            }
        }
        REQUIRE(all.size() == gpom_map_beam_count(map_));
        return all;
    }

    std::vector<Beam> reference_beams() const
    {
        std::vector<Beam> all;
        for (const gpom_beam_t &b : beams()) {
            all.push_back(beam_of(b));
        }
        return all;
    }

private:
    GuardedMemory memory_;
    gpom_map_t *map_ = nullptr;
};

inline gpom_config_t config_of(const gpom_params_t &params, std::uint32_t beam_max = 1024)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.beam_max = beam_max;
    config.params = params;
    return config;
}

/// Answers and the status they came with; scratch of the exact size between canaries.
struct Answers {
    std::vector<gpom_answer_t> all;
    gpom_status_t status;
};

inline Answers query_points(const gpom_map_t *map, const std::vector<gpom_point_t> &points)
{
    GuardedMemory memory(gpom_scratch_bytes(map), 1); // no alignment is asked for
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    Answers answers = {std::vector<gpom_answer_t>(points.size()), GPOM_OK};
    answers.status =
        gpom_query_points(map, points.data(), points.size(), answers.all.data(), &scratch);
    CHECK(memory.is_intact());
    return answers;
}

inline Answers query_raster(const gpom_map_t *map, const gpom_raster_t &raster)
{
    GuardedMemory memory(gpom_scratch_bytes(map), 3);
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    Answers answers = {std::vector<gpom_answer_t>(static_cast<std::size_t>(raster.nx) * raster.ny),
                       GPOM_OK};
    answers.status = gpom_query_raster(map, &raster, answers.all.data(), &scratch);
    CHECK(memory.is_intact());
    return answers;
}

/// One scan with everything that belongs to it, free to be changed before it is inserted.
struct TestScan {
    gpom_sensor_t sensor;
    gpom_pose_t pose = {0.0, 0.0, 0.0, nullptr};
    std::vector<float> ranges_m;
    std::int64_t stamp_us = 0;
    double angle_min_rad = 0.0;
    double angle_step_rad = 0.0;

    TestScan() { gpom_sensor_init(&sensor); }

    gpom_scan_t scan() const
    {
        return {stamp_us, angle_min_rad, angle_step_rad, ranges_m.data(),
                static_cast<std::uint32_t>(ranges_m.size())};
    }
    gpom_status_t insert_into(gpom_map_t *map) const
    {
        const gpom_scan_t raw = scan();
        return gpom_scan_insert(map, &raw, &sensor, &pose);
    }
};

/// Scan `i` of a drive through a random yard: full turns, one reading in six without a return.
inline TestScan yard_scan(Random &random, int i, Xy centre)
{
    TestScan s;
    s.pose = {centre.x + 3.0 * i + random.uniform(-1, 1), centre.y + random.uniform(-2, 2),
              random.uniform(-7.0, 7.0), nullptr};
    s.stamp_us = 100000 * i;
    s.angle_min_rad = random.uniform(-3.0, -2.0);
    s.angle_step_rad = 0.11;
    for (int j = 0; j < 50; ++j) {
        s.ranges_m.push_back(random.below(6) == 0 ? kInf : random.uniform_f(0.5, 14.0));
    }
    return s;
}

/// Insert `n_scans` scans of 50 beams.
inline void drive(gpom_map_t *map, std::uint64_t stream, int n_scans, Xy centre = {0.0, 0.0})
{
    Random random(stream);
    for (int i = 0; i < n_scans; ++i) {
        REQUIRE(yard_scan(random, i, centre).insert_into(map) == GPOM_OK);
    }
}

inline std::vector<gpom_point_t> random_points(std::uint64_t stream, std::size_t n, double reach_m,
                                               Xy centre = {0.0, 0.0})
{
    Random random(stream);
    std::vector<gpom_point_t> points(n);
    for (gpom_point_t &point : points) {
        point = {centre.x + random.uniform(-reach_m, reach_m),
                 centre.y + random.uniform(-reach_m, reach_m)};
    }
    return points;
}

// ---- golden vectors --------------------------------------------------------------------------

using Row = std::vector<std::string>;

/// Rows of a file of tests/golden, without comments and the line that names the columns; empty if
/// the file is not there.
inline std::vector<Row> read_golden(const std::string &name)
{
    const std::string here = __FILE__;
    const std::size_t slash = here.rfind('/');
    std::ifstream file(here.substr(0, slash) + "/../golden/" + name);
    std::vector<Row> rows;
    for (std::string line; std::getline(file, line);) {
        Row row;
        std::istringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) {
            row.push_back(cell);
        }
        const bool has_numbers = !row.empty() && std::isdigit(row.back().back()) != 0;
        if (has_numbers && line[0] != '#') {
            rows.push_back(row);
        }
    }
    return rows;
}

inline double number(const Row &row, std::size_t i) { return std::stod(row.at(i)); }

/// Parameters from the columns kernel,sf2,s0,s1,ell_m that start at `first`.
inline gpom_params_t params_of_row(const Row &row, std::size_t first)
{
    gpom_params_t p;
    gpom_params_init(&p);
    const auto name = std::find(std::begin(kKernelNames), std::end(kKernelNames), row.at(first));
    REQUIRE(name != std::end(kKernelNames));
    p.kernel = kKernels[name - std::begin(kKernelNames)];
    p.sf2 = std::stof(row.at(first + 1));
    p.s0 = std::stof(row.at(first + 2));
    p.s1 = std::stof(row.at(first + 3));
    p.ell_m = std::stof(row.at(first + 4));
    return p;
}

} // namespace reference
