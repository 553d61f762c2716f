// Where neighbours fade, no answer jumps, whichever neighbours come and go.
#include "tests/common/reference.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace reference;

namespace
{

constexpr int kLines = 60;
constexpr int kSteps = 600;
constexpr double kStep_m = 0.005;
constexpr double kDifference = 0.005; ///< Steps with less are not looked into.
constexpr int kHalvings = 9;          ///< To a hundredth of a millimetre.

gpom_params_t model(gpom_kernel_t kernel, std::uint16_t n_fading)
{
    gpom_params_t p;
    gpom_params_init(&p);
    p.kernel = kernel;
    p.s0 = 10.0f;
    p.ell_m = kernel == GPOM_KERNEL_ASKEY ? 12.0f : 4.0f;
    p.sn2 = 0.02f;
    p.alpha = 4.0f;
    p.beta = 0.0f;
    p.anisotropy = 0.6f;
    p.vote = 0.6f;
    p.line = 0.4f;
    p.log_hit_last = 0.1f;
    p.log_free_last = -0.1f;
    p.fade_m = 15.0f;
    p.beta_far = 0.2f;
    p.n_fading = n_fading;
    return p;
}

/// Single beams in a yard. Beams of one place would be equally far from all that is behind it, and
/// such neighbours still come and go together (params.h, n_fading).
void fill(gpom_map_t *map)
{
    Random random(31);
    for (int i = 0; i < 200; ++i) {
        const auto range_m = static_cast<float>(random.uniform(2.0, 9.0));
        const gpom_scan_t scan = {1000000 * i, 0.0f, 0.0f, &range_m, 1};
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        sensor.range_max_m = 8.0f; // a seventh of them have no return
        const gpom_pose_t pose = {random.uniform(-6.0, 6.0), random.uniform(-6.0, 6.0),
                                  random.uniform(-kPi, kPi), nullptr};
        REQUIRE(gpom_scan_insert(map, &scan, &sensor, &pose) == GPOM_OK);
    }
    REQUIRE(gpom_map_build(map) == GPOM_OK);
}

double probability_at(const gpom_map_t *map, gpom_point_t at)
{
    return double{query_points(map, {at}).all[0].probability};
}

/// What is left of the difference between two places when its greater half is taken again and
/// again: of a slope next to nothing, of a jump the jump.
double jump_between(const gpom_map_t *map, gpom_point_t a, gpom_point_t b)
{
    double p_a = probability_at(map, a);
    double p_b = probability_at(map, b);
    for (int i = 0; i < kHalvings; ++i) {
        const gpom_point_t middle = {0.5 * (a.x_m + b.x_m), 0.5 * (a.y_m + b.y_m)};
        const double p = probability_at(map, middle);
        const bool is_first_half = std::fabs(p - p_a) > std::fabs(p_b - p);
        (is_first_half ? b : a) = middle;
        (is_first_half ? p_b : p_a) = p;
    }
    return std::fabs(p_b - p_a);
}

/// The greatest jump on random lines through the yard.
double greatest_jump(const gpom_params_t &p)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = p;
    config.beam_max = 300;
    TestMap map(config);
    fill(map.get());
    Random random(32);
    double jump = 0.0;
    for (int i_line = 0; i_line < kLines; ++i_line) {
        const double heading_rad = random.uniform(-kPi, kPi);
        const gpom_point_t start = {random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0)};
        std::vector<gpom_point_t> places;
        for (int i = 0; i < kSteps; ++i) {
            places.push_back({start.x_m + kStep_m * i * std::cos(heading_rad),
                              start.y_m + kStep_m * i * std::sin(heading_rad)});
        }
        const std::vector<gpom_answer_t> all = query_points(map.get(), places).all;
        for (std::size_t i = 1; i < places.size(); ++i) {
            if (std::fabs(all[i].probability - all[i - 1].probability) > kDifference) {
                jump = std::max(jump, jump_between(map.get(), places[i - 1], places[i]));
            }
        }
    }
    return jump;
}

} // namespace

// The neighbour that may be exchanged has no say, in the process and in everything inside eq. 7;
// that without fading there are jumps shows that the lines find them.
TEST_CASE("no answer jumps where neighbours fade" * doctest::test_suite("sanitized campaign"))
{
    for (const gpom_kernel_t kernel : {GPOM_KERNEL_NN, GPOM_KERNEL_MATERN12, GPOM_KERNEL_ASKEY}) {
        CAPTURE(kernel);
        CHECK(greatest_jump(model(kernel, 0)) > 0.03);
        CHECK(greatest_jump(model(kernel, 4)) < 0.003);
    }
}
