// Queries: the whole way from scans to answers, against brute force in double and against
// themselves.
#include "src/map/map.hpp"
#include "tests/common/models.hpp"

#include <thread>

using namespace reference;

namespace
{

/// Hits on one bearing, whose free segments all begin at one place: a query behind it has ties.
void fill_one_bearing(TestMap &map, Random &random)
{
    for (int i = 0; i < 10; ++i) {
        TestScan s;
        s.stamp_us = 100000 * i;
        s.ranges_m = {random.uniform_f(4.0, 8.0)};
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
    }
}

bool is_prior(const gpom_answer_t &a, const gpom_params_t &p)
{
    return a.mean == 0.0f && a.variance == gpom_params_prior_variance(&p) &&
           a.probability == gpom_params_prior_probability(&p) && a.cls == GPOM_UNSURE;
}

/// What an absent point of noise 1e30 may leave, and in map coordinates the prior of another place.
bool is_near_prior(const gpom_answer_t &a, const gpom_params_t &p)
{
    const bool is_nn = p.kernel == GPOM_KERNEL_NN;
    const float prior = gpom_params_prior_variance(&p);
    const float most = is_nn && p.frame == GPOM_FRAME_MAP ? p.sf2 * 1.5708f : prior;
    return std::abs(a.mean) <= 1e-12f && a.variance >= 0.99999f * prior &&
           a.variance <= 1.00001f * most && a.cls == GPOM_UNSURE;
}

bool is_number(const gpom_answer_t &a)
{
    return std::isfinite(a.mean) && std::isfinite(a.variance) && std::isfinite(a.probability);
}

} // namespace

// From scan to probability: mean and variance within 1e-4 and p within 1e-3 of a brute-force solve
// in double, wherever the choice of neighbours is not a matter of float32 rounding.
TEST_CASE("answers equal brute force in double")
{
    for_all_kernels_and_frames([](const gpom_params_t &p) {
        TestMap map(config_of(p));
        fill(map, Built::yes);
        const std::vector<Beam> beams = map.reference_beams();
        const std::vector<gpom_point_t> points = yard_points(map, 200);
        const Answers answers = query_points(map.get(), points);
        CHECK(answers.status == GPOM_OK);
        std::size_t n_clear = 0;
        double worst_mean = 0.0, worst_variance = 0.0, worst_p = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Xy q = {static_cast<double>(static_cast<float>(points[i].x_m)),
                          static_cast<double>(static_cast<float>(points[i].y_m))};
            const Neighbourhood near = neighbourhood_of(p, beams, q);
            if (!near.is_clear) {
                continue;
            }
            ++n_clear;
            std::vector<LabelledPoint> in_frame = near.points;
            for (LabelledPoint &point : in_frame) {
                point.at =
                    p.frame == GPOM_FRAME_MAP ? point.at : Xy{point.at.x - q.x, point.at.y - q.y};
            }
            const Moments truth = predict(p, in_frame, p.frame == GPOM_FRAME_MAP ? q : Xy{0, 0});
            const gpom_answer_t &a = answers.all[i];
            worst_mean = std::max(worst_mean, std::abs(static_cast<double>(a.mean) - truth.mean));
            worst_variance = std::max(worst_variance,
                                      std::abs(static_cast<double>(a.variance) - truth.variance));
            worst_p =
                std::max(worst_p, std::abs(static_cast<double>(a.probability) - squash(p, truth)));
            CHECK(a.n_hits == p.n_hits);
            CHECK(a.n_free == p.n_free);
        }
        CHECK(n_clear * 10 >= points.size() * 9);
        CHECK(worst_mean <= 1e-4);
        CHECK(worst_variance <= 1e-4);
        CHECK(worst_p <= 1e-3);
    });
}

// A point's answer is the same to the last bit alone, in lists of any length and order, and in any
// part of a packet.
TEST_CASE("answers do not depend on the list they are asked in")
{
    for_all_models([](const gpom_params_t &p) {
        TestMap map(config_of(p));
        fill(map, Built::half);
        std::vector<gpom_point_t> points = yard_points(map, 20);
        std::vector<gpom_answer_t> alone;
        for (const gpom_point_t &point : points) {
            alone.push_back(query_points(map.get(), {point}).all[0]);
        }
        for (std::size_t first = 0; first < points.size(); ++first) {
            const std::vector<gpom_point_t> tail(
                points.begin() + static_cast<std::ptrdiff_t>(first), points.end());
            const std::vector<gpom_answer_t> expected(
                alone.begin() + static_cast<std::ptrdiff_t>(first), alone.end());
            REQUIRE(same_bits(query_points(map.get(), tail).all, expected));
        }
        std::reverse(points.begin(), points.end());
        std::reverse(alone.begin(), alone.end());
        CHECK(same_bits(query_points(map.get(), points).all, alone));
    });
}

