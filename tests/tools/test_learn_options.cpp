// What gpom-learn is asked for: names, stretches of the way.
#include "tests/common/reference.hpp"
#include "tools/eval/stretch.hpp"
#include "tools/learn/data.hpp"
#include "tools/learn/fit.hpp"
#include "tools/learn/params.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace gpom_tools;

TEST_CASE("the first stretch of the way is as long as asked")
{
    std::vector<Scan> scans;
    for (int i = 0; i < 10; ++i) {
        scans.push_back({0.0, 3.0 * i, 4.0 * i, 0.0, 0.0, 0.0, 30.0, {}}); // 5 m a step
    }
    CHECK(first_metres(scans, 0.0).size() == 10);
    CHECK(first_metres(scans, 20.0).size() == 5);
    CHECK(first_metres(scans, 1.0).size() == 1);
}

// Whatever the optimiser proposes, and whichever gap is tried, the library takes what is learnt.
TEST_CASE("any point of the fit's box becomes legal parameters")
{
    GPOM_TELL_SEED();
    reference::Random random(6);
    for (const gpom_kernel_t kernel : reference::kKernels) {
        for (const char *const model : {"paper", "full"}) {
            FitOptions options;
            options.ingredients = parse_ingredients(model);
            options.has_once = options.ingredients.noise;
            options.ell_max_m = 1000.0;
            const FitSpace space(kernel, options);
            const Box box = space.box();
            for (int round = 0; round < 100; ++round) {
                Eigen::VectorXd x = box.low;
                for (Eigen::Index i = 0; i < x.size(); ++i) {
                    const std::uint32_t end = random.below(4); // ends, too
                    x(i) = end == 0   ? box.low(i)
                           : end == 1 ? box.high(i)
                                      : random.uniform(box.low(i), box.high(i));
                }
                LearntParams base;
                base.kernel = kernel;
                base.gap_m = random.below(2) == 0 ? 0.0 : 0.1;
                const gpom_params_t p = to_library(with_legal_noise(space.params(base, x)));
                const char *problem = nullptr;
                CHECK(gpom_params_check(&p, &problem) == GPOM_OK);
                CHECK(std::string(problem == nullptr ? "" : problem) == "");
            }
        }
    }
}

TEST_CASE("unknown ingredients are refused, known ones leave the others neutral")
{
    CHECK_THROWS(parse_ingredients("noise,speed"));
    CHECK_THROWS(parse_ingredients("noise,,vote"));
    const Ingredients some = parse_ingredients("vote,cap");
    CHECK(some.vote);
    CHECK(some.cap);
    CHECK(!some.noise);
    CHECK(!some.depth);
    CHECK(!parse_ingredients("paper").noise);
    CHECK(parse_ingredients("full").logs);
}
