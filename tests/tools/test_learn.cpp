// Learning: derivatives are those of the values, values those of the map; no place knows itself.
#include "ports/host/params_toml.hpp"
#include "tests/common/reference.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/learn/lml.hpp"
#include "tools/map/host_map.hpp"
#include "tools/params_tool/writer.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

using namespace gpom_tools;
using reference::kKernels;
using reference::Random;

namespace
{

constexpr double kStep = 1e-5; ///< Of central differences: truncation and rounding near 1e-9.

constexpr double kBeamStep = 0.3; ///< Between the beams of a scan [rad].
constexpr double kFarthest = 9.5; ///< Usable range of its sensor [m].

/// Beams of scans at random poses in a square, a few without return.
LearnWorld random_world(Random &random, std::size_t n_scans)
{
    LearnWorld world;
    for (std::size_t i_scan = 0; i_scan < n_scans; ++i_scan) {
        const double x_m = random.uniform(-8.0, 8.0), y_m = random.uniform(-8.0, 8.0);
        const double first_rad = random.uniform(-reference::kPi, reference::kPi);
        for (int i = 0; i < 12; ++i) {
            const double bearing_rad = first_rad + kBeamStep * i;
            world.push_back({x_m, y_m, std::cos(bearing_rad), std::sin(bearing_rad),
                             random.uniform(0.5, 9.0), i_scan, i % 5 != 0});
        }
    }
    return world;
}

std::vector<LearnPlace> random_places(Random &random, std::size_t n)
{
    std::vector<LearnPlace> places;
    for (std::size_t i = 0; i < n; ++i) {
        places.push_back(
            {random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0), i % 2 == 0, 0, kNoBeam});
    }
    return places;
}

/// Nothing neutral.
LearntParams busy_params(gpom_kernel_t kernel)
{
    LearntParams params;
    params.kernel = kernel;
    params.sf2 = 1.7;
    params.s0 = 3.0;
    params.s1 = 0.6;
    params.ell_m = kernel == GPOM_KERNEL_ASKEY ? 11.0 : 3.0;
    params.sn2 = 0.08;
    params.sn2_free = 0.21;
    params.alpha = 2.3;
    params.beta = 0.4;
    params.gap_m = 0.15;
    params.depth_m = 0.3;
    params.scan_points_max = 2;
    params.anisotropy = 0.55;
    params.vote = 0.7;
    params.line = -0.6;
    params.sn2_once = 0.13;
    params.log_weights = {0.3, -0.2, 0.15, -0.4};
    params.fade_m = 7.0;
    params.beta_far = 0.3;
    params.n_fading = 3;
    return params;
}

std::vector<Neighbourhood> some_neighbourhoods(const LearntParams &params, std::uint64_t stream)
{
    Random random(stream);
    std::vector<LearnWorld> worlds = {random_world(random, 12)};
    for (std::size_t i = 0; i < worlds[0].size(); ++i) { // as of a live map
        worlds[0][i].noise = i % 3 == 0   ? HitNoise::kOnce
                             : i % 7 == 0 ? HitNoise::kPast
                                          : HitNoise::kSeen;
        worlds[0][i].free = i % 5 != 0;
    }
    return neighbourhoods_of(worlds, random_places(random, 20), rule_of(params), 1);
}

/// The parameter of a place in a gradient, or its logarithm where that is asked, moved by `step`.
LearntParams moved(LearntParams params, int derivative, double step)
{
    const double factor = std::exp(step);
    switch (derivative) {
    case kByShape0:
        (params.kernel == GPOM_KERNEL_NN ? params.s0 : params.ell_m) *= factor;
        break;
    case kByShape1:
        params.s1 *= factor;
        break;
    case kBySf2:
        params.sf2 *= factor;
        break;
    case kBySn2:
        params.sn2 *= factor;
        params.sn2_once *= factor;
        break;
    case kBySn2Once:
        params.sn2_once *= factor;
        break;
    case kBySn2Free:
        params.sn2_free *= factor;
        break;
    case kByAlpha:
        params.alpha *= factor;
        break;
    case kByBeta:
        params.beta += step;
        break;
    case kByAnisotropy:
        params.anisotropy += step;
        break;
    case kByVote:
        params.vote += step;
        break;
    case kByBetaFar:
        params.beta_far += step;
        break;
    case kByLine:
        params.line += step;
        break;
    default:
        params.log_weights[static_cast<std::size_t>(derivative - kByLogWeight)] += step;
    }
    return params;
}

