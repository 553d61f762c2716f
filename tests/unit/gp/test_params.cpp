// Hyperparameters: what is refused, by which name, and what is not.
#include "tests/common/reference.hpp"

#include <cfloat>
#include <functional>

using namespace reference;

namespace
{

using Change = std::function<void(gpom_params_t &)>;

struct Refusal {
    const char *field;
    gpom_kernel_t which;
    Change change;
};

void check_refused(const Refusal &r)
{
    CAPTURE(r.field);
    gpom_params_t p = params_of(r.which);
    const char *problem = "untouched";
    REQUIRE(gpom_params_check(&p, &problem) == GPOM_OK);
    REQUIRE(problem == nullptr);
    r.change(p);
    CHECK(gpom_params_check(&p, &problem) == GPOM_ERR_PARAMS);
    REQUIRE(problem != nullptr);
    INFO("said: ", problem);
    const std::string text = problem;
    const std::string named = text.substr(0, text.find(':'));
    CHECK(text.find(": ") != std::string::npos);
    CHECK(named.find(r.field) != std::string::npos);
    CHECK(gpom_params_check(&p, nullptr) == GPOM_ERR_PARAMS);
}

struct Ends {
    const char *field;
    float gpom_params_t::*at;
    float least, most;
};

/// A float field that must be positive and finite.
void check_positive(const char *field, gpom_kernel_t which, float gpom_params_t::*at)
{
    for (const float bad : {0.0f, -0.0f, -1.0f, kNan, kInf, -kInf}) {
        CAPTURE(bad);
        check_refused({field, which, [at, bad](gpom_params_t &p) { p.*at = bad; }});
    }
}

bool is_sound(const gpom_answer_t &a)
{
    return std::isfinite(a.mean) && std::isfinite(a.variance) && a.variance >= 0.0f &&
           a.probability >= 0.0f && a.probability <= 1.0f;
}

} // namespace

// The documented defaults are legal and say what the header says.
TEST_CASE("default parameters are accepted")
{
    gpom_params_t p;
    gpom_params_init(&p);
    const char *problem = "untouched";
    CHECK(gpom_params_check(&p, &problem) == GPOM_OK);
    CHECK(problem == nullptr);
    CHECK(p.kernel == GPOM_KERNEL_MATERN12);
    CHECK(p.frame == GPOM_FRAME_QUERY);
    CHECK(p.sf2 == 13.0f);
    CHECK(p.n_hits == 8);
    CHECK(p.n_free == 8);
    for (const gpom_kernel_t which : kKernels) {
        p.kernel = which;
        CHECK(gpom_params_check(&p, nullptr) == GPOM_OK);
    }
}

// Every number that must be positive is refused by name when it is not, NaN and infinity included.
TEST_CASE("each refused number names its field")
{
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        check_positive("sf2", which, &gpom_params_t::sf2);
        check_positive("sn2", which, &gpom_params_t::sn2);
        check_positive("sn2_free", which, &gpom_params_t::sn2_free);
        check_positive("alpha", which, &gpom_params_t::alpha);
        if (which == GPOM_KERNEL_NN) {
            check_positive("s0", which, &gpom_params_t::s0);
            check_positive("s1", which, &gpom_params_t::s1);
        } else {
            check_positive("ell_m", which, &gpom_params_t::ell_m);
        }
    }
}