// Full anisotropy makes points on a line equal that are not; at a query that has no ties they stay
// apart even where its neighbour in the packet has ties.
TEST_CASE("a query with ties changes no answer of its packet")
{
    GPOM_TELL_SEED();
    Random random(117);
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        gpom_params_t p = params_of(which);
        p.sf2 = 1.0f;
        for (const float anisotropy : {0.99f, 1.0f}) {
            p.anisotropy = anisotropy;
            TestMap map(config_of(p));
            fill_one_bearing(map, random);
            for (int i = 0; i < 200; ++i) {
                const gpom_point_t own = {random.uniform(-2.0, 10.0), random.uniform(-2.0, 2.0)};
                const gpom_point_t tied = {random.uniform(-3.0, -0.1), random.uniform(-1.0, 1.0)};
                const gpom_answer_t alone = query_points(map.get(), {own}).all[0];
                REQUIRE(same_bits(query_points(map.get(), {own, tied}).all[0], alone));
            }
        }
    }
}

// Long lists are answered in another order than they are asked, block by block: wherever a point
// stands, among points that are far away, not finite or equal, it gets its own answer.
TEST_CASE("long lists give each point its own answer")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    fill(map, Built::half);
    std::vector<gpom_point_t> points = yard_points(map, 700);
    Random random(116);
    for (int i = 0; i < 20; ++i) {
        const double bads[] = {static_cast<double>(kNan), static_cast<double>(kInf), -1e300, 7e3};
        points[random.below(700)].x_m = bads[i % 4];
        points[random.below(700)].y_m = bads[(i / 4) % 4];
        points[random.below(700)] = points[random.below(700)];
    }
    std::vector<gpom_answer_t> alone;
    for (const gpom_point_t &point : points) {
        alone.push_back(query_points(map.get(), {point}).all[0]);
    }
    for (const std::size_t n : {std::size_t{17}, std::size_t{255}, std::size_t{256},
                                std::size_t{257}, std::size_t{513}, points.size()}) {
        const auto end = static_cast<std::ptrdiff_t>(n);
        CHECK(same_bits(query_points(map.get(), {points.begin(), points.begin() + end}).all,
                        {alone.begin(), alone.begin() + end}));
    }
    for (std::size_t i = points.size() - 1; i > 0; --i) {
        const std::size_t j = random.below(static_cast<std::uint32_t>(i + 1));
        std::swap(points[i], points[j]);
        std::swap(alone[i], alone[j]);
    }
    CHECK(same_bits(query_points(map.get(), points).all, alone));
}

// A raster of any size gives the bits of the list of its centres.
TEST_CASE("a raster answers like the list of its centres")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_NN)));
    fill(map, Built::half);
    for (std::uint32_t nx = 0; nx <= 9; ++nx) {
        for (std::uint32_t ny = 0; ny <= 9; ++ny) {
            const gpom_raster_t raster = {-3.3, 1.7, 0.61, nx, ny};
            std::vector<gpom_point_t> centres;
            for (std::uint32_t iy = 0; iy < ny; ++iy) {
                for (std::uint32_t ix = 0; ix < nx; ++ix) {
                    centres.push_back({raster.x0_m + (ix + 0.5) * raster.cell_m,
                                       raster.y0_m + (iy + 0.5) * raster.cell_m});
                }
            }
            if (!centres.empty()) {
                const Answers answers = query_raster(map.get(), raster);
                REQUIRE(answers.status == GPOM_OK);
                REQUIRE(same_bits(answers.all, query_points(map.get(), centres).all));
            }
        }
    }
}

