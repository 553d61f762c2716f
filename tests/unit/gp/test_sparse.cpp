// The sparse solve: against the dense one, against brute force in double, and against itself.
#include "src/gp/sparse_gp.hpp"
#include "src/map/map.hpp"
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

/// Askey with as many hits as free points, n together. Small lengths leave most of K zero.
gpom_params_t askey(unsigned n, float ell_m)
{
    gpom_params_t p = params_of(GPOM_KERNEL_ASKEY);
    p.sf2 = 1.0f;
    p.sn2 = p.sn2_free = 0.2f;
    p.alpha = 10.0f;
    p.n_hits = static_cast<std::uint16_t>(n / 2);
    p.n_free = static_cast<std::uint16_t>(n - n / 2);
    p.ell_m = ell_m;
    return p;
}

/// A map of 1,400 beams of the yard, built but for the last scans.
void fill(gpom_map_t *map)
{
    Random random(180);
    for (int i = 0; i < 24; ++i) {
        REQUIRE(yard_scan(random, i, {-36.0, 0.0}).insert_into(map) == GPOM_OK);
        if (i == 20) {
            REQUIRE(gpom_map_build(map) == GPOM_OK);
        }
    }
}

std::vector<gpom_point_t> places(std::size_t n) { return random_points(181, n, 30.0, {0.0, 0.0}); }

double worst_difference(const std::vector<gpom_answer_t> &a, const std::vector<gpom_answer_t> &b)
{
    double worst = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        worst = std::max({worst, std::abs(static_cast<double>(a[i].mean - b[i].mean)),
                          std::abs(static_cast<double>(a[i].variance - b[i].variance))});
    }
    return worst;
}

/// Solve in exactly the memory that is asked for.
gpom_sparse_moments solve(const gpom_params_t &p, std::vector<gpom_sparse_point> points)
{
    GuardedMemory memory(gpom_sparse_bytes(points.size()));
    const gpom_sparse_moments moments =
        gpom_sparse_predict({p.sf2, p.ell_m}, {points.data(), points.size(), memory.mem()});
    CHECK(memory.is_intact());
    return moments;
}

} // namespace

// Neighbourhoods of any size and fill, down to no point and to points that touch no other, give
// mean and variance of a dense solve in double, in memory of the exact size.
TEST_CASE("the sparse solve equals a dense one in double")
{
    GPOM_TELL_SEED();
    Random random(182);
    for (const std::size_t n : {0u, 1u, 2u, 3u, 5u, 17u, 64u, 128u, 256u, 512u}) {
        for (const float ell_m : {0.05f, 1.0f, 4.0f, 300.0f}) {
            const gpom_params_t p = askey(2, ell_m);
            std::vector<gpom_sparse_point> points;
            std::vector<LabelledPoint> labelled;
            for (std::size_t i = 0; i < n; ++i) {
                const float side = std::sqrt(static_cast<float>(n));
                points.push_back({random.uniform_f(-side, side), random.uniform_f(-side, side),
                                  i % 3 == 0 ? 1.0f : -1.0f, random.uniform_f(0.05, 0.5)});
                const gpom_sparse_point &made = points.back();
                labelled.push_back({{made.x_m, made.y_m}, made.label, made.noise});
            }
            const gpom_sparse_moments got = solve(p, points);
            const Moments truth = predict(p, labelled, {0.0, 0.0});
            CAPTURE(n);
            CAPTURE(ell_m);
            CHECK(got.is_good);
            CHECK(std::abs(static_cast<double>(got.mean) - truth.mean) <= 1e-6);
            CHECK(std::abs(static_cast<double>(got.variance) - truth.variance) <= 1e-6);
        }
    }
}

// Neighbourhoods that either can solve: within float32 the same answers, with all additions too.
TEST_CASE("sparse and dense answers agree up to 64 points")
{
    GPOM_TELL_SEED();
    for (const unsigned n : {2u, 7u, 16u, 33u, 64u}) {
        for (const float ell_m : {2.0f, 9.0f, 40.0f}) {
            for (const bool has_additions : {false, true}) {
                gpom_params_t p = askey(n, ell_m);
                p.scan_points_max = has_additions ? 3 : 0;
                p.anisotropy = has_additions ? 0.5f : 0.0f;
                p.depth_m = has_additions ? 0.3f : 0.0f;
                TestMap map(config_of(p, 2000));
                fill(map.get());
                const std::vector<gpom_point_t> points = places(300);
                const Answers dense = query_points(map.get(), points);
                map.get()->dense_max = 0;
                const Answers sparse = query_points(map.get(), points);
                CHECK(sparse.status == GPOM_OK);
                CHECK(worst_difference(dense.all, sparse.all) <= 2e-5);
            }
        }
    }
}

// The other way round: larger neighbourhoods forced through the dense solve.
TEST_CASE("sparse and dense answers agree beyond 64 points")
{
    GPOM_TELL_SEED();
    for (const unsigned n : {65u, 256u}) {
        TestMap map(config_of(askey(n, 6.0f), 2000));
        fill(map.get());
        const std::vector<gpom_point_t> points = places(100);
        const Answers sparse = query_points(map.get(), points);
        map.get()->dense_max = n;
        const Answers dense = query_points(map.get(), points);
        CHECK(worst_difference(dense.all, sparse.all) <= 5e-5);
    }
}

