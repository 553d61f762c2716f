// Worlds whose sensor fails now and then: what scans agree on is never called free, and no hit
// hides for long what is behind it.
#include "src/map/map.hpp"
#include "tests/common/keeping.hpp"

using namespace reference;

namespace
{

/// Something round that stands in a room for a while.
struct Thing {
    Xy centre;
    double radius_m;
    int from, to; ///< It stands there in scans from <= i < to.
};

/// Where the robot believes to be, and where it is.
struct Place {
    double x_m, y_m, yaw_rad;
};

/// What a sensor sends instead of one reading: one kind, or any (4).
float bad_reading(Random &random, std::uint32_t kind)
{
    switch (kind < 4 ? kind : random.below(4)) {
    case 0:
        return 0.0f;
    case 1:
        return random.uniform_f(0.001, 0.01);
    case 2:
        return kInf;
    default:
        return kNan;
    }
}

/// A room, and how a robot in it scans.
struct Scene {
    double half_x_m, half_y_m; ///< The room's walls.
    std::vector<Thing> things;
    Place start;               ///< True pose at the first scan; yaw stays.
    double step_x_m, step_y_m; ///< Its way from scan to scan.
    double jitter_m;           ///< Error of what it believes, along each axis.
    double share_bad;          ///< Of the readings.
    std::uint32_t kind_bad;    ///< Of bad_reading().
    std::vector<bool> fails;   ///< Beams that fail; empty: all may.
    int fails_every;           ///< How many scans from one in which they fail to the next.
    std::uint32_t n_beams;
    int n_scans;
    float range_min_m;
};

/// Way to the walls, from inside.
double range_to_walls(const Scene &scene, Xy from, double yaw_rad)
{
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    const double x = c == 0.0 ? 1e9 : (std::copysign(scene.half_x_m, c) - from.x) / c;
    const double y = s == 0.0 ? 1e9 : (std::copysign(scene.half_y_m, s) - from.y) / s;
    return std::min(x, y);
}

/// Way to a thing's surface; infinite if the ray misses it.
double range_to(const Thing &thing, Xy from, double yaw_rad)
{
    const double x = thing.centre.x - from.x, y = thing.centre.y - from.y;
    const double along = x * std::cos(yaw_rad) + y * std::sin(yaw_rad);
    const double across = y * std::cos(yaw_rad) - x * std::sin(yaw_rad);
    const double half2 = thing.radius_m * thing.radius_m - across * across;
    return along > 0.0 && half2 > 0.0 ? along - std::sqrt(half2) : HUGE_VAL;
}

double range_of(const Scene &scene, int i_scan, Xy from, double yaw_rad)
{
    double range_m = range_to_walls(scene, from, yaw_rad);
    for (const Thing &thing : scene.things) {
        if (i_scan >= thing.from && i_scan < thing.to) {
            range_m = std::min(range_m, range_to(thing, from, yaw_rad));
        }
    }
    return range_m;
}

Scene random_scene(Random &random)
{
    Scene scene = {};
    scene.half_x_m = random.uniform(2.0, 6.0);
    scene.half_y_m = random.uniform(2.0, 6.0);
    scene.n_scans = 6 + static_cast<int>(random.below(30));
    scene.start = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-4, 4)};
    const double step_m = random.below(3) > 0 ? 0.0 : 0.02;
    scene.step_x_m = random.uniform(-step_m, step_m);
    scene.step_y_m = random.uniform(-step_m, step_m);
    scene.jitter_m = random.below(2) == 0 ? 0.0 : random.uniform(0.0, 0.01);
    for (std::uint32_t n = random.below(9); n > 0; --n) {
        const double way_m = random.uniform(1.2, 4.0), yaw_rad = random.uniform(-4, 4);
        const int from = static_cast<int>(random.below(static_cast<std::uint32_t>(scene.n_scans)));
        const int to = random.below(3) > 0 ? 1000 : from + 1 + static_cast<int>(random.below(20));
        scene.things.push_back({{way_m * std::cos(yaw_rad), way_m * std::sin(yaw_rad)},
                                random.uniform(0.05, 0.5),
                                random.below(3) == 0 ? 0 : from,
                                to});
    }
    scene.share_bad = random.uniform(0.0, 0.1);
    scene.kind_bad = random.below(5);
    scene.fails_every = 1 + static_cast<int>(random.below(3));
    scene.n_beams = 90 + random.below(400);
    if (random.below(2) == 0) {
        scene.fails.resize(scene.n_beams);
        const std::uint32_t n_bad = static_cast<std::uint32_t>(scene.share_bad * scene.n_beams);
        const std::uint32_t first = random.below(2) == 0 ? 0 : random.below(scene.n_beams);
        for (std::uint32_t i = 0; i < n_bad; ++i) {
            scene.fails[(first + i) % scene.n_beams] = true;
        }
    }
    scene.range_min_m = random.below(2) == 0 ? 0.0f : 0.02f;
    return scene;
}

