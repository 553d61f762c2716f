// What gpom-learn is asked for: names, stretches of the way.
#include "tools/lib/learn_data.hpp"
#include "tools/lib/learn_params.hpp"

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