// From scan to moments: neighbourhoods of 128, 256 and 512 points equal brute force in double.
TEST_CASE("large neighbourhoods equal brute force in double" *
          doctest::test_suite("sanitized campaign"))
{
    GPOM_TELL_SEED();
    for (const unsigned n : {128u, 256u, 512u}) {
        const gpom_params_t p = askey(n, 5.0f);
        TestMap map(config_of(p, 2000));
        fill(map.get());
        const std::vector<Beam> beams = map.reference_beams();
        const std::vector<gpom_point_t> points = places(40);
        const Answers answers = query_points(map.get(), points);
        CHECK(answers.status == GPOM_OK);
        std::size_t n_clear = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Xy q = {static_cast<double>(static_cast<float>(points[i].x_m)),
                          static_cast<double>(static_cast<float>(points[i].y_m))};
            const Neighbourhood near = neighbourhood_of(p, beams, q);
            const gpom_answer_t &a = answers.all[i];
            CHECK(a.n_hits == std::min(n / 2, 255u)); // the most that a byte tells
            CHECK(a.n_free == std::min(n / 2, 255u));
            if (near.is_clear) {
                ++n_clear;
                const Moments truth = predict(p, near.points, q);
                CHECK(std::abs(static_cast<double>(a.mean) - truth.mean) <= 1e-4);
                CHECK(std::abs(static_cast<double>(a.variance) - truth.variance) <= 1e-4);
                CHECK(std::abs(static_cast<double>(a.probability) - squash(p, truth)) <= 1e-3);
            }
        }
        CHECK(n_clear * 2 >= points.size());
    }
}

// A point's answer is the same to the last bit alone and in any list.
TEST_CASE("large neighbourhoods answer alike in any packet")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(askey(96, 5.0f), 2000));
    fill(map.get());
    const std::vector<gpom_point_t> points = places(70);
    const Answers together = query_points(map.get(), points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        CHECK(same_bits(query_points(map.get(), {points[i]}).all[0], together.all[i]));
    }
}

// The public size covers the exact one, from the smallest sparse neighbourhood to the largest.
TEST_CASE("scratch of large neighbourhoods")
{
    for (const unsigned n : {GPOM_POINTS_MAX + 1, 100u, 255u, GPOM_SPARSE_POINTS_MAX}) {
        for (const std::uint16_t cap : {std::uint16_t{0}, std::uint16_t{4}}) {
            gpom_params_t p = askey(n, 5.0f);
            p.scan_points_max = cap; // needs room for more neighbours
            TestMap map(config_of(p, 2000));
            fill(map.get());
            const std::size_t need = gpom_scratch_bytes(map.get());
            CHECK(need <= GPOM_SCRATCH_BYTES(n, gpom_lanes()));
            CHECK(need * 10 >= GPOM_SCRATCH_BYTES(n, gpom_lanes()) * 7);
            CHECK(query_points(map.get(), places(20)).status == GPOM_OK); // canaries around it
        }
    }
}

// A matrix that is not positive definite gives the prior, flagged; an empty map the prior alone.
TEST_CASE("a sparse matrix that cannot be factored gives the prior and GPOM_ERR_PIVOT")
{
    GPOM_TELL_SEED();
    const gpom_params_t p = askey(100, 5.0f);
    TestMap map(config_of(p, 2000));
    const Answers empty = query_points(map.get(), {{1.0, 2.0}});
    CHECK(empty.status == GPOM_OK);
    CHECK(empty.all[0].mean == 0.0f);
    CHECK(empty.all[0].variance == p.sf2);
    fill(map.get());
    map.get()->noise.once = -2.0f * p.sf2; // legal noise prevents it
    const Answers bad = query_points(map.get(), places(30));
    CHECK(bad.status == GPOM_ERR_PIVOT);
    for (const gpom_answer_t &a : bad.all) {
        CHECK(a.flags == GPOM_ANSWER_PIVOT);
        CHECK(a.mean == 0.0f);
        CHECK(a.variance == p.sf2);
        CHECK(a.probability == gpom_params_prior_probability(&p));
    }
}

// Beyond 64 points only a covariance of compact support, and never beyond 512.
TEST_CASE("large neighbourhoods are for compact support")
{
    for (const gpom_kernel_t which : kKernels) {
        gpom_params_t p = params_of(which);
        for (const unsigned n : {64u, 65u, 512u, 513u}) {
            p.n_hits = static_cast<std::uint16_t>(n - 1);
            p.n_free = 1;
            const char *problem = nullptr;
            const bool is_legal = n <= (which == GPOM_KERNEL_ASKEY ? 512u : 64u);
            CHECK(gpom_params_check(&p, &problem) == (is_legal ? GPOM_OK : GPOM_ERR_PARAMS));
            CHECK((problem == nullptr) == is_legal);
        }
    }
}