TestScan scan_of(const Scene &scene, Random &random, int i_scan)
{
    const Xy at = {scene.start.x_m + i_scan * scene.step_x_m,
                   scene.start.y_m + i_scan * scene.step_y_m};
    TestScan s;
    s.pose = {at.x + random.uniform(-scene.jitter_m, scene.jitter_m),
              at.y + random.uniform(-scene.jitter_m, scene.jitter_m), scene.start.yaw_rad, nullptr};
    s.sensor.range_min_m = scene.range_min_m;
    s.stamp_us = 100000 * i_scan;
    s.angle_min_rad = -kPi;
    s.angle_step_rad = 2.0 * kPi / scene.n_beams;
    const bool is_failing = scene.fails.empty() || i_scan % scene.fails_every == 0;
    for (std::uint32_t i = 0; i < scene.n_beams; ++i) {
        const double yaw_rad = s.pose.yaw_rad + s.angle_min_rad + i * s.angle_step_rad;
        const double range_m = range_of(scene, i_scan, at, yaw_rad);
        const bool fails =
            is_failing && (scene.fails.empty() ? random.uniform(0, 1) < scene.share_bad
                                               : static_cast<bool>(scene.fails[i]));
        s.ranges_m.push_back(fails ? bad_reading(random, scene.kind_bad)
                                   : static_cast<float>(range_m));
    }
    return s;
}

/// A beam as the map is told it.
struct Ray {
    Xy from, dir;
    double range_m;
    bool returned;
    Xy at(double range) const { return {from.x + range * dir.x, from.y + range * dir.y}; }
};

std::vector<Ray> rays_of(const TestScan &s)
{
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < s.ranges_m.size(); ++i) {
        const float range_m = s.ranges_m[i];
        if (range_m > 0.0f && range_m >= s.sensor.range_min_m) {
            const double yaw_rad =
                s.pose.yaw_rad + s.angle_min_rad + static_cast<double>(i) * s.angle_step_rad;
            const bool returned = range_m < s.sensor.range_max_m;
            rays.push_back({{s.pose.x_m, s.pose.y_m},
                            {std::cos(yaw_rad), std::sin(yaw_rad)},
                            static_cast<double>(returned ? range_m : s.sensor.range_max_m),
                            returned});
        }
    }
    return rays;
}

bool returns_near(const std::vector<Ray> &rays, Xy place, double within_m)
{
    return std::any_of(rays.begin(), rays.end(), [&](const Ray &ray) {
        const Xy end = ray.at(ray.range_m);
        return ray.returned && std::hypot(end.x - place.x, end.y - place.y) < within_m;
    });
}

/// Whether a beam runs by a place nearer than within_m and goes on beyond_m past it.
bool sees_through(const std::vector<Ray> &rays, Xy place, double within_m, double beyond_m)
{
    return std::any_of(rays.begin(), rays.end(), [&](const Ray &ray) {
        const double x = place.x - ray.from.x, y = place.y - ray.from.y;
        const double along = x * ray.dir.x + y * ray.dir.y;
        const double across = y * ray.dir.x - x * ray.dir.y;
        return along > 0.0 && ray.range_m - along > beyond_m && std::abs(across) < within_m;
    });
}

/// An indoor map's parameters, and the keep_m that goes with them.
gpom_config_t indoor_config(float keep_m)
{
    gpom_params_t params = params_of(GPOM_KERNEL_MATERN12);
    params.sf2 = 2.2f;
    params.ell_m = 1.9f;
    params.sn2 = 0.032f;
    params.sn2_once = 0.048f;
    params.sn2_free = 1.4f;
    params.alpha = 9.3f;
    params.beta = -5.3f;
    params.n_hits = 8;
    params.n_free = 8;
    params.gap_m = 0.1f;
    params.anisotropy = 0.38f;
    params.vote = 1.76f;
    params.line = 8.9f;
    gpom_config_t config = config_of(params, 8192);
    config.keep_m = keep_m;
    config.clear_scans = 3;
    return config;
}

/// Whether the last scans all returned from near a beam's end, and none saw through it or through
/// a place behind it. Not at an edge: the beams on either side end near it, too.
bool is_agreed(const std::vector<std::vector<Ray>> &scans, std::size_t i_ray, Xy behind)
{
    constexpr std::size_t kScans = 4; // its own, and three that agree
    constexpr double kKept_m = 0.05;
    const std::vector<Ray> &newest = scans.back();
    const Xy end = newest[i_ray].at(newest[i_ray].range_m);
    for (const std::size_t step : {std::size_t{1}, newest.size() - 1}) {
        const Ray &beside = newest[(i_ray + step) % newest.size()];
        const Xy other = beside.at(beside.range_m);
        if (!beside.returned || std::hypot(other.x - end.x, other.y - end.y) > 4.0 * kKept_m) {
            return false;
        }
    }
    return newest[i_ray].returned &&
           std::all_of(scans.end() - kScans, scans.end(), [&](const std::vector<Ray> &rays) {
               return returns_near(rays, end, kKept_m) &&
                      !sees_through(rays, end, kKept_m, kKept_m) &&
                      !sees_through(rays, behind, 0.05, kKept_m);
           });
}