FitOptions one_thread()
{
    FitOptions options;
    options.n_threads = 1;
    options.free_weight = 1.25;
    return options;
}

FitOptions options_of(const char *ingredients)
{
    FitOptions options = one_thread();
    options.ingredients = parse_ingredients(ingredients);
    options.has_once = options.ingredients.noise;
    return options;
}

/// The scans that a random world came from.
std::vector<Scan> scans_of(const LearnWorld &world)
{
    std::vector<Scan> scans;
    for (const LearnBeam &beam : world) {
        if (beam.i_scan == scans.size()) {
            scans.push_back({0.0,
                             beam.x_m,
                             beam.y_m,
                             std::atan2(beam.dir_y, beam.dir_x),
                             0.0,
                             kBeamStep,
                             kFarthest,
                             {}});
        }
        scans.back().ranges_m.push_back(beam.hit ? static_cast<float>(beam.range_m) : INFINITY);
    }
    return scans;
}

std::string scan_file(const std::vector<Scan> &scans)
{
    const std::string path = "/tmp/gpom_test_learn_" + std::to_string(getpid()) + ".csv";
    write_scans_csv(path, scans, "");
    return path;
}

} // namespace

// A wrong derivative lets the optimiser stop anywhere; every one is compared with differences.
TEST_CASE("the loss's gradient is its derivative, for every kernel and parameter")
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t kernel : kKernels) {
        const LearntParams params = busy_params(kernel);
        const auto neighbourhoods = some_neighbourhoods(params, 1);
        Gradient gradient;
        mean_loss(params, neighbourhoods, one_thread(), &gradient);
        for (int i = 0; i < kDerivatives; ++i) {
            CAPTURE(kernel);
            CAPTURE(i);
            const double slope =
                (mean_loss(moved(params, i, kStep), neighbourhoods, one_thread(), nullptr) -
                 mean_loss(moved(params, i, -kStep), neighbourhoods, one_thread(), nullptr)) /
                (2.0 * kStep);
            CHECK(std::fabs(gradient(i) - slope) <= 1e-7 + 1e-5 * std::fabs(slope));
            const bool matters = i != kByShape1 || kernel == GPOM_KERNEL_NN;
            CHECK((std::fabs(slope) > 1e-6) == matters); // a parameter that does nothing shows
        }
    }
}

TEST_CASE("the optimiser's gradient is the derivative in its own coordinates")
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t kernel : kKernels) {
        for (const char *ingredients : {"paper", "full", "noise,vote", "logs"}) {
            CAPTURE(kernel);
            CAPTURE(ingredients);
            LearntParams base = busy_params(kernel);
            const bool noise = parse_ingredients(ingredients).noise;
            base.sn2_free = noise ? base.sn2_free : base.sn2;
            base.sn2_once = noise ? base.sn2_once : 0.0;
            const FitSpace space(kernel, options_of(ingredients));
            const auto neighbourhoods = some_neighbourhoods(base, 2);
            const Eigen::VectorXd x = space.coordinates(base);
            Gradient by_params;
            mean_loss(base, neighbourhoods, one_thread(), &by_params);
            const Eigen::VectorXd gradient = space.gradient(base, by_params);
            for (Eigen::Index i = 0; i < x.size(); ++i) {
                const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(x.size(), i);
                const double slope = (mean_loss(space.params(base, x + step), neighbourhoods,
                                                one_thread(), nullptr) -
                                      mean_loss(space.params(base, x - step), neighbourhoods,
                                                one_thread(), nullptr)) /
                                     (2.0 * kStep);
                CHECK(std::fabs(gradient(i) - slope) <= 1e-7 + 1e-5 * std::fabs(slope));
            }
        }
    }
}

