/// \file keeping.hpp
/// Small worlds in which scans say what is worth keeping.
#pragma once

#include "tests/common/reference.hpp"

namespace reference
{

constexpr float kKeep_m = 0.5f;

inline gpom_config_t keep_config(std::uint32_t clear_scans, std::uint32_t beam_max = 1024)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), beam_max);
    config.keep_m = kKeep_m;
    config.clear_scans = clear_scans;
    return config;
}

inline std::int64_t second(int i) { return INT64_C(1700000000000000) + INT64_C(1000000) * i; }

/// One beam from `at` at time i.
inline TestScan look(Xy at, double yaw_rad, double range_m, int i_time)
{
    TestScan s;
    s.pose = {at.x, at.y, yaw_rad, nullptr};
    s.ranges_m = {static_cast<float>(range_m)};
    s.stamp_us = second(i_time);
    return s;
}

/// n beams all around `at`, all of one range.
inline TestScan look_around(Xy at, std::uint32_t n, float range_m, int i_time)
{
    TestScan s;
    s.pose = {at.x, at.y, 0.1, nullptr};
    s.ranges_m.assign(n, range_m);
    s.angle_step_rad = 2.0 * kPi / n;
    s.stamp_us = second(i_time);
    return s;
}

/// A map, and how its counters change with each scan.
struct Keeping {
    TestMap map;

    explicit Keeping(const gpom_config_t &config) : map(config) {}

    /// Insert a scan; returns what it added to the counters.
    gpom_stats_t see(const TestScan &scan)
    {
        const gpom_stats_t before = map.stats();
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
        gpom_stats_t change = map.stats();
        auto *const counts = reinterpret_cast<std::uint64_t *>(&change);
        const auto *const old = reinterpret_cast<const std::uint64_t *>(&before);
        for (std::size_t i = 0; i < sizeof change / sizeof *counts; ++i) {
            REQUIRE(counts[i] >= old[i]); // counters only rise
            counts[i] -= old[i];
        }
        return change;
    }

    gpom_beam_t beam(std::uint32_t id) const
    {
        for (const gpom_beam_t &b : map.beams()) {
            if (b.id == id) {
                return b;
            }
        }
        FAIL("no beam ", id);
        return {};
    }

    bool stands(std::uint32_t id) const
    {
        const std::vector<gpom_beam_t> all = map.beams();
        return std::any_of(all.begin(), all.end(), [id](const auto &b) {
            return b.id == id && b.is_hit == 1 && b.past == 0;
        });
    }

    std::size_t n_provisional() const
    {
        const std::vector<gpom_beam_t> all = map.beams();
        return static_cast<std::size_t>(std::count_if(
            all.begin(), all.end(), [](const auto &b) { return b.provisional == 1; }));
    }

    gpom_answer_t ask(Xy at) { return query_points(map.get(), {{at.x, at.y}}).all[0]; }
};

/// Answers are those of brute force over the beams that are kept.
inline void check_answers(Keeping &k, const gpom_params_t &params, std::uint64_t stream)
{
    const std::vector<gpom_point_t> points = random_points(stream, 20, 20.0);
    const Answers answers = query_points(k.map.get(), points);
    const std::vector<Beam> beams = k.map.reference_beams();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Xy q = {points[i].x_m, points[i].y_m};
        const Neighbourhood truth = neighbourhood_of(params, beams, q);
        const auto n_hits = std::count_if(truth.points.begin(), truth.points.end(),
                                          [](const LabelledPoint &p) { return p.label > 0.0; });
        CHECK(answers.all[i].n_hits == n_hits);
        if (truth.is_clear) {
            const Moments moments = predict(params, truth.points, q);
            CHECK(static_cast<double>(answers.all[i].mean) ==
                  doctest::Approx(moments.mean).epsilon(2e-3));
        }
    }
}

} // namespace reference