/// Scans of a random scene, inserted into a map.
std::vector<std::vector<Ray>> insert_scene(TestMap &map, Random &random)
{
    const Scene scene = random_scene(random);
    std::vector<std::vector<Ray>> scans;
    for (int i = 0; i < scene.n_scans; ++i) {
        const TestScan s = scan_of(scene, random, i);
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        scans.push_back(rays_of(s));
    }
    return scans;
}

/// Places 5 cm behind returns of the last scan that earlier ones agree with.
std::vector<gpom_point_t> agreed_places(const std::vector<std::vector<Ray>> &scans)
{
    std::vector<gpom_point_t> places;
    for (std::size_t i = 0; i < scans.back().size(); ++i) {
        const Ray &ray = scans.back()[i];
        const Xy behind = ray.at(ray.range_m + 0.05);
        if (is_agreed(scans, i, behind)) {
            places.push_back({behind.x, behind.y});
        }
    }
    return places;
}

/// How many places scans of a scene agree on, and how many of them are free.
struct Agreed {
    std::size_t n_places, n_free;
};

Agreed agreed_of_scene(Random &random)
{
    TestMap map(indoor_config(0.05f));
    const std::vector<gpom_point_t> places = agreed_places(insert_scene(map, random));
    const Answers answers = query_points(map.get(), places);
    const auto n_free =
        std::count_if(answers.all.begin(), answers.all.end(),
                      [](const gpom_answer_t &answer) { return answer.cls == GPOM_FREE; });
    return {places.size(), static_cast<std::size_t>(n_free)};
}

/// Scan i of a robot that stands in a square room of 6 m, 360 beams from behind on. From scan 20 on
/// somebody stands 1.5 m off, to its right.
TestScan scan_of_person(int i_scan)
{
    TestScan s;
    s.stamp_us = 100000 * i_scan;
    s.sensor.range_min_m = 0.0f;
    s.angle_min_rad = -kPi;
    s.angle_step_rad = 2.0 * kPi / 360;
    for (int i = 0; i < 360; ++i) {
        const double yaw_rad = (i - 180) * kPi / 180;
        const bool is_person = i_scan >= 20 && i >= 50 && i <= 70;
        const double wall_m =
            3.0 / std::max(std::abs(std::cos(yaw_rad)), std::abs(std::sin(yaw_rad)));
        s.ranges_m.push_back(static_cast<float>(is_person ? 1.5 : wall_m));
    }
    return s;
}

/// Class 5 cm inside the person after 80 scans, each of them changed before it is inserted.
template <class Change> int class_of_person(Change change)
{
    Keeping k(indoor_config(0.05f));
    for (int i = 0; i < 80; ++i) {
        TestScan s = scan_of_person(i);
        change(s, i);
        k.see(s);
    }
    return k.ask({1.55 * std::cos(-kPi * 2 / 3), 1.55 * std::sin(-kPi * 2 / 3)}).cls;
}

} // namespace

// Rooms with things that come and go, a robot that stands or moves, whose poses are exact or
// jitter, and 0 to 10 % of the readings 0, millimetres, infinite or NaN, anywhere or always of the
// same beams: a place 5 cm behind a return of a surface that the scans of three more times agree
// with, and that none of them saw through, is not free. About one scene in three thousand has such
// a place all the same, where many past hits stand around it; eleven in a thousand had while hits
// refused beams for ever.
TEST_CASE("what scans of three times agree on is not free, whatever else the sensor sends")
{
    GPOM_TELL_SEED();
    const std::size_t n_scenes = GPOM_ASSERTS != 0 ? 100 : 1000; // with the sanitizers
    Random random(1701);
    std::size_t n_places = 0, n_with_free = 0;
    for (std::size_t i_scene = 0; i_scene < n_scenes; ++i_scene) {
        const Agreed agreed = agreed_of_scene(random);
        n_places += agreed.n_places;
        n_with_free += agreed.n_free > 0 ? 1 : 0;
    }
    CHECK(n_with_free <= 1 + n_scenes / 1000);
    CHECK(n_places > 100 * n_scenes);
}

