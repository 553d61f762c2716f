// What float32 does to answers, against a solve in double: parameters that it cannot serve are
// refused.
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

/// A room of 10 m by 8 m: the range from inside along a bearing.
double range_in_room(Xy from, double bearing_rad)
{
    const double dx = std::cos(bearing_rad), dy = std::sin(bearing_rad);
    const double to_x = ((dx > 0.0 ? 5.0 : -5.0) - from.x) / dx;
    const double to_y = ((dy > 0.0 ? 4.0 : -4.0) - from.y) / dy;
    return std::min(to_x, to_y);
}

/// Eight scans on a way through the room, with errors of up to a centimetre.
void see_room(gpom_map_t *map)
{
    Random random(171);
    for (int i = 0; i < 8; ++i) {
        TestScan s;
        s.pose = {-3.0 + 0.7 * i, -1.0 + 0.2 * i, 0.3 * i, nullptr};
        s.stamp_us = 100000 * i;
        s.angle_step_rad = 0.0628;
        for (int j = 0; j < 100; ++j) {
            const double range_m =
                range_in_room({s.pose.x_m, s.pose.y_m}, s.pose.yaw_rad + j * s.angle_step_rad);
            s.ranges_m.push_back(static_cast<float>(range_m + random.uniform(-0.01, 0.01)));
        }
        REQUIRE(s.insert_into(map) == GPOM_OK);
    }
    REQUIRE(gpom_map_build(map) == GPOM_OK);
}

/// Eight beams that end beside each other.
void see_fan(gpom_map_t *map)
{
    TestScan s;
    s.angle_min_rad = -0.2;
    s.angle_step_rad = 0.05;
    for (int i = 0; i < 8; ++i) {
        s.ranges_m.push_back(5.0f + 0.11f * static_cast<float>(i % 3));
    }
    REQUIRE(s.insert_into(map) == GPOM_OK);
}

/// The greatest error of a probability at random places, at hits and right before them.
double worst_error(TestMap &map, const gpom_params_t &p)
{
    std::vector<gpom_point_t> points = random_points(172, 60, 4.0);
    const std::vector<gpom_beam_t> kept = map.beams();
    for (std::size_t i = 0; i < kept.size(); i += 1 + kept.size() / 60) {
        const double range_m = static_cast<double>(kept[i].range_m) * (i % 2 == 0 ? 1.0 : 0.99);
        points.push_back({kept[i].x_m + range_m * static_cast<double>(kept[i].dir_x),
                          kept[i].y_m + range_m * static_cast<double>(kept[i].dir_y)});
    }
    const std::vector<Beam> beams = map.reference_beams();
    const Answers answers = query_points(map.get(), points);
    const float prior = gpom_params_prior_variance(&p);
    double worst = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const gpom_answer_t &a = answers.all[i];
        CHECK(a.flags == 0);
        CHECK(a.variance <= 1.001f * prior);
        const Xy q = {static_cast<double>(static_cast<float>(points[i].x_m)),
                      static_cast<double>(static_cast<float>(points[i].y_m))};
        Neighbourhood near = neighbourhood_of(p, beams, q);
        for (LabelledPoint &point : near.points) {
            point.at = {point.at.x - q.x, point.at.y - q.y};
        }
        if (near.is_clear) {
            const double truth = squash(p, predict(p, near.points, {0.0, 0.0}));
            worst = std::max(worst, std::abs(static_cast<double>(a.probability) - truth));
        }
    }
    return worst;
}

void check_within(const gpom_params_t &p)
{
    if (gpom_params_check(&p, nullptr) != GPOM_OK) {
        return;
    }
    for (const auto see : {see_room, see_fan}) {
        TestMap map(config_of(p));
        see(map.get());
        CAPTURE(p.ell_m);
        CAPTURE(p.s0);
        CAPTURE(p.s1);
        CAPTURE(p.sn2);
        CAPTURE(p.gap_m);
        CAPTURE(p.n_hits);
        CHECK(worst_error(map, p) < 0.01);
    }
}

/// The kernel's lengths, short to long, and past what is legal.
std::vector<gpom_params_t> with_lengths(gpom_params_t p)
{
    std::vector<gpom_params_t> all;
    if (p.kernel == GPOM_KERNEL_NN) {
        for (const float s0 : {1e-6f, 1e-3f, 1.0f, 1e6f}) {
            for (const float s1 : {1e-6f, 1.0f, 1e4f}) {
                p.s0 = s0;
                p.s1 = s1;
                all.push_back(p);
            }
        }
    } else {
        for (const float ell_m : {1e-3f, 0.2f, 0.6f, 12.0f, 100.0f, 1e3f, 1e4f, 1e6f}) {
            p.ell_m = ell_m;
            all.push_back(p);
        }
    }
    return all;
}

} // namespace

// At every end of what gpom_params_check() allows, with the slope of the general setting, a
// probability is within 0.01 of a solve in double, no pivot fails, and no variance is above the
// prior's.
TEST_CASE("parameters that are accepted answer within 0.01 of double" *
          doctest::test_suite("sanitized campaign"))
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        gpom_params_t p = params_of(which);
        p.sf2 = 1.0f;
        p.alpha = 3.2f;
        p.beta = 0.0f;
        for (gpom_params_t &made : with_lengths(p)) {
            for (const float sn2 : {1e-6f, 1e-5f, 1e-4f, 1e-3f, 0.1f}) {
                for (const float gap_m : {0.0f, 0.05f, 0.2f}) {
                    made.sn2 = made.sn2_free = sn2;
                    made.gap_m = gap_m;
                    made.n_hits = made.n_free = 8;
                    check_within(made);
                }
            }
            made.n_hits = made.n_free = 32;
            made.sn2 = made.sn2_free = 1e-3f;
            check_within(made);
        }
    }
}
