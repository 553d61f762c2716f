// Path queries against samples that are made and asked one by one.
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

struct PathAnswer {
    gpom_path_result_t result;
    gpom_status_t status;
};

gpom_path_t path_of(const std::vector<gpom_point_t> &points, double radius_m, double spacing_m,
                    float stop_probability = 2.0f)
{
    return {points.data(), points.size(), radius_m, spacing_m, stop_probability};
}

PathAnswer query_path(const gpom_map_t *map, const gpom_path_t &path)
{
    GuardedMemory memory(gpom_scratch_bytes(map), 1);
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    PathAnswer answer = {};
    answer.status = gpom_path_query(map, &path, &answer.result, &scratch);
    CHECK(memory.is_intact());
    return answer;
}

Xy at_angle(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

struct Sample {
    gpom_point_t place;
    double arc_m;
};

int steps(double length_m, double spacing_m)
{
    return static_cast<int>(std::ceil(length_m / spacing_m));
}

/// Rings from the centre outward, each from one angle to another.
void add_sector(std::vector<Sample> &samples, const gpom_path_t &path, Xy centre, double from_rad,
                double sweep_rad, double arc_m)
{
    const int n_rings = steps(path.radius_m, path.spacing_m);
    for (int ring = 0; ring <= n_rings; ++ring) {
        const double r_m = n_rings > 0 ? path.radius_m * ring / n_rings : 0.0;
        const int n = steps(r_m * std::abs(sweep_rad), path.spacing_m);
        for (int i = 0; i <= n; ++i) {
            const Xy d = at_angle(from_rad + (n > 0 ? sweep_rad * i / n : 0.0));
            samples.push_back({{centre.x + r_m * d.x, centre.y + r_m * d.y}, arc_m});
        }
    }
}

/// All samples by the words of path.h, of a path without stretches of no length; angles by atan2.
std::vector<Sample> samples_of(const gpom_path_t &path)
{
    std::vector<Sample> samples;
    double arc_m = 0.0, before_rad = 0.0;
    for (std::size_t i = 0; i + 1 < path.n_points; ++i) {
        const Xy a = {path.points[i].x_m, path.points[i].y_m};
        const Xy b = {path.points[i + 1].x_m, path.points[i + 1].y_m};
        const double heading_rad = std::atan2(b.y - a.y, b.x - a.x);
        if (i == 0) {
            add_sector(samples, path, a, heading_rad + kPi / 2, kPi, 0.0);
        } else {
            const double turn_rad = std::remainder(heading_rad - before_rad, 2 * kPi);
            const double side_rad = turn_rad < 0.0 ? kPi / 2 : -kPi / 2;
            if (path.radius_m * std::abs(turn_rad) > 1e-3 * path.spacing_m) {
                add_sector(samples, path, a, before_rad + side_rad, turn_rad, arc_m);
            }
        }
        const double length_m = std::hypot(b.x - a.x, b.y - a.y);
        const int n_along = steps(length_m, path.spacing_m);
        const int n_across = steps(2 * path.radius_m, path.spacing_m);
        const Xy t = at_angle(heading_rad);
        for (int j = 0; j <= n_along; ++j) {
            const double u_m = length_m * j / n_along;
            for (int k = 0; k <= n_across; ++k) {
                const double v_m = n_across > 0 ? path.radius_m * (2.0 * k / n_across - 1.0) : 0.0;
                samples.push_back(
                    {{a.x + u_m * t.x - v_m * t.y, a.y + u_m * t.y + v_m * t.x}, arc_m + u_m});
            }
        }
        arc_m += length_m;
        before_rad = heading_rad;
    }
    const gpom_point_t &last = path.points[path.n_points - 1];
    const bool stands_still = path.n_points == 1;
    add_sector(samples, path, {last.x_m, last.y_m}, stands_still ? 0.0 : before_rad - kPi / 2,
               stands_still ? 2 * kPi : kPi, arc_m);
    return samples;
}

std::vector<gpom_point_t> places_of(const std::vector<Sample> &samples)
{
    std::vector<gpom_point_t> places;
    for (const Sample &sample : samples) {
        places.push_back(sample.place);
    }
    return places;
}

std::vector<gpom_point_t> random_path(Random &random)
{
    std::vector<gpom_point_t> points = {{random.uniform(-3, 9), random.uniform(-5, 5)}};
    for (std::uint32_t i = random.below(5); i > 0; --i) {
        const gpom_point_t &last = points.back();
        points.push_back({last.x_m + random.uniform(-4, 4), last.y_m + random.uniform(-4, 4)});
    }
    return points;
}

double distance_to_path(const gpom_point_t &p, const std::vector<gpom_point_t> &path)
{
    double nearest_m = std::hypot(p.x_m - path[0].x_m, p.y_m - path[0].y_m);
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        const double dx = path[i + 1].x_m - path[i].x_m;
        const double dy = path[i + 1].y_m - path[i].y_m;
        const double t =
            ((p.x_m - path[i].x_m) * dx + (p.y_m - path[i].y_m) * dy) / (dx * dx + dy * dy);
        const double s = std::clamp(t, 0.0, 1.0);
        nearest_m = std::min(
            nearest_m, std::hypot(p.x_m - path[i].x_m - s * dx, p.y_m - path[i].y_m - s * dy));
    }
    return nearest_m;
}

} // namespace