// The other fields likewise.
TEST_CASE("each refused setting names its field")
{
    const gpom_kernel_t any = GPOM_KERNEL_MATERN12;
    for (const int value : {5, 7}) { // values the enumeration's type can hold
        check_refused({"kernel", any, [value](gpom_params_t &p) {
                           std::memcpy(&p.kernel, &value, sizeof value);
                       }});
    }
    for (const int value : {2, 3}) {
        check_refused({"frame", any,
                       [value](gpom_params_t &p) { std::memcpy(&p.frame, &value, sizeof value); }});
    }
    for (const float bad : {kNan, kInf, -kInf}) {
        check_refused({"beta", any, [bad](gpom_params_t &p) { p.beta = bad; }});
    }
    for (const float bad : {-0.001f, kNan, kInf}) {
        check_refused({"gap_m", any, [bad](gpom_params_t &p) { p.gap_m = bad; }});
    }
    for (const float bad : {0.0f, -0.1f, kNan, 0.8f, 0.9f, kInf}) {
        check_refused({"p_free", any, [bad](gpom_params_t &p) { p.p_free = bad; }});
    }
    for (const float bad : {1.0f, 1.5f, kNan, 0.2f, 0.1f, -kInf}) {
        check_refused({"p_occupied", any, [bad](gpom_params_t &p) { p.p_occupied = bad; }});
    }
    for (const float bad : {-0.001f, 5.1f, kNan}) {
        check_refused({"depth_m", any, [bad](gpom_params_t &p) { p.depth_m = bad; }});
    }
    for (const float bad : {-0.001f, 1.001f, kNan}) {
        check_refused({"anisotropy", any, [bad](gpom_params_t &p) { p.anisotropy = bad; }});
    }
    check_refused({"anisotropy", any, [](gpom_params_t &p) {
                       p.frame = GPOM_FRAME_MAP;
                       p.anisotropy = 0.5f;
                   }});
    for (const float bad : {-1.0f, 0.01f, 2e6f, kInf, kNan}) {
        check_refused({"fade_m", any, [bad](gpom_params_t &p) { p.fade_m = bad; }});
    }
    check_refused({"fade_m", any, [](gpom_params_t &p) {
                       p.frame = GPOM_FRAME_MAP;
                       p.fade_m = 20.0f;
                   }});
    for (const float bad : {-2e6f, kInf, kNan, 1.0f}) { // the last only for want of fade_m
        check_refused({"beta_far", any, [bad](gpom_params_t &p) { p.beta_far = bad; }});
    }
    for (const float bad : {-30.0f, 30.0f}) {
        check_refused({"beta", any, [bad](gpom_params_t &p) {
                           p.fade_m = 20.0f;
                           p.beta_far = bad; // unseen places would be free or occupied
                       }});
    }
    check_refused({"fading", any, [](gpom_params_t &p) { p.n_fading = p.n_hits; }});
    check_refused({"fading", any, [](gpom_params_t &p) {
                       p.n_free = 3;
                       p.n_fading = 3;
                   }});
    for (const float bad : {-1.0f, 2e6f, kInf, kNan}) {
        check_refused({"sn2_once", any, [bad](gpom_params_t &p) { p.sn2_once = bad; }});
    }
    for (const float bad : {-2e6f, kInf, kNan}) {
        check_refused({"vote", any, [bad](gpom_params_t &p) { p.vote = bad; }});
        check_refused({"log_hit_first", any, [bad](gpom_params_t &p) { p.log_hit_first = bad; }});
        check_refused({"log_hit_last", any, [bad](gpom_params_t &p) { p.log_hit_last = bad; }});
        check_refused({"log_free_first", any, [bad](gpom_params_t &p) { p.log_free_first = bad; }});
        check_refused({"log_free_last", any, [bad](gpom_params_t &p) { p.log_free_last = bad; }});
    }
    check_refused({"scan_points_max", any, [](gpom_params_t &p) { p.scan_points_max = 65; }});
    check_refused({"hits", any, [](gpom_params_t &p) { p.n_hits = 0; }});
    check_refused({"free", any, [](gpom_params_t &p) { p.n_free = 0; }});
    check_refused({"hits", any, [](gpom_params_t &p) { p.n_hits = 57; }});
    check_refused({"free", any, [](gpom_params_t &p) { p.n_free = 65535; }});
}

