// Cells on the wire: what is unknown stays unknown, and nothing looks freer or surer than it is.
#include "ports/codec/gpom_map.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>

// All 65536 of them.
TEST_CASE("a probability's code is the next of 254ths above it, and monotone")
{
    int last = 0;
    for (int p = 0; p <= 65535; ++p) {
        const int code =
            gpom_wire_probability_code(static_cast<std::uint16_t>(p), GPOM_WIRE_UNSURE);
        REQUIRE(code == static_cast<int>(std::ceil(254.0L * p / 65535.0L)));
        REQUIRE(code >= last);
        REQUIRE(code <= 254);
        last = code;
    }
    CHECK(gpom_wire_probability_code(0, GPOM_WIRE_FREE) == 0);
    CHECK(last == 254);
}

// For every threshold a planner may compare with, not only the map's.
TEST_CASE("no cell at or above a threshold is read below it")
{
    for (int threshold = 0; threshold <= 65535; ++threshold) {
        const auto p = static_cast<std::uint16_t>(threshold);
        const float read = gpom_wire_probability(gpom_wire_probability_code(p, GPOM_WIRE_OCCUPIED));
        REQUIRE(static_cast<double>(read) >= threshold / 65535.0 - 6e-8); // the quotient's rounding
    }
}

TEST_CASE("a variance is never read smaller than it was, and the class is kept")
{
    for (int v = 0; v <= 255; ++v) {
        for (std::uint8_t cls = GPOM_WIRE_FREE; cls <= GPOM_WIRE_UNKNOWN; ++cls) {
            const std::uint8_t code =
                gpom_wire_variance_class_code(static_cast<std::uint8_t>(v), cls);
            CHECK(gpom_wire_class(code) == cls);
            const double read = static_cast<double>(gpom_wire_variance_fraction(code));
            CHECK(read >= v / 255.0 - 6e-8);
            CHECK(read < v / 255.0 + 1.0 / 63.0);
        }
    }
    CHECK(gpom_wire_variance_fraction(gpom_wire_variance_class_code(255, GPOM_WIRE_FREE)) == 1.0f);
    CHECK(gpom_wire_variance_fraction(gpom_wire_variance_class_code(0, GPOM_WIRE_UNKNOWN)) == 0.0f);
}

// Not 0.5, not any probability: and a class of a later version is unknown, not one of these.
TEST_CASE("unknown has codes of its own, whatever the numbers beside it")
{
    for (int p = 0; p <= 65535; ++p) {
        const auto probability = static_cast<std::uint16_t>(p);
        REQUIRE(gpom_wire_probability_code(probability, GPOM_WIRE_UNKNOWN) ==
                GPOM_WIRE_PROBABILITY_UNKNOWN);
        REQUIRE(gpom_wire_probability_code(probability, GPOM_WIRE_OCCUPIED) !=
                GPOM_WIRE_PROBABILITY_UNKNOWN);
    }
    CHECK(gpom_wire_probability_code(32768, 4) == GPOM_WIRE_PROBABILITY_UNKNOWN);
    CHECK(gpom_wire_class(gpom_wire_variance_class_code(0, 4)) == GPOM_WIRE_UNKNOWN);
}

// A subscriber that compares the code with 254 and knows nothing of 255 must not drive there.
TEST_CASE("unknown read as a probability is above every threshold")
{
    CHECK(gpom_wire_probability(GPOM_WIRE_PROBABILITY_UNKNOWN) > 1.0f);
}