// Highest probability, its place, arc length and the number of samples equal brute force over
// independently made samples; a threshold stops at the first sample that reaches it.
TEST_CASE("a path query equals brute force over its samples")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    drive(map.get(), 300, 4);
    Random random(301);
    for (int round = 0; round < 60; ++round) {
        const std::vector<gpom_point_t> points = random_path(random);
        const double radius_m = round % 6 == 0 ? 0.0 : random.uniform(0.05, 1.5);
        gpom_path_t path = path_of(points, radius_m, random.uniform(0.15, 0.6));
        const std::vector<Sample> samples = samples_of(path);
        const std::vector<gpom_answer_t> answers = query_points(map.get(), places_of(samples)).all;
        const PathAnswer all = query_path(map.get(), path);
        REQUIRE(all.status == GPOM_OK);
        float highest = 0.0f;
        for (const gpom_answer_t &answer : answers) {
            highest = std::max(highest, answer.probability);
        }
        CHECK(all.result.n_samples == samples.size());
        CHECK(std::abs(all.result.probability - highest) <= 1e-4f);
        const gpom_point_t place = {all.result.x_m, all.result.y_m};
        const gpom_answer_t there = query_points(map.get(), {place}).all[0];
        CHECK(there.probability == all.result.probability);
        CHECK(there.cls == all.result.cls);
        CHECK(all.result.flags == 0);

        path.stop_probability = highest - 0.1f;
        const auto first = std::find_if(answers.begin(), answers.end(), [&](const auto &a) {
            return a.probability >= path.stop_probability;
        });
        const std::size_t i_first = static_cast<std::size_t>(first - answers.begin());
        const PathAnswer stopped = query_path(map.get(), path);
        CHECK(stopped.result.flags == GPOM_PATH_STOPPED);
        CHECK(stopped.result.n_samples == i_first + 1);
        // A corner's turn is a float: known to 6e-7 rad.
        CHECK(std::abs(stopped.result.x_m - samples[i_first].place.x_m) <= 1e-6);
        CHECK(std::abs(stopped.result.y_m - samples[i_first].place.y_m) <= 1e-6);
        CHECK(std::abs(stopped.result.arc_m - samples[i_first].arc_m) <= 1e-9);
    }
}

// Every sample lies in the swept area, arc lengths never fall, and every point of the area has a
// sample within 0.8 of the spacing: on this oracle, which the test above ties to the library.
TEST_CASE("samples cover the swept area")
{
    GPOM_TELL_SEED();
    Random random(302);
    for (int round = 0; round < 40; ++round) {
        const std::vector<gpom_point_t> points = random_path(random);
        const double radius_m = random.uniform(0.05, 1.5);
        const double spacing_m = random.uniform(0.1, 0.6);
        const std::vector<Sample> samples = samples_of(path_of(points, radius_m, spacing_m));
        for (std::size_t i = 0; i < samples.size(); ++i) {
            REQUIRE(distance_to_path(samples[i].place, points) <= radius_m + 1e-9);
            REQUIRE((i == 0 || samples[i].arc_m >= samples[i - 1].arc_m - 1e-9));
        }
        for (int i = 0; i < 300; ++i) {
            const gpom_point_t &corner =
                points[random.below(static_cast<std::uint32_t>(points.size()))];
            const gpom_point_t p = {corner.x_m + random.uniform(-3, 3),
                                    corner.y_m + random.uniform(-3, 3)};
            if (distance_to_path(p, points) > radius_m) {
                continue;
            }
            double nearest_m = 1e9;
            for (const Sample &sample : samples) {
                nearest_m = std::min(
                    nearest_m, std::hypot(sample.place.x_m - p.x_m, sample.place.y_m - p.y_m));
            }
            REQUIRE(nearest_m <= 0.8 * spacing_m);
        }
    }
}

// Corners that repeat the one before them change nothing, wherever they are.
TEST_CASE("stretches of no length are left out")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    drive(map.get(), 303, 3);
    const std::vector<gpom_point_t> plain = {{0, 0}, {3, 1}, {2, 4}};
    const std::vector<gpom_point_t> repeated = {{0, 0}, {0, 0}, {3, 1}, {3, 1},
                                                {3, 1}, {2, 4}, {2, 4}};
    const PathAnswer a = query_path(map.get(), path_of(plain, 0.7, 0.2));
    const PathAnswer b = query_path(map.get(), path_of(repeated, 0.7, 0.2));
    CHECK(std::memcmp(&a.result, &b.result, sizeof a.result) == 0);
    const std::vector<gpom_point_t> still = {{1, 1}, {1, 1}};
    const PathAnswer c = query_path(map.get(), path_of(still, 0.7, 0.2));
    const PathAnswer d = query_path(map.get(), path_of({{1, 1}}, 0.7, 0.2));
    CHECK(c.result.n_samples == d.result.n_samples);
    CHECK(c.result.probability == d.result.probability);
}