// Beams that are not indexed, partly indexed or all indexed give bit-identical answers.
TEST_CASE("indexing changes no bit of any answer")
{
    for_all_models([](const gpom_params_t &p) {
        TestMap recent(config_of(p));
        TestMap half(config_of(p));
        TestMap built(config_of(p));
        fill(recent, Built::no);
        fill(half, Built::half);
        fill(built, Built::yes);
        const std::vector<gpom_point_t> points = yard_points(recent, 200);
        const Answers answers = query_points(recent.get(), points);
        CHECK(same_bits(query_points(half.get(), points).all, answers.all));
        CHECK(same_bits(query_points(built.get(), points).all, answers.all));
    });
}

// Two threads with a scratch each get what one gets.
TEST_CASE("two threads may query one map at once")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN32)));
    fill(map, Built::half);
    const std::vector<gpom_point_t> points = yard_points(map, 500);
    const Answers expected = query_points(map.get(), points);
    std::vector<std::vector<gpom_answer_t>> got(2, std::vector<gpom_answer_t>(points.size()));
    gpom_status_t status[2];
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < 2; ++t) {
        threads.emplace_back([&, t] {
            std::vector<unsigned char> mem(gpom_scratch_bytes(map.get()));
            const gpom_scratch_t scratch = {mem.data(), mem.size()};
            for (int round = 0; round < 5; ++round) {
                status[t] = gpom_query_points(map.get(), points.data(), points.size(),
                                              got[t].data(), &scratch);
            }
        });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    for (std::size_t t = 0; t < 2; ++t) {
        CHECK(status[t] == GPOM_OK);
        CHECK(same_bits(got[t], expected.all));
    }
}

// Far from all beams nothing is known: the mean is about 0, the variance about the prior's, the
// class unsure.
TEST_CASE("far from all beams the answer is about the prior")
{
    for_all_kernels_and_frames([](const gpom_params_t &p) {
        if (p.kernel == GPOM_KERNEL_NN && p.frame == GPOM_FRAME_MAP) {
            return; // eq. 4 in map coordinates is not stationary: it knows something everywhere
        }
        TestMap map(config_of(p));
        fill(map, Built::yes);
        const Answers answers = query_points(map.get(), {{2000, 1500}, {-3000, 10}, {0, 5000}});
        CHECK(answers.status == GPOM_OK);
        for (const gpom_answer_t &a : answers.all) {
            CHECK(std::abs(a.mean) <= 0.02f);
            CHECK(a.variance >= 0.98f * gpom_params_prior_variance(&p));
            CHECK(a.cls == GPOM_UNSURE);
        }
    });
}

// An empty map knows the prior alone.
TEST_CASE("an empty map gives the prior")
{
    for_all_models([](const gpom_params_t &p) {
        TestMap map(config_of(p));
        const Answers answers = query_points(map.get(), {{0, 0}, {0, 0}});
        CHECK(answers.status == GPOM_OK);
        CHECK(is_near_prior(answers.all[0], p));
        CHECK(answers.all[1].n_hits + answers.all[1].n_free == 0);
        CHECK(answers.all[1].flags == 0);
    });
}

// Points that are not finite or out of reach get the prior and a flag; those beside them their
// answers.
TEST_CASE("bad points are flagged and spoil no other")
{
    GPOM_TELL_SEED();
    const gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
    TestMap map(config_of(p));
    fill(map, Built::half);
    const double nan = static_cast<double>(kNan), inf = static_cast<double>(kInf);
    const gpom_point_t bads[] = {{nan, 0},       {0, nan},   {inf, 0},       {0, -inf},
                                 {1e300, 1e300}, {17000, 0}, {-12000, 12000}};
    const std::vector<gpom_point_t> good = yard_points(map, 30);
    const Answers expected = query_points(map.get(), good);
    std::vector<gpom_point_t> mixed;
    for (std::size_t i = 0; i < good.size(); ++i) {
        mixed.push_back(bads[i % std::size(bads)]);
        mixed.push_back(good[i]);
    }
    const Answers answers = query_points(map.get(), mixed);
    CHECK(answers.status == GPOM_ERR_REACH);
    for (std::size_t i = 0; i < good.size(); ++i) {
        CHECK(answers.all[2 * i].flags == GPOM_ANSWER_OUT_OF_REACH);
        CHECK(is_prior(answers.all[2 * i], p));
        CHECK(same_bits(answers.all[2 * i + 1], expected.all[i]));
    }
}