// Whatever the optimiser proposes inside its box, a place nobody has seen stays unsure.
TEST_CASE("any point of the fit's box has its prior probability between 0.35 and 0.65")
{
    GPOM_TELL_SEED();
    Random random(3);
    for (const gpom_kernel_t kernel : kKernels) {
        const FitSpace space(kernel, options_of("full"));
        const Box box = space.box();
        for (int round = 0; round < 100; ++round) {
            Eigen::VectorXd x = box.low;
            for (Eigen::Index i = 0; i < x.size(); ++i) {
                x(i) = random.uniform(box.low(i), box.high(i));
            }
            LearntParams base = busy_params(kernel);
            base.beta_far = 0.0; // by fit_far(), which has bounds of its own
            const LearntParams params = space.params(base, x);
            const double p0 = prior_probability(params);
            CHECK(std::fabs(p0 - 0.5) <= 0.15 + 1e-9);
            CHECK(params.alpha <= kAlphaMax * (1.0 + 1e-12));
            CHECK((space.coordinates(params) - x).cwiseAbs().maxCoeff() < 1e-7);
        }
    }
}

TEST_CASE("the loss is the same to the last bit with any number of threads")
{
    const LearntParams params = busy_params(GPOM_KERNEL_MATERN12);
    Random random(4);
    const std::vector<LearnWorld> worlds = {random_world(random, 12)};
    const auto neighbourhoods =
        neighbourhoods_of(worlds, random_places(random, 500), rule_of(params), 2);
    Gradient one, many;
    const double loss = mean_loss(params, neighbourhoods, one_thread(), &one);
    for (const unsigned n_threads : {2u, 3u, 7u}) {
        FitOptions options = one_thread();
        options.n_threads = n_threads;
        CHECK(mean_loss(params, neighbourhoods, options, &many) == loss);
        CHECK(one == many);
    }
}

/// True if a float's rounding may decide which of some distances are the n least: the n-th and the
/// next are as good as equal, but not all as good as equal to them are equal. Those that are, as to
/// free segments that all begin at the sensor, are told apart by ids.
bool is_tie(std::vector<double> distances_m, int n)
{
    constexpr double kRounding_m = 1e-5;
    std::sort(distances_m.begin(), distances_m.end());
    const auto last = distances_m.begin() + n - 1;
    if (distances_m.end() - last < 2 || *(last + 1) > *last + kRounding_m) {
        return false;
    }
    return std::any_of(distances_m.begin(), distances_m.end(), [&](double d_m) {
        return d_m != *last && std::fabs(d_m - *last) <= kRounding_m;
    });
}

/// True if map and learning may rightly take different neighbours for a place.
bool has_tie(const LearnWorld &world, const LearntParams &params, const LearnPlace &place)
{
    std::vector<double> to_hits_m, to_free_m;
    for (const LearnBeam &beam : world) {
        const double x_m = place.x_m - beam.x_m;
        const double y_m = place.y_m - beam.y_m;
        const auto distance_m = [&](double along_m) {
            return std::hypot(x_m - along_m * beam.dir_x, y_m - along_m * beam.dir_y);
        };
        const double along_m = x_m * beam.dir_x + y_m * beam.dir_y;
        const double end_m = beam.range_m;
        if (beam.hit) {
            to_hits_m.push_back(distance_m(std::clamp(along_m, end_m, end_m + params.depth_m)));
        }
        to_free_m.push_back(
            distance_m(std::clamp(along_m, 0.0, end_m - (beam.hit ? params.gap_m : 0.0))));
    }
    return is_tie(to_hits_m, params.n_hits) || is_tie(to_free_m, params.n_free);
}

// What is learnt is worth nothing if the map computes something else.
TEST_CASE("the probability is the library's, with every addition neutral and with all at work")
{
    GPOM_TELL_SEED();
    Random random(5);
    LearnWorld world = random_world(random, 10);
    for (LearnBeam &beam : world) {
        beam.range_m = beam.hit ? double{static_cast<float>(beam.range_m)} : kFarthest;
    }
    for (const gpom_kernel_t kernel : kKernels) {
        LearntParams neutral;
        neutral.kernel = kernel;
        neutral.s0 = 2.0;
        neutral.ell_m = kernel == GPOM_KERNEL_ASKEY ? 15.0 : 5.0;
        neutral.sn2_free = 0.3;
        neutral.alpha = 2.0;
        neutral.gap_m = 0.125;
        for (const LearntParams &params : {neutral, busy_params(kernel)}) {
            HostMap map(to_library(params), world.size(), {0.0, 0.0});
            map.insert(scans_of(world));
            const std::vector<LearnPlace> places = random_places(random, 200);
            const auto predictions = predictions_of(params, {world}, places, 1);
            std::vector<gpom_point_t> points;
            for (const LearnPlace &place : places) {
                points.push_back({place.x_m, place.y_m});
            }
            const std::vector<gpom_answer_t> answers = map.query(points);
            double worst = 0.0;
            int n_ties = 0;
            for (std::size_t i = 0; i < places.size(); ++i) {
                const bool is_unclear = has_tie(world, params, places[i]);
                const double error =
                    std::fabs(predictions[i].probability - double{answers[i].probability});
                n_ties += is_unclear ? 1 : 0;
                worst = is_unclear ? worst : std::max(worst, error);
            }
            CHECK(n_ties < 10);
            CAPTURE(kernel);
            CAPTURE(params.vote);
            CHECK(worst < 3e-4); // float32 against double, noise 0.08 or more
            CHECK(prior_probability(params) ==
                  doctest::Approx(double{map.query({{500.0, 500.0}})[0].probability})
                      .epsilon(kernel == GPOM_KERNEL_NN ? 0.05 : 1e-4)); // NN fades slowly
        }
    }
}

