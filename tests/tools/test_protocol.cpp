#include "tests/common/reference.hpp"
#include "tools/eval/neighbour_check.hpp"
#include "tools/eval/protocol.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

namespace
{

using namespace gpom_tools;

std::vector<Scan> numbered_scans(std::size_t n)
{
    std::vector<Scan> scans;
    for (std::size_t i = 0; i < n; ++i) { // each on its own spot, so that a point tells its scan
        scans.push_back({0.0,
                         100.0 * static_cast<double>(i),
                         0.0,
                         0.0,
                         0.0,
                         0.1,
                         20.0,
                         {4.0f, 5.0f, 30.0f, 6.0f}});
    }
    return scans;
}

} // namespace

// Two whole runs of 40 scans judge and nothing of them is in the map.
TEST_CASE("a log is split into runs that judge and other scans that make the map")
{
    const std::vector<Scan> scans = numbered_scans(310);
    const LogSplit split = split_log_runs(scans, 0.25, 3);
    std::vector<bool> judges;
    std::size_t n_training = 0;
    for (std::size_t s = 0; s < scans.size(); ++s) {
        judges.push_back(!std::isnan(split.others[s].ranges_m[0]));
        for (const std::size_t i : {0, 1, 3}) {
            const bool trains = !std::isnan(split.training[s].ranges_m[i]);
            CHECK(std::isnan(split.others[s].ranges_m[i]) != judges[s]);
            CHECK_FALSE((trains && judges[s]));
            n_training += trains ? 1 : 0;
        }
        CHECK(std::isnan(split.training[s].ranges_m[2]));
        CHECK((s % kRunScans == 0 || s >= 280 || judges[s] == judges[s - 1]));
    }
    CHECK(std::count(judges.begin(), judges.end(), true) == 80);
    CHECK(n_training > 0.2 * 230 * 3);
    CHECK(n_training < 0.3 * 230 * 3);
    CHECK(split.points.size() == 240);
    for (const TestPoint &point : split.points) {
        CHECK(judges[static_cast<std::size_t>(point.at.x_m / 100.0)]);
    }
}

TEST_CASE("runs need twice their number of whole runs, and something to train with")
{
    CHECK_THROWS_AS(split_log_runs(numbered_scans(159), 0.25, 0), std::runtime_error);
    CHECK_NOTHROW(split_log_runs(numbered_scans(160), 1.0, 0));
    CHECK_THROWS_AS(split_log_runs(numbered_scans(160), 0.0, 0), std::runtime_error);
}

// The dense solution against the tests' own, with every beam a neighbour.
TEST_CASE("the dense model takes every beam into every query")
{
    for (const gpom_kernel_t kernel : reference::kKernels) {
        for (const gpom_frame_t frame : {GPOM_FRAME_QUERY, GPOM_FRAME_MAP}) {
            gpom_params_t params = reference::params_of(kernel, frame);
            reference::TestMap map(reference::config_of(params));
            reference::drive(map.get(), 5, 3);
            const auto points = reference::random_points(6, 8, 12.0);
            const auto moments = dense_moments(params, map.beams(), points, {0.0, 0.0});
            params.n_hits = params.n_free = 1000;
            for (std::size_t i = 0; i < points.size(); ++i) {
                const reference::Xy query{points[i].x_m, points[i].y_m};
                auto all = reference::neighbourhood_of(params, map.reference_beams(), query).points;
                for (reference::LabelledPoint &point : all) {
                    point.at.x -= frame == GPOM_FRAME_QUERY ? query.x : 0.0;
                    point.at.y -= frame == GPOM_FRAME_QUERY ? query.y : 0.0;
                }
                const auto expected = reference::predict(
                    params, all, frame == GPOM_FRAME_QUERY ? reference::Xy{0.0, 0.0} : query);
                CHECK(moments[i].mean == doctest::Approx(expected.mean).epsilon(1e-9));
                CHECK(moments[i].variance == doctest::Approx(expected.variance).epsilon(1e-6));
            }
        }
    }
}

TEST_CASE("the plain model keeps the paper's parameters and drops every addition")
{
    gpom_params_t params = reference::params_of(GPOM_KERNEL_MATERN32);
    const float prior = gpom_params_prior_probability(&params);
    params.vote = 1.0f;
    params.anisotropy = 0.5f;
    params.depth_m = 0.3f;
    params.scan_points_max = 2;
    params.fade_m = 20.0f;
    params.sn2_once = 0.5f;
    params.log_hit_first = params.log_free_last = 0.4f;
    const gpom_params_t plain = plain_params(params);
    CHECK(gpom_params_check(&plain, nullptr) == GPOM_OK);
    CHECK(gpom_params_prior_probability(&plain) == prior);
    CHECK(plain.ell_m == params.ell_m);
    CHECK(plain.sn2_free == params.sn2_free);
    CHECK(plain.vote == 0.0f);
    CHECK(plain.anisotropy == 0.0f);
    CHECK(plain.depth_m == 0.0f);
    CHECK(plain.scan_points_max == 0);
    CHECK(plain.fade_m == 0.0f);
    CHECK(plain.sn2_once == 0.0f);
}