// The reach of queries is what map.h states: GPOM_REACH_M about the origin, not more.
TEST_CASE("queries reach GPOM_REACH_M from the origin")
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12));
    config.origin_x_m = 1000.0;
    TestMap map(config);
    CHECK(query_points(map.get(), {{1000.0 + 7999.0, 0}}).status == GPOM_OK);
    CHECK(query_points(map.get(), {{1000.0, -7999.0}}).status == GPOM_OK);
    CHECK(query_points(map.get(), {{1000.0 + 8001.0, 0}}).status == GPOM_ERR_REACH);
    CHECK(query_points(map.get(), {{1000.0 - 5700.0, 5700.0}}).status == GPOM_ERR_REACH);
}

// However far the covariance itself reaches: from fade_m on nothing of the neighbours is left, and
// short of it the variance is below the prior's.
TEST_CASE("from fade_m on the answer is the prior")
{
    for_all_kernels_and_frames([](gpom_params_t p) {
        if (p.frame == GPOM_FRAME_MAP) {
            return;
        }
        p = with_additions(p);
        TestMap map(config_of(p));
        fill(map, Built::half);
        const Answers far = query_points(map.get(), {{400.0, -300.0}, {-150.0, 150.0}});
        for (const gpom_answer_t &answer : far.all) {
            CHECK(answer.mean == 0.0f);
            CHECK(answer.variance == gpom_params_prior_variance(&p));
            CHECK(std::fabs(answer.probability - gpom_params_prior_probability(&p)) <= 1e-6f);
        }
        const Answers near = query_points(map.get(), yard_points(map, 50));
        for (const gpom_answer_t &answer : near.all) {
            CHECK(answer.variance <= gpom_params_prior_variance(&p));
        }
    });
}

// The exact scratch at any alignment is enough and untouched outside; a byte less, or none, is
// refused.
TEST_CASE("scratch of the exact size is enough at any alignment")
{
    GPOM_TELL_SEED();
    for (const std::uint16_t n : {std::uint16_t{1}, std::uint16_t{8}, std::uint16_t{32}}) {
        gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
        p.n_hits = n;
        p.n_free = n;
        p.scan_points_max = n == 8 ? 0 : 2; // a cap needs room for more neighbours
        TestMap map(config_of(p));
        fill(map, Built::half);
        const std::vector<gpom_point_t> points = yard_points(map, 20);
        const Answers expected = query_points(map.get(), points);
        const std::size_t need = gpom_scratch_bytes(map.get());
        CHECK(need <= GPOM_SCRATCH_BYTES(2 * n, gpom_lanes()));
        CHECK(gpom_lanes() <= GPOM_LANES_MAX);
        for (std::size_t offset = 0; offset < 64; ++offset) {
            GuardedMemory memory(need, offset);
            std::vector<gpom_answer_t> answers(points.size());
            gpom_scratch_t scratch = {memory.mem(), need};
            REQUIRE(gpom_query_points(map.get(), points.data(), points.size(), answers.data(),
                                      &scratch) == GPOM_OK);
            REQUIRE(same_bits(answers, expected.all));
            REQUIRE(memory.is_intact());
            scratch.mem_bytes = need - 1;
            REQUIRE(gpom_query_points(map.get(), points.data(), points.size(), answers.data(),
                                      &scratch) == GPOM_ERR_MEM);
        }
    }
}