TEST_CASE("anisotropy, vote and distances do not depend on which way the map lies")
{
    GPOM_TELL_SEED();
    Random random(6);
    const LearnWorld world = random_world(random, 10);
    const std::vector<LearnPlace> places = random_places(random, 50);
    const double c = std::cos(0.83), s = std::sin(0.83);
    LearnWorld turned = world;
    for (LearnBeam &beam : turned) {
        beam.x_m = c * beam.x_m - s * beam.y_m;
        beam.y_m = s * world[static_cast<std::size_t>(&beam - turned.data())].x_m + c * beam.y_m;
        const double dir_x = beam.dir_x;
        beam.dir_x = c * dir_x - s * beam.dir_y;
        beam.dir_y = s * dir_x + c * beam.dir_y;
    }
    std::vector<LearnPlace> turned_places = places;
    for (std::size_t i = 0; i < places.size(); ++i) {
        turned_places[i].x_m = c * places[i].x_m - s * places[i].y_m;
        turned_places[i].y_m = s * places[i].x_m + c * places[i].y_m;
    }
    const LearntParams params = busy_params(GPOM_KERNEL_NN);
    const auto straight = predictions_of(params, {world}, places, 1);
    const auto round = predictions_of(params, {turned}, turned_places, 1);
    for (std::size_t i = 0; i < places.size(); ++i) {
        CHECK(straight[i].probability == doctest::Approx(round[i].probability).epsilon(1e-9));
    }
}

// One beam straight at a wall 3 m away: everything about the places before and behind it is known.
TEST_CASE("a single beam's vote, distances and depth are as drawn by hand")
{
    const std::vector<LearnWorld> worlds = {{{0.0, 0.0, 1.0, 0.0, 3.0, 0, true}}};
    const std::vector<LearnPlace> places = {{2.0, 0.0, false, 0, kNoBeam},
                                            {4.0, 0.0, true, 0, kNoBeam},
                                            {43.0, 0.0, true, 0, kNoBeam},
                                            {3.2, 0.0, true, 0, kNoBeam}};
    const auto found = neighbourhoods_of(worlds, places, {0.5, 0.4, 0, 1, 2}, 1);
    CHECK(found[0].vote == doctest::Approx(-(1.0 - 1.0 / 30.0)));
    CHECK(found[0].line == 0.0);                               // one hit makes no line
    CHECK(found[1].vote == doctest::Approx(1.0 - 0.6 / 30.0)); // the occupied part ends at 3.4 m
    CHECK(found[2].vote == 0.0);
    CHECK(found[3].vote == 0.0); // on the occupied part itself
    CHECK(found[3].points[0].along_m == doctest::Approx(0.0));
    CHECK(found[1].log_distances[0] == doctest::Approx(std::log(0.62)));
    CHECK(found[1].log_distances[2] == doctest::Approx(std::log(1.52))); // free up to 2.5 m
    CHECK(found[1].log_distances[3] == doctest::Approx(std::log(30.02)));
    CHECK(found[2].log_distances[0] == doctest::Approx(std::log(30.02)));
    CHECK(found[0].axis_ratio == 1.0);
}