// Noise below what float32 keeps apart is refused, per kernel; the floor itself is accepted. Points
// of other labels that may stand in one place need more: no gap, or all of it shrunk away.
TEST_CASE("noise has a floor that depends on kernel, gap and sf2")
{
    for (const gpom_kernel_t which : kKernels) {
        const bool is_rough = which == GPOM_KERNEL_MATERN12 || which == GPOM_KERNEL_ASKEY;
        for (const auto &[gap_m, anisotropy] :
             {std::pair(0.05f, 0.0f), {0.1f, 0.5f}, {0.04f, 0.0f}, {0.1f, 0.6f}, {1.0f, 1.0f}}) {
            const bool is_apart = is_rough && gap_m * (1.0f - anisotropy) >= 0.0499f;
            const float floor = (is_apart ? 1e-5f : 1e-3f) * 2.0f;
            const Change set = [=, gap = gap_m, shrinks = anisotropy](gpom_params_t &p) {
                p.sf2 = 2.0f;
                p.gap_m = gap;
                p.anisotropy = shrinks;
                p.sn2 = p.sn2_free = floor;
            };
            gpom_params_t p = params_of(which);
            set(p);
            CHECK(gpom_params_check(&p, nullptr) == GPOM_OK);
            for (const auto at : {&gpom_params_t::sn2, &gpom_params_t::sn2_free}) {
                check_refused({"sn2", which, [&](gpom_params_t &q) {
                                   set(q);
                                   q.*at = 0.99f * floor;
                               }});
            }
        }
    }
}

// Where float32 would lose the covariance: lengths that rounding of places reaches, or beside which
// nothing is far, and a bias too small for the arcsine.
TEST_CASE("length scales and weights out of range are refused")
{
    for (const gpom_kernel_t which : kKernels) {
        gpom_params_t p = params_of(which);
        const bool is_nn = which == GPOM_KERNEL_NN;
        const Ends ell_m = {"ell_m", &gpom_params_t::ell_m,
                            which == GPOM_KERNEL_ASKEY ? 0.6f : 0.2f, 1e3f};
        const Ends s0 = {"s0", &gpom_params_t::s0, 1e-3f, 1e6f};
        const Ends s1 = {"s1", &gpom_params_t::s1, 1e-6f, 1e4f};
        for (const Ends &legal : is_nn ? std::vector<Ends>{s0, s1} : std::vector<Ends>{ell_m}) {
            for (const float end : {legal.least, legal.most}) {
                p.*legal.at = end;
                CHECK(gpom_params_check(&p, nullptr) == GPOM_OK);
                const float beyond = end * (end == legal.least ? 0.99f : 1.01f);
                check_refused(
                    {legal.field, which, [&](gpom_params_t &q) { q.*legal.at = beyond; }});
            }
        }
    }
}

// A hit seen once cannot be surer than one seen more often; 0 says that it is as sure.
TEST_CASE("the noise of hits seen once is 0 or at least that of hits")
{
    for (const gpom_kernel_t which : kKernels) {
        gpom_params_t p = params_of(which);
        CHECK(p.sn2_once == 0.0f);
        for (const float good : {p.sn2, 2.0f * p.sn2, 1e6f}) {
            p.sn2_once = good;
            CHECK(gpom_params_check(&p, nullptr) == GPOM_OK);
        }
        check_refused({"sn2_once", which, [](gpom_params_t &q) { q.sn2_once = 0.99f * q.sn2; }});
    }
}

// The most points are accepted, one more is not.
TEST_CASE("hits and free points are at most 64 together")
{
    gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
    p.n_hits = 1;
    p.n_free = 63;
    CHECK(gpom_params_check(&p, nullptr) == GPOM_OK);
    p.n_hits = 2;
    CHECK(gpom_params_check(&p, nullptr) == GPOM_ERR_PARAMS);
}

// A place that nobody has seen may not be called free or occupied.
TEST_CASE("a prior probability outside the unsure band is refused")
{
    for (const gpom_kernel_t which : kKernels) {
        check_refused({"beta", which, [](gpom_params_t &p) { p.beta = 50.0f; }});
        check_refused({"beta", which, [](gpom_params_t &p) { p.beta = -50.0f; }});
        check_refused({"beta", which,
                       [](gpom_params_t &p) { p.p_occupied = gpom_params_prior_probability(&p); }});
        check_refused({"beta", which,
                       [](gpom_params_t &p) { p.p_free = gpom_params_prior_probability(&p); }});
    }
}