// Broken arguments are refused and no answer is written.
TEST_CASE("query arguments are checked")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_SE)));
    std::vector<unsigned char> mem(gpom_scratch_bytes(map.get()));
    const gpom_scratch_t scratch = {mem.data(), mem.size()};
    const gpom_scratch_t none = {nullptr, mem.size()};
    const gpom_point_t point = {0, 0};
    gpom_answer_t answer = {};
    answer.mean = 42.0f;
    CHECK(gpom_query_points(nullptr, &point, 1, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_points(map.get(), nullptr, 1, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_points(map.get(), &point, 1, nullptr, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_points(map.get(), &point, 1, &answer, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_query_points(map.get(), &point, 1, &answer, &none) == GPOM_ERR_MEM);
    CHECK(gpom_query_points(map.get(), nullptr, 0, nullptr, &scratch) == GPOM_OK);
    gpom_raster_t raster = {0, 0, 1.0, 1, 1};
    CHECK(gpom_query_raster(nullptr, &raster, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_raster(map.get(), nullptr, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_raster(map.get(), &raster, nullptr, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_query_raster(map.get(), &raster, &answer, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_query_raster(map.get(), &raster, &answer, &none) == GPOM_ERR_MEM);
    for (const float bad : {0.0f, -1.0f, kNan, kInf}) {
        raster.cell_m = static_cast<double>(bad);
        CHECK(gpom_query_raster(map.get(), &raster, &answer, &scratch) == GPOM_ERR_ARG);
    }
    CHECK(answer.mean == 42.0f);
    raster = {static_cast<double>(kNan), 0, 1.0, 1, 1};
    CHECK(gpom_query_raster(map.get(), &raster, &answer, &scratch) == GPOM_ERR_REACH);
    CHECK(answer.flags == GPOM_ANSWER_OUT_OF_REACH);
}

// The same world elsewhere, with its origin moved along, answers the same within rounding.
TEST_CASE("a shifted world answers alike")
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        const std::vector<gpom_point_t> points = random_points(112, 100, 15.0);
        TestMap here(config_of(params_of(which)));
        drive(here.get(), 113, 4);
        const Answers expected = query_points(here.get(), points);
        for (const Xy shift : {Xy{400e3, 5800e3}, Xy{-1024.0, 77.0}}) {
            gpom_config_t config = config_of(params_of(which));
            config.origin_x_m = shift.x;
            config.origin_y_m = shift.y;
            TestMap there(config);
            drive(there.get(), 113, 4, shift);
            std::vector<gpom_point_t> moved = points;
            for (gpom_point_t &point : moved) {
                point = {point.x_m + shift.x, point.y_m + shift.y};
            }
            const Answers answers = query_points(there.get(), moved);
            double worst = 0.0;
            for (std::size_t i = 0; i < points.size(); ++i) {
                worst = std::max(
                    {worst,
                     std::abs(static_cast<double>(answers.all[i].mean - expected.all[i].mean)),
                     std::abs(
                         static_cast<double>(answers.all[i].variance - expected.all[i].variance))});
            }
            CHECK(worst <= 1e-4);
        }
    }
}

// Should a matrix not be positive definite after all, the answer is the prior, flagged, and never a
// NaN. Legal noise prevents it, so the test takes the noise away behind the map's back.
TEST_CASE("a matrix that cannot be factored gives the prior and GPOM_ERR_PIVOT")
{
    GPOM_TELL_SEED();
    gpom_params_t p = params_of(GPOM_KERNEL_MATERN32);
    p.ell_m = 1e3f;
    p.n_hits = p.n_free = 32;
    TestMap map(config_of(p));
    map.get()->noise = {0.0f, 0.0f, 0.0f, 0.0f};
    const Xy far = {5000.0, 5000.0};
    drive(map.get(), 114, 4, far);
    const Answers answers = query_points(map.get(), random_points(115, 200, 15.0, far));
    std::size_t n_flagged = 0;
    for (const gpom_answer_t &a : answers.all) {
        CHECK(is_number(a));
        if ((a.flags & GPOM_ANSWER_PIVOT) != 0) {
            ++n_flagged;
            CHECK(is_near_prior(a, p));
        }
    }
    CHECK(n_flagged > 0);
    CHECK(answers.status == GPOM_ERR_PIVOT);
}

// Fewer beams than neighbours asked for: all take part, and the count says how many.
TEST_CASE("fewer beams than neighbours")
{
    const gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
    TestMap map(config_of(p));
    TestScan s;
    s.angle_step_rad = 0.5;
    s.ranges_m = {3.0f, kInf, 5.0f};
    REQUIRE(s.insert_into(map.get()) == GPOM_OK);
    const Xy q = {1.0, 0.5};
    for (int round = 0; round < 2; ++round) {
        const gpom_answer_t a = query_points(map.get(), {{q.x, q.y}}).all[0];
        CHECK(a.n_hits == 2);
        CHECK(a.n_free == 3);
        const Neighbourhood near = neighbourhood_of(p, map.reference_beams(), q);
        const Moments truth = predict(p, near.points, q);
        CHECK(static_cast<double>(a.mean) == doctest::Approx(truth.mean).epsilon(1e-4));
        CHECK(static_cast<double>(a.variance) == doctest::Approx(truth.variance).epsilon(1e-4));
        REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
    }
}