TEST_CASE("a place's own beam is not in its neighbourhood")
{
    Random random(7);
    LearnWorld world = random_world(random, 4);
    std::vector<LearnPlace> places;
    LearnWorld without = world;
    without.erase(without.begin() + 3);
    const LearnBeam &own = world[3];
    places.push_back(
        {own.x_m + own.range_m * own.dir_x, own.y_m + own.range_m * own.dir_y, true, 0, 3});
    const LearntParams params = busy_params(GPOM_KERNEL_SE);
    const auto left_out = predictions_of(params, {world}, places, 1);
    places[0].own = kNoBeam;
    CHECK(left_out[0].probability ==
          doctest::Approx(predictions_of(params, {without}, places, 1)[0].probability));
    CHECK(left_out[0].probability != predictions_of(params, {world}, places, 1)[0].probability);
}

TEST_CASE("no scan gives more points than the cap, and none from beyond half more of the nearest")
{
    const std::size_t n = 4;
    LearnWorld world; // scan 0 gives the five nearest hits, scans 1 to 9 one each behind them
    for (int i = 0; i < 5; ++i) {
        world.push_back({0.0, 0.0, 1.0, 0.0, 1.0 + 0.01 * i, 0, true});
    }
    for (std::size_t i = 1; i < 10; ++i) {
        world.push_back({0.0, 0.0, 1.0, 0.0, 2.0 + 0.01 * static_cast<double>(i), i, true});
    }
    const std::vector<LearnPlace> places = {{0.0, 0.0, true, 0, kNoBeam}};
    const auto count_hits = [&](std::size_t cap) {
        std::size_t n_hits = 0;
        const auto found = neighbourhoods_of({world}, places, {0.1, 0.0, cap, n, n}, 1);
        for (const NeighbourPoint &p : found[0].points) {
            n_hits += p.label > 0.0 ? 1 : 0;
        }
        return n_hits;
    };
    CHECK(count_hits(0) == 4);
    CHECK(count_hits(2) == 3); // of 6: two of scan 0, one of scan 1; fewer than n remain
    CHECK(count_hits(4) == 4);
}

TEST_CASE("eq. 6 is the Gaussian's log density and its gradient the derivative, for every kernel")
{
    GPOM_TELL_SEED();
    Random random(8);
    const LearnWorld world = random_world(random, 8);
    for (const gpom_kernel_t kernel : kKernels) {
        CAPTURE(kernel);
        LearntParams params = busy_params(kernel);
        params.anisotropy = 0.0;
        const Neighbourhood subset = random_subset(world, 0.1, 40, 9);
        ModelWork work;
        Gradient gradient = Gradient::Zero();
        const double loss = negative_lml(params, subset, work, &gradient);
        const auto n = static_cast<Eigen::Index>(subset.points.size());
        Eigen::MatrixXd a(n, n);
        Eigen::VectorXd y(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const NeighbourPoint &p = subset.points[static_cast<std::size_t>(i)];
            y(i) = p.label;
            for (Eigen::Index j = 0; j < n; ++j) {
                const NeighbourPoint &q = subset.points[static_cast<std::size_t>(j)];
                a(i, j) = covariance_of(params, {p.along_m, p.across_m, 0.0},
                                        {q.along_m, q.across_m, 0.0})
                              .k;
            }
            a(i, i) += p.label > 0.0 ? params.sn2 : params.sn2_free;
        }
        const Eigen::FullPivLU<Eigen::MatrixXd> lu(a);
        const double log_determinant = lu.matrixLU().diagonal().array().abs().log().sum();
        const double log_density = -0.5 * y.dot(lu.solve(y)) - 0.5 * log_determinant -
                                   0.5 * static_cast<double>(n) * std::log(2.0 * reference::kPi);
        CHECK(loss == doctest::Approx(-log_density / static_cast<double>(n)).epsilon(1e-8));
        for (int i = 0; i <= kBySn2Free; ++i) {
            CAPTURE(i);
            const double slope = (negative_lml(moved(params, i, kStep), subset, work, nullptr) -
                                  negative_lml(moved(params, i, -kStep), subset, work, nullptr)) /
                                 (2.0 * kStep);
            CHECK(std::fabs(gradient(i) - slope) <= 1e-7 + 1e-5 * std::fabs(slope));
        }
    }
}

