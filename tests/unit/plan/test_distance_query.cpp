// The nearest surface against a search of the plane around the point.
#include "gpom/distances.h"
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

struct Found {
    gpom_distance_answer_t answer;
    gpom_status_t status;
};

Found query(const gpom_map_t *map, gpom_point_t point, double range_m)
{
    GuardedMemory memory(gpom_scratch_bytes(map), 1);
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    Found found = {{77.0f, 0.0f, 0.0f, 0.0f, 0}, GPOM_OK};
    found.status = gpom_distance_query(map, &point, range_m, &found.answer, &scratch);
    CHECK(memory.is_intact());
    return found;
}

/// A scan of the inside of a rectangle about the origin, in a full turn, from a place in it.
TestScan room_scan(Xy half, Xy from, double stamp_s)
{
    constexpr int kBeams = 360;
    TestScan scan;
    scan.pose = {from.x, from.y, 0.0, nullptr};
    scan.stamp_us = std::int64_t(1e6 * stamp_s);
    scan.angle_min_rad = 0.0;
    scan.angle_step_rad = 2.0 * kPi / kBeams;
    for (int i = 0; i < kBeams; ++i) {
        const double dx = std::cos(2.0 * kPi * i / kBeams), dy = std::sin(2.0 * kPi * i / kBeams);
        const double to_x = ((dx > 0 ? half.x : -half.x) - from.x) / dx;
        const double to_y = ((dy > 0 ? half.y : -half.y) - from.y) / dy;
        scan.ranges_m.push_back(static_cast<float>(std::min(to_x, to_y)));
    }
    return scan;
}

constexpr Xy kHalf = {5.0, 3.0};

struct Room {
    TestMap map{config_of(params_of(GPOM_KERNEL_MATERN12))};

    Room()
    {
        for (int i = 0; i < 3; ++i) {
            REQUIRE(room_scan(kHalf, {2.0 * i - 2.0, 0.5 * i}, i).insert_into(map.get()) ==
                    GPOM_OK);
        }
    }
};

double wall_distance(gpom_point_t p)
{
    return std::min(kHalf.x - std::fabs(p.x_m), kHalf.y - std::fabs(p.y_m));
}

double probability_at(const gpom_map_t *map, gpom_point_t from, const gpom_distance_answer_t &a,
                      double length_m)
{
    const gpom_point_t p = {from.x_m + length_m * double(a.direction_x),
                            from.y_m + length_m * double(a.direction_y)};
    return double(query_points(map, {p}).all[0].probability);
}

} // namespace

// The walls are known to the millimetre, so that the answer must be near the truth.
TEST_CASE("in a room the nearest surface is the nearest wall")
{
    GPOM_TELL_SEED();
    Room room;
    Random random(750);
    int n_within = 0;
    for (int i = 0; i < 100; ++i) {
        const gpom_point_t p = {random.uniform(-4.7, 4.7), random.uniform(-2.7, 2.7)};
        const Found found = query(room.map.get(), p, 8.0);
        CHECK(found.status == GPOM_OK);
        const gpom_distance_answer_t &a = found.answer;
        const double distance_m = double(a.distance_m);
        CHECK(std::fabs(distance_m - wall_distance(p)) < 0.2);
        const gpom_point_t place = {p.x_m + distance_m * double(a.direction_x),
                                    p.y_m + distance_m * double(a.direction_y)};
        CHECK(std::fabs(wall_distance(place)) < 0.2);
        CHECK(std::hypot(double(a.direction_x), double(a.direction_y)) == doctest::Approx(1.0));
        n_within += std::fabs(distance_m - wall_distance(p)) < 1.96 * double(a.deviation_m) ? 1 : 0;
    }
    CHECK(n_within >= 95);
}

// By the answers of queries along the direction.
TEST_CASE("the probability reaches 1/2 at the place that is found")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    drive(map.get(), 752, 6);
    int n_checked = 0;
    for (const gpom_point_t &p : random_points(753, 200, 12.0)) {
        const Found found = query(map.get(), p, 6.0);
        REQUIRE(found.status == GPOM_OK);
        const gpom_distance_answer_t &a = found.answer;
        const bool is_inside = query_points(map.get(), {p}).all[0].probability >= 0.5f;
        CHECK(((a.flags & GPOM_DISTANCE_INSIDE) != 0) == is_inside);
        if (a.flags == 0) {
            const double step_m = 6.5 / 256; // at most: a ray is no longer than range and 0.5 m
            double least = 1.0, most = 0.0;
            for (int i = -20; i <= 20; ++i) {
                const double length_m = double(a.distance_m) + step_m * i / 20.0;
                const double now = probability_at(map.get(), p, a, std::max(0.0, length_m));
                least = std::min(least, now), most = std::max(most, now);
            }
            CHECK(least < 0.5);
            CHECK(most >= 0.5);
            ++n_checked;
        }
    }
    CHECK(n_checked > 20);
}

TEST_CASE("far from all hits nothing is found within range")
{
    Room room;
    const Found near = query(room.map.get(), {0.0, 0.0}, 1.0);
    CHECK(near.status == GPOM_OK);
    CHECK(near.answer.flags == GPOM_DISTANCE_NONE);
    CHECK(near.answer.distance_m == 1.0f);
    CHECK(near.answer.direction_x == 0.0f);
}

TEST_CASE("arguments that make no sense leave the answer as it was")
{
    Room room;
    const gpom_map_t *const map = room.map.get();
    const double nan = std::nan("");
    for (const double bad : {nan, double(INFINITY)}) {
        CHECK(query(map, {bad, 0.0}, 1.0).status == GPOM_ERR_ARG);
        CHECK(query(map, {0.0, bad}, 1.0).status == GPOM_ERR_ARG);
        CHECK(query(map, {0.0, 0.0}, bad).status == GPOM_ERR_ARG);
    }
    CHECK(query(map, {0.0, 0.0}, 0.0).status == GPOM_ERR_ARG);
    const Found far = query(map, {9000.0, 0.0}, 1.0);
    CHECK(far.status == GPOM_ERR_REACH);
    CHECK(far.answer.distance_m == 77.0f);
    const gpom_point_t point = {0.0, 0.0};
    gpom_distance_answer_t answer = {};
    char few[8];
    const gpom_scratch_t scratch = {few, sizeof few};
    CHECK(gpom_distance_query(map, &point, 1.0, &answer, &scratch) == GPOM_ERR_MEM);
    CHECK(gpom_distance_query(nullptr, &point, 1.0, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_distance_query(map, nullptr, 1.0, &answer, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_distance_query(map, &point, 1.0, nullptr, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_distance_query(map, &point, 1.0, &answer, nullptr) == GPOM_ERR_ARG);
}