// A struct that gpom_params_init() has not filled, or that is of another version, is an argument
// error.
TEST_CASE("parameters not from gpom_params_init are refused")
{
    gpom_params_t p = params_of(GPOM_KERNEL_SE);
    const char *problem = "untouched";
    CHECK(gpom_params_check(nullptr, &problem) == GPOM_ERR_ARG);
    CHECK(problem == nullptr);
    for (const std::uint32_t bytes : std::initializer_list<std::uint32_t>{
             0, p.struct_bytes - 1, p.struct_bytes + 4, UINT32_MAX}) {
        p.struct_bytes = bytes;
        CHECK(gpom_params_check(&p, nullptr) == GPOM_ERR_ARG);
    }
    gpom_params_init(nullptr);
    CHECK(gpom_params_prior_variance(nullptr) == 0.0f);
    CHECK(gpom_params_prior_probability(nullptr) == 0.0f);
}

// Whatever was accepted, however absurd, answers with numbers: alpha^2, 1 / ell and sf2 overflow
// float32 long before they are infinite themselves.
TEST_CASE("parameters that are accepted never make a NaN")
{
    const std::vector<Change> extremes = {[](gpom_params_t &p) { p.alpha = 1e20f; },
                                          [](gpom_params_t &p) { p.alpha = FLT_MAX; },
                                          [](gpom_params_t &p) {
                                              p.sf2 = 1e25f;
                                              p.sn2 = p.sn2_free = 1e23f;
                                          },
                                          [](gpom_params_t &p) {
                                              p.sf2 = FLT_MAX;
                                              p.sn2 = p.sn2_free = FLT_MAX;
                                          },
                                          [](gpom_params_t &p) {
                                              p.sf2 = 1e-30f;
                                              p.sn2 = p.sn2_free = 1e-32f;
                                          },
                                          [](gpom_params_t &p) {
                                              p.sf2 = FLT_MIN;
                                              p.sn2 = p.sn2_free = FLT_MIN;
                                          },
                                          [](gpom_params_t &p) { p.sn2 = FLT_MAX; },
                                          [](gpom_params_t &p) { p.sn2_free = 1e30f; },
                                          [](gpom_params_t &p) { p.ell_m = 1e-37f; },
                                          [](gpom_params_t &p) { p.ell_m = 1e-20f; },
                                          [](gpom_params_t &p) { p.ell_m = FLT_MAX; },
                                          [](gpom_params_t &p) { p.s0 = 1e37f; },
                                          [](gpom_params_t &p) { p.s1 = 1e37f; },
                                          [](gpom_params_t &p) {
                                              p.s0 = FLT_MIN;
                                              p.s1 = FLT_MIN;
                                          },
                                          [](gpom_params_t &p) { p.gap_m = FLT_MAX; }};
    const std::vector<gpom_point_t> points = {{0, 0},   {1, 1},        {5, -3},
                                              {60, 60}, {3000, -3000}, {-700, 2}};
    for (std::size_t i = 0; i < extremes.size(); ++i) {
        for (const gpom_kernel_t which : kKernels) {
            for (const gpom_frame_t frame : kFrames) {
                CAPTURE(i);
                INFO("kernel ", std::string(kKernelNames[which]));
                CAPTURE(frame);
                gpom_params_t p = params_of(which, frame);
                extremes[i](p);
                if (gpom_params_check(&p, nullptr) != GPOM_OK) {
                    continue; // refusing is just as good
                }
                TestMap map(config_of(p));
                drive(map.get(), 70, 3);
                const std::vector<gpom_answer_t> answers = query_points(map.get(), points).all;
                CHECK(std::all_of(answers.begin(), answers.end(), is_sound));
            }
        }
    }
}
