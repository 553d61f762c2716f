// What a live map makes of how often a hit was seen: once, again, or no longer.
#include "tests/common/keeping.hpp"
#include "tests/common/lowres_fixture.hpp"

using namespace reference;

namespace
{

constexpr float kOnce = 0.3f;

/// Scans at times i_first and the next see through what is 5 m ahead of the origin.
void see_through(Keeping &k, int i_first)
{
    k.see(look({0, 0}, 0.0, 12.0, i_first));
    k.see(look({0, 0}, 0.0, 12.0, i_first + 1));
}

std::vector<Xy> past_hits(const Keeping &k)
{
    std::vector<Xy> places;
    for (const gpom_beam_t &b : k.map.beams()) {
        if (b.past == 1) {
            const double range_m = static_cast<double>(b.range_m);
            places.push_back({b.x_m + range_m * static_cast<double>(b.dir_x),
                              b.y_m + range_m * static_cast<double>(b.dir_y)});
        }
    }
    return places;
}

/// Centres of the cells that wait to be evaluated anew.
std::vector<Xy> dirty_places(gpom_map_t *map)
{
    const std::vector<bool> dirty = dirty_cells(map);
    const std::vector<gpom_point_t> centres = numbered_centres(raster_of(map).info.raster);
    std::vector<Xy> places;
    for (std::size_t i = 0; i < centres.size(); ++i) {
        if (dirty[i]) {
            places.push_back({centres[i].x_m, centres[i].y_m});
        }
    }
    return places;
}

} // namespace

// What scans of several times saw through is told with half its say, the noise variance
// 2 sn2 + k**, and queries are those of brute force with it.
TEST_CASE("a hit that was seen through is past")
{
    const gpom_config_t config = keep_config(2);
    Keeping k(config);
    k.see(look({0, 0}, 0.0, 5.0, 0));
    const float before = k.ask({5, 0}).probability;
    see_through(k, 1);
    const gpom_beam_t beam = k.beam(0);
    CHECK(beam.past == 1);
    CHECK(beam.is_hit == 1);
    CHECK(beam.provisional == 0);
    CHECK(beam.stamp_us == second(0)); // of its scan, so that the beam can follow its pose
    CHECK(k.map.stats().hits_cleared == 1);
    const double sn2 = static_cast<double>(config.params.sn2);
    const double prior = static_cast<double>(gpom_params_prior_variance(&config.params));
    CHECK(static_cast<double>(beam.hit_noise) == doctest::Approx(2.0 * sn2 + prior));
    CHECK(beam.free_noise == config.params.sn2_free);
    CHECK(k.ask({5, 0}).probability < 0.8f * before);
    check_answers(k, config.params, 210);
}

// A return from a past hit is new, and beams that pass it speak against nothing that stands.
TEST_CASE("a past hit confirms nothing and hides nothing")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 5.0, 0));
    see_through(k, 1);
    CHECK(k.see(look({0, 0}, 0.0, 12.0, 3)).beams_contradicting == 0);
    CHECK(k.see(look({5, -4}, kPi / 2, 4.0, 4)).beams_hit == 1);
    CHECK(k.see(look({5, -4}, kPi / 2, 4.0, 5)).beams_known == 1);
    CHECK(k.stands(2));
    CHECK(k.beam(0).past == 1);
    CHECK(k.beam(0).n_agreed == 0);
}

// However often something comes and goes, the past hits of different times keep their distance, and
// all that were cleared are counted.
TEST_CASE("the past is told once")
{
    GPOM_TELL_SEED();
    Keeping k(keep_config(2, 4096));
    Random random(211);
    int i_time = 0;
    for (int i = 0; i < 200; ++i) {
        const double range_m = random.uniform(4.0, 6.0);
        k.see(look({0, 0}, 0.0, range_m, i_time++));
        k.see(look({0, 0}, 0.0, range_m, i_time++)); // known free: confirmed
        for (int j = 0; j < 4; ++j) {
            k.see(look({0, 0}, 0.0, 12.0, i_time++));
        }
        if (i % 10 == 0) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
    }
    const std::vector<Xy> past = past_hits(k);
    CHECK(k.map.stats().hits_cleared >= 150);
    CHECK(past.size() >= 3);
    for (std::size_t i = 0; i < past.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            CHECK(std::hypot(past[i].x - past[j].x, past[i].y - past[j].y) >= 0.999 * kKeep_m);
        }
    }
}

// A hit that scans of one time alone saw has the noise sn2_once; seen again at another time it has
// sn2, until scans that see through it take its last count. Free points keep theirs.
TEST_CASE("agreement lowers a hit's noise, contradiction raises it again")
{
    gpom_config_t config = keep_config(3);
    config.params.sn2_once = kOnce;
    Keeping k(config);
    const auto see_twice = [&k](double range_m, int i_time) {
        k.see(look({0, 0}, 0.0, range_m, i_time));
        k.see(look({0, 0}, 0.0, range_m, i_time));
        return k.beam(0).hit_noise;
    };
    CHECK(see_twice(5.0, 0) == kOnce);
    check_answers(k, config.params, 212);
    CHECK(see_twice(5.0, 1) == config.params.sn2);
    check_answers(k, config.params, 213);
    CHECK(see_twice(12.0, 2) == kOnce);
    CHECK(see_twice(12.0, 3) == kOnce);
    CHECK(see_twice(5.0, 4) == config.params.sn2);
    CHECK(k.beam(0).free_noise == config.params.sn2_free);
}

// Where every beam is kept nobody knows which agree, and sn2_once has no effect.
TEST_CASE("a map that keeps every beam has one noise of hits")
{
    gpom_config_t config = keep_config(0);
    config.keep_m = 0.0f;
    config.params.sn2_once = kOnce;
    Keeping k(config);
    k.see(look({0, 0}, 0.0, 5.0, 0));
    CHECK(k.beam(0).hit_noise == config.params.sn2);
}

// When a hit is confirmed or loses its last count, the cells within reach of it are marked and no
// others. Once evaluated they hold the query's answers, also when it has become past.
TEST_CASE("what is said of a hit alone marks the cells near it")
{
    gpom_config_t config = lowres_config(60, 60, 1.0);
    config.keep_m = kKeep_m;
    config.clear_scans = 2;
    config.lowres_reach_m = 1.5f;
    config.params.sn2_once = kOnce;
    Keeping k(config);
    const Xy at = {6.3, 0.2}, hit = {16.3, 0.2};
    k.see(look(at, 0.0, 10.0, 0));
    settle(k.map.get());
    const auto check_marks = [&](const TestScan &scan) {
        const gpom_stats_t change = k.see(scan);
        REQUIRE(change.beams_hit + change.beams_no_return == 0);
        const std::vector<Xy> dirty = dirty_places(k.map.get());
        CHECK(dirty.size() >= 4);
        for (const Xy &place : dirty) {
            CHECK(std::max(std::abs(place.x - hit.x), std::abs(place.y - hit.y)) < 2.1);
        }
        settle(k.map.get());
        check_equals_query(k.map, config);
    };
    check_marks(look(at, 0.0, 10.0, 1)); // confirmed
    check_marks(look(at, 0.0, 20.0, 2)); // its only count is gone
    k.see(look(at, 0.0, 20.0, 3));
    CHECK(k.beam(0).past == 1);
    settle(k.map.get());
    check_equals_query(k.map, config);
}
