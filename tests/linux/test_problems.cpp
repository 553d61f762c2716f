#include "ports/linux/config/problems.hpp"

#include <doctest/doctest.h>

#include <memory>

using gpomd::Problem;

// Of many cases of a kind the first is told, with its values; other kinds do not hide it.
TEST_CASE("a kind of problem is told once and shown as its bit")
{
    const auto problems = std::make_unique<gpomd::Problems>();
    Problem told = {};
    CHECK(!problems->next(told));
    CHECK(problems->bits() == 0);
    for (std::uint32_t kind = 0; kind < GPOM_WIRE_PROBLEM_KINDS; kind += 3) {
        for (int i = 1; i < 1000; ++i) {
            Problem problem = {kind};
            problem.value = i;
            problems->note(problem);
        }
    }
    std::int64_t bits = 0;
    for (std::uint32_t kind = 0; kind < GPOM_WIRE_PROBLEM_KINDS; kind += 3) {
        REQUIRE(problems->next(told));
        CHECK(told.kind == kind);
        CHECK(told.value == 1.0);
        bits |= std::int64_t{1} << kind;
    }
    CHECK(!problems->next(told));
    CHECK(problems->bits() == bits);
}