// One reading of 7 mm in each scan, with poses that jitter, too, or six in every third scan.
TEST_CASE("readings of millimetres hide nobody")
{
    GPOM_TELL_SEED();
    Random random(1702);
    const auto near = [](TestScan &s, int first, int n, float range_m) {
        for (int i = first; i < first + n; ++i) {
            s.ranges_m[static_cast<std::size_t>(i)] = range_m;
        }
    };
    CHECK(class_of_person([&](TestScan &s, int) { near(s, 10, 1, 0.007f); }) == GPOM_OCCUPIED);
    CHECK(class_of_person([&](TestScan &s, int) {
              near(s, 10, 1, 0.007f);
              s.pose.x_m = random.uniform(-0.002, 0.002);
              s.pose.y_m = random.uniform(-0.002, 0.002);
          }) == GPOM_OCCUPIED);
    CHECK(class_of_person([&](TestScan &s, int i) { near(s, 8, 6, i % 3 == 0 ? 0.007f : 3.1f); }) ==
          GPOM_OCCUPIED);
}

// With keep_m 0.5 a part of the robot 0.1 m from the sensor is passed by a quarter of all beams:
// none of them is refused.
TEST_CASE("parts of the robot refuse no beam")
{
    Keeping k(indoor_config(0.5f));
    for (int i = 0; i < 80; ++i) {
        TestScan s = scan_of_person(i);
        std::fill_n(s.ranges_m.begin() + 8, 6, 0.1f);
        CHECK(k.see(s).beams_contradicting == 0);
    }
    const std::vector<gpom_beam_t> beams = k.map.beams();
    CHECK(std::any_of(beams.begin(), beams.end(), [](const gpom_beam_t &beam) {
        return beam.is_hit == 1 && beam.past == 0 && std::abs(beam.range_m - 1.5f) < 0.01f;
    }));
}

// A hit 5 m ahead is confirmed and passed in turn, so that it stands for ever: what is behind it is
// kept within 13 times, whatever mark the first time has.
TEST_CASE("a standing hit hides what is behind it for 13 times at most")
{
    for (int i_start = 0; i_start < 40; ++i_start) {
        Keeping k(keep_config(3));
        for (int i = 0; i < i_start; ++i) {
            k.see(look({500, 0}, 0.0, 5.0, i));
        }
        k.see(look({0, 0}, 0.0, 5.0, i_start));
        std::uint64_t n_refused = 0, n_kept = 0;
        int i = 0;
        for (; i < 40 && n_kept == 0; ++i) {
            TestScan s = look({0, 0}, 0.0, 5.0, i_start + 1 + i);
            k.see(s);
            s.ranges_m = {12.0f};
            const gpom_stats_t change = k.see(s);
            n_refused += change.beams_contradicting;
            n_kept += change.beams_hit;
        }
        CHECK(n_kept == 1);
        CHECK(i <= 13);
        CHECK(n_refused == static_cast<std::uint64_t>(i) - 1);
        CHECK(k.map.stats().hits_cleared == 0);
    }
}

// What stood long and left takes five scans to be cleared; what is seen behind it is kept from the
// third scan in a row on that sees through it.
TEST_CASE("a hit that two scans in a row saw through hides nothing")
{
    for (int i_start = 0; i_start < 40; ++i_start) {
        Keeping k(keep_config(3));
        for (int i = 0; i < i_start; ++i) {
            k.see(look({500, 0}, 0.0, 5.0, i));
        }
        for (int i = 0; i < 20; ++i) {
            k.see(look({0, 0}, 0.0, 5.0, i_start + i));
        }
        std::uint64_t n_kept = 0;
        for (int i = 0; i < 3; ++i) {
            n_kept += k.see(look({0, 0}, 0.0, 12.0, i_start + 20 + i)).beams_hit;
        }
        CHECK(n_kept == 1);
        CHECK(k.map.stats().hits_cleared == 0);
    }
}

// The longest scan there is, all of it new: walks never look at more than 2,048 beams of it that
// are not in the trees, so that its cost does not grow with the square of its length.
TEST_CASE("a long scan is indexed while it is inserted")
{
    GPOM_TELL_SEED();
    Random random(1703);
    gpom_config_t config = keep_config(3, 20000);
    config.keep_m = 0.05f;
    Keeping k(config);
    TestScan s = look({0, 0}, 0.0, 1.0, 0);
    s.ranges_m.resize(GPOM_RANGES_MAX);
    s.angle_step_rad = 2.0 * kPi / GPOM_RANGES_MAX;
    for (float &range_m : s.ranges_m) {
        range_m = random.uniform_f(0.5, 29.0);
    }
    CHECK(k.see(s).beams_hit > 20000);
    const gpom::Index &index = k.map.get()->index;
    CHECK(index.next_id - index.hit_tree.id_end < 2048 + GPOM_LANES_MAX);
    check_answers(k, config.params, 1704);
}