// The trap of eqs. 8 and 9: the variance of a left-out label contains its noise, the latent one
// does not.
TEST_CASE("leave-one-out moments are those of the map without the point")
{
    GPOM_TELL_SEED();
    Random random(10);
    const LearnWorld world = random_world(random, 8);
    LearntParams params = busy_params(GPOM_KERNEL_MATERN32);
    params.anisotropy = 0.0;
    params.fade_m = 0.0;
    const Neighbourhood subset = random_subset(world, 0.1, 20, 11);
    ModelWork work;
    const std::vector<LatentMoments> moments = left_out_moments(params, subset, work);
    for (std::size_t i = 0; i < subset.points.size(); ++i) {
        Neighbourhood others = subset;
        const NeighbourPoint out = subset.points[i];
        others.points.erase(others.points.begin() + static_cast<std::ptrdiff_t>(i));
        for (NeighbourPoint &point : others.points) { // the query is the origin
            point.along_m -= out.along_m;
            point.across_m -= out.across_m;
        }
        work.assemble(params, others, false);
        work.solve();
        CHECK(moments[i].mean == doctest::Approx(work.moments().mean).epsilon(1e-8));
        CHECK(moments[i].variance == doctest::Approx(work.moments().variance).epsilon(1e-8));
    }
}

TEST_CASE("a log's map is the one that is evaluated, and held-out places are in other scans")
{
    Random random(12);
    std::vector<Scan> scans;
    for (int i = 0; i < 45; ++i) {
        Scan scan{static_cast<double>(i), 100.0 * i, 0.0, 0.0, -1.5, 0.05, 30.0, {}};
        for (int j = 0; j < 60; ++j) {
            scan.ranges_m.push_back(random.uniform_f(1.0, 35.0));
        }
        scans.push_back(scan);
    }
    DataOptions options;
    options.fraction = 0.2;
    options.n_places = 300;
    options.n_held_out = 300;
    options.seed = 5;
    const std::string path = scan_file(scans);
    const LearnData data = log_data({{path, ""}}, options);
    std::remove(path.c_str());
    const LogSplit split = split_log(scans, options.fraction, options.seed);
    std::size_t i_beam = 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
        for (const float range_m : split.training[i].ranges_m) {
            if (!std::isnan(range_m)) {
                REQUIRE(i_beam < data.worlds[0].size());
                CHECK(data.worlds[0][i_beam].i_scan == i);
                CHECK(data.worlds[0][i_beam].range_m == double{range_m});
                ++i_beam;
            }
        }
    }
    CHECK(i_beam == data.worlds[0].size());
    std::set<bool> seen;
    for (const auto *places : {&data.learning, &data.held_out}) {
        for (const LearnPlace &place : *places) { // scans are 100 m apart and reach 30 m
            const auto i_scan = static_cast<std::size_t>(std::lround(place.x_m / 100.0));
            CHECK(is_held_out(i_scan, scans.size()) == (places == &data.held_out));
            seen.insert(place.occupied);
        }
    }
    CHECK(seen.size() == 2);
    for (const LearnPlace &place : data.learning) {
        CHECK(place.own < data.worlds[0].size());
    }
}

TEST_CASE("written parameters are read back, neutral ones and others")
{
    const std::string path = "/tmp/gpom_test_learn_" + std::to_string(getpid()) + ".toml";
    for (const gpom_kernel_t kernel : kKernels) {
        LearntParams neutral;
        neutral.kernel = kernel;
        for (const LearntParams &params : {neutral, busy_params(kernel)}) {
            const std::string text = params_toml(to_six_digits(params), "one\ntwo");
            CHECK((text.find("vote") == std::string::npos) == (params.vote == 0.0));
            replace_files({{path, text}});
            const gpom_params_t read = read_params(path);
            std::remove(path.c_str());
            const gpom_params_t direct = to_library(params);
            CHECK(read.kernel == direct.kernel);
            CHECK(read.scan_points_max == direct.scan_points_max);
            for (const auto field :
                 {&gpom_params_t::sn2_free, &gpom_params_t::sn2_once, &gpom_params_t::beta,
                  &gpom_params_t::depth_m, &gpom_params_t::anisotropy, &gpom_params_t::line,
                  &gpom_params_t::fade_m, &gpom_params_t::log_hit_last,
                  &gpom_params_t::log_free_first}) {
                CHECK(read.*field == doctest::Approx(direct.*field).epsilon(1e-5));
            }
        }
    }
}