// A wall across the way is found where it stands, and a path beside it is free.
TEST_CASE("a wall across the way is found")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    TestScan scan;
    scan.angle_min_rad = -0.6;
    scan.angle_step_rad = 0.02;
    for (int i = 0; i < 61; ++i) {
        scan.ranges_m.push_back(static_cast<float>(5.0 / std::cos(-0.6 + 0.02 * i)));
    }
    REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    const std::vector<gpom_point_t> through = {{0.5, 0.0}, {2.0, 0.0}, {8.0, 0.0}};
    const PathAnswer blocked = query_path(map.get(), path_of(through, 0.4, 0.1, 0.8f));
    CHECK(blocked.result.flags == GPOM_PATH_STOPPED);
    CHECK(blocked.result.cls == GPOM_OCCUPIED);
    CHECK(blocked.result.arc_m > 3.5);
    CHECK(blocked.result.arc_m < 4.7);
    const std::vector<gpom_point_t> before = {{0.5, 0.0}, {3.5, 0.0}};
    const PathAnswer open = query_path(map.get(), path_of(before, 0.4, 0.1, 0.8f));
    CHECK(open.result.flags == 0);
    CHECK(open.result.cls == GPOM_FREE);
}

// A path that leaves the reach says so and still answers; what is asked beyond is the prior.
TEST_CASE("a path out of reach is flagged")
{
    const gpom_params_t params = params_of(GPOM_KERNEL_MATERN12);
    TestMap map(config_of(params));
    const std::vector<gpom_point_t> points = {{GPOM_REACH_M - 1.0, 0.0}, {GPOM_REACH_M + 1.0, 0.0}};
    const PathAnswer answer = query_path(map.get(), path_of(points, 0.0, 0.5));
    CHECK(answer.status == GPOM_ERR_REACH);
    CHECK(answer.result.flags == GPOM_PATH_OUT_OF_REACH);
    CHECK(std::abs(answer.result.probability - gpom_params_prior_probability(&params)) < 1e-4f);
    const std::vector<gpom_point_t> beyond = {{GPOM_REACH_M + 5.0, 0.0}, {GPOM_REACH_M + 9.0, 0.0}};
    const PathAnswer same =
        query_path(map.get(), path_of(beyond, 0.0, 0.5)); // all equal: the first
    CHECK(same.result.x_m == GPOM_REACH_M + 5.0);
    CHECK(same.result.arc_m == 0.0);
    const std::vector<gpom_point_t> far_off = {{1e300, -1e300}};
    CHECK(query_path(map.get(), path_of(far_off, 1.0, 0.5)).status == GPOM_ERR_REACH);
}

// Each wrong argument is refused and leaves the result alone.
TEST_CASE("wrong paths are refused")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    const std::vector<gpom_point_t> points = {{0, 0}, {1, 0}};
    const gpom_path_t good = path_of(points, 0.3, 0.1);
    const auto refused = [&map](gpom_path_t path) {
        const PathAnswer answer = query_path(map.get(), path);
        CHECK(answer.status == GPOM_ERR_ARG);
        CHECK(answer.result.n_samples == 0);
        CHECK(answer.result.probability == 0.0f);
    };
    const double nan = static_cast<double>(kNan);
    const double inf = static_cast<double>(kInf);
    gpom_path_t bad = good;
    bad.points = nullptr;
    refused(bad);
    bad = good;
    bad.n_points = 0;
    refused(bad);
    for (const double radius_m : {nan, -0.1, inf, 1e300}) {
        refused(path_of(points, radius_m, 0.1));
    }
    for (const double spacing_m : {nan, 0.0, -0.1, inf, 1e-300, 1e-8}) {
        refused(path_of(points, 0.3, spacing_m));
    }
    refused(path_of(points, 0.3, 0.1, kNan));
    for (const double x_m : {nan, inf, 1e300}) {
        const std::vector<gpom_point_t> wild = {{0, 0}, {x_m, 0}};
        refused(path_of(wild, 0.3, 0.1));
    }
    gpom_path_result_t result;
    std::vector<unsigned char> mem(gpom_scratch_bytes(map.get()));
    const gpom_scratch_t scratch = {mem.data(), mem.size()};
    const gpom_scratch_t short_scratch = {mem.data(), mem.size() - 1};
    CHECK(gpom_path_query(nullptr, &good, &result, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_path_query(map.get(), nullptr, &result, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_path_query(map.get(), &good, nullptr, &scratch) == GPOM_ERR_ARG);
    CHECK(gpom_path_query(map.get(), &good, &result, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_path_query(map.get(), &good, &result, &short_scratch) == GPOM_ERR_MEM);
}
