// Learning beta_far, the offset of places far from all beams.
#include "tests/common/reference.hpp"
#include "tools/learn/fit.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace gpom_tools;
using reference::kKernels;
using reference::Random;

namespace
{

LearntParams fading_params(gpom_kernel_t kernel)
{
    LearntParams params;
    params.kernel = kernel;
    params.beta = 0.4;
    params.vote = 0.7;
    params.log_weights = {0.3, -0.2, 0.15, -0.4};
    params.fade_m = 7.0;
    params.beta_far = 0.3;
    return params;
}

/// Places that no beam came near, of every hundred as many occupied as asked for.
LearnData far_places(int percent_occupied)
{
    Random random(6);
    LearnWorld world;
    for (std::size_t i = 0; i < 40; ++i) {
        const double bearing_rad = random.uniform(-reference::kPi, reference::kPi);
        world.push_back({0.0, 0.0, std::cos(bearing_rad), std::sin(bearing_rad),
                         random.uniform(0.5, 9.0), i, true});
    }
    LearnData data{{world}, {}, {}, {}, ""};
    for (int i = 0; i < 1000; ++i) {
        data.anywhere.push_back({random.uniform(100.0, 200.0), random.uniform(100.0, 200.0),
                                 i % 100 < percent_occupied, 0, kNoBeam});
    }
    return data;
}

TEST_CASE("beta_far gives places far from all beams their share of occupied ones")
{
    for (const gpom_kernel_t kernel : kKernels) {
        const LearntParams params = fading_params(kernel);
        for (const int percent : {40, 50, 60}) {
            const LearntParams far = fit_far(params, far_places(percent), FitOptions{});
            CHECK(std::fabs(prior_probability(far) - percent / 100.0) < 1e-3);
            CHECK(far.beta == params.beta);
        }
    }
}

TEST_CASE("beta_far never makes an unseen place free or occupied, however few or many are occupied")
{
    const LearntParams params = fading_params(GPOM_KERNEL_MATERN12);
    CHECK(prior_probability(fit_far(params, far_places(97), FitOptions{})) ==
          doctest::Approx(0.69));
    CHECK(prior_probability(fit_far(params, far_places(3), FitOptions{})) == doctest::Approx(0.31));
}

TEST_CASE("beta_far stays as it is without places, and where the map never fades to its prior")
{
    LearntParams params = fading_params(GPOM_KERNEL_MATERN12);
    CHECK(fit_far(params, far_places(0), FitOptions{}).beta_far != params.beta_far);
    LearnData none = far_places(60);
    none.anywhere.clear();
    CHECK(fit_far(params, none, FitOptions{}).beta_far == params.beta_far);
    params.fade_m = 0.0;
    CHECK(fit_far(params, far_places(60), FitOptions{}).beta_far == params.beta_far);
}

} // namespace
