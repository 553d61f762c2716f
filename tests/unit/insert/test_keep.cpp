// What is worth keeping, told by small worlds whose outcome follows from the rules alone.
#include "tests/common/keeping.hpp"

using namespace reference;

namespace
{

std::uint64_t sum_of_causes(const gpom_stats_t &n)
{
    return n.beams_hit + n.beams_no_return + n.beams_nan + n.beams_not_positive + n.beams_too_near +
           n.beams_masked + n.beams_known + n.beams_contradicting + n.beams_redundant +
           n.beams_ids_spent;
}

/// `n` scans at times i_first, i_first + 1, ... see through the hit of beam 0 at 5 m ahead of the
/// origin. Returns after how many it was gone; 0: never.
int n_times_until_cleared(Keeping &k, int i_first, int n)
{
    for (int i = 0; i < n; ++i) {
        k.see(look({0, 0}, 0.0, 12.0, i_first + i));
        if (!k.stands(0)) {
            return i + 1;
        }
    }
    return 0;
}

} // namespace

// A return within keep_m of a kept hit of an earlier scan is not kept, counts as known and as an
// agreement; one farther away is kept. From wherever it is seen.
TEST_CASE("a return near a kept hit confirms it")
{
    GPOM_TELL_SEED();
    Random random(130);
    int n_known = 0;
    for (int i = 0; i < 300; ++i) {
        Keeping k(keep_config(0));
        REQUIRE(k.see(look({0, 0}, 0.0, 5.0, 0)).beams_hit == 1);
        const double apart_m = random.uniform(0.0, 1.0), side_rad = random.uniform(-4, 4);
        const Xy end = {5.0 + apart_m * std::cos(side_rad), apart_m * std::sin(side_rad)};
        const Xy from = {random.uniform(-9, 15), random.uniform(-9, 9)};
        const double range_m = std::hypot(end.x - from.x, end.y - from.y);
        if (std::abs(apart_m - static_cast<double>(kKeep_m)) < 1e-4 || range_m < 0.1) {
            continue;
        }
        if (i % 2 == 0) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        const double yaw_rad = std::atan2(end.y - from.y, end.x - from.x);
        const gpom_stats_t change = k.see(look(from, yaw_rad, range_m, 1));
        const bool is_known = apart_m < static_cast<double>(kKeep_m);
        CAPTURE(apart_m);
        CHECK(change.beams_known == (is_known ? 1 : 0));
        CHECK(change.beams_hit == (is_known ? 0 : 1));
        CHECK(k.beam(0).n_agreed == (is_known ? 1 : 0));
        n_known += is_known ? 1 : 0;
    }
    CHECK(n_known > 100);
}

// What is known reaches as deep as what is occupied: a return nearer than keep_m to the part behind
// a kept hit adds nothing and confirms nothing, from wherever it is seen.
TEST_CASE("a return in the depth of a kept hit is known")
{
    GPOM_TELL_SEED();
    Random random(24);
    constexpr double kDepth_m = 0.3;
    int n_known = 0;
    for (int i = 0; i < 400; ++i) {
        gpom_config_t config = keep_config(0);
        config.params.depth_m = static_cast<float>(kDepth_m);
        Keeping k(config);
        k.see(look({0, 0}, 0.0, 5.0, 0)); // occupied: from (5, 0) to (5.3, 0)
        const Xy end = {random.uniform(4.8, 5.5), random.uniform(-0.2, 0.2)};
        const double yaw_rad = random.uniform(-3, 3), range_m = random.uniform(1, 9);
        const Xy from = {end.x - range_m * std::cos(yaw_rad), end.y - range_m * std::sin(yaw_rad)};
        const double apart_m = std::hypot(end.x - std::clamp(end.x, 5.0, 5.0 + kDepth_m), end.y);
        const double from_hit_m = std::hypot(end.x - 5.0, end.y);
        if (std::abs(apart_m - static_cast<double>(kKeep_m)) < 1e-4) {
            continue;
        }
        if (i % 2 == 0) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        const gpom_stats_t change = k.see(look(from, yaw_rad, range_m, 1));
        const bool is_known = apart_m < static_cast<double>(kKeep_m);
        CHECK(change.beams_known == (is_known ? 1 : 0));
        CHECK(change.beams_hit == (is_known ? 0 : 1));
        CHECK(k.beam(0).n_agreed == (from_hit_m < static_cast<double>(kKeep_m) ? 1 : 0));
        n_known += is_known ? 1 : 0;
    }
    CHECK(n_known > 100);
}

// Within one scan, too, no two kept returns are nearer to each other than keep_m, and a beam that
// saw nothing makes no return known, wherever it ends.
TEST_CASE("returns of one scan keep their distance, and from returns alone")
{
    Keeping k(keep_config(0));
    TestScan s = look_around({0, 0}, 720, 6.0f, 0);
    s.sensor.range_max_m = 6.5f;
    for (std::size_t i = 0; i < s.ranges_m.size(); i += 9) {
        s.ranges_m[i] = kInf;
    }
    const gpom_stats_t change = k.see(s);
    CHECK(change.beams_hit + change.beams_no_return + change.beams_known == 720);
    const std::vector<gpom_beam_t> beams = k.map.beams();
    for (std::size_t i = 0; i < beams.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const double angle =
                std::acos(std::clamp(static_cast<double>(beams[i].dir_x * beams[j].dir_x +
                                                         beams[i].dir_y * beams[j].dir_y),
                                     -1.0, 1.0));
            const bool both_hits = beams[i].is_hit == 1 && beams[j].is_hit == 1;
            CHECK((!both_hits || 2.0 * 6.0 * std::sin(0.5 * angle) >= 0.4999));
        }
    }
    Keeping beside(keep_config(0));
    TestScan two = look({0, 0}, 0.0, 29.9, 0);
    two.ranges_m = {kInf, 29.9f}; // free up to 30 m, and beside its end a wall
    two.angle_step_rad = 1e-4;
    const gpom_stats_t both = beside.see(two);
    CHECK(both.beams_no_return == 1);
    CHECK(both.beams_hit == 1);
}

// Every beam offered has one counter, whatever the settings, the repeats of stamps and the slices;
// the kept ones are in the map unless another counter tells why they went; and queries see exactly
// those that are in and not provisional.
TEST_CASE("the counters account for every beam, and a full map never fails")
{
    GPOM_TELL_SEED();
    int n_config = 0;
    for (const std::uint32_t beam_max : {1u, 9u, 60u, 400u, 3000u}) {
        for (const std::uint32_t clear_scans : {0u, 2u, 4u}) {
            gpom_config_t config = keep_config(clear_scans, beam_max);
            config.keep_m = n_config % 5 == 4 && clear_scans == 0 ? 0.0f : 0.7f;
            config.far_m = n_config % 2 == 0 ? 0.0f : 8.0f;
            config.old_s = n_config % 3 == 0 ? 0.0f : 1.0f;
            ++n_config;
            CAPTURE(beam_max);
            CAPTURE(clear_scans);
            Keeping k(config);
            Random random(131);
            std::uint64_t n_offered = 0;
            for (int i = 0; i < 40; ++i) {
                TestScan s = yard_scan(random, i % 4, {0, 0});
                s.stamp_us = second(i / 2);
                s.ranges_m[3] = kNan;
                s.ranges_m[4] = 0.0f;
                n_offered += s.ranges_m.size();
                k.see(s);
                if (i % 7 == 3) {
                    REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
                }
                const gpom_stats_t n = k.map.stats();
                REQUIRE(sum_of_causes(n) == n_offered);
                const std::size_t n_beams = k.map.beams().size(); // checks the store as well
                REQUIRE(n_beams <= beam_max);
                const std::uint64_t n_in = n.beams_hit + n.beams_no_return -
                                           gpom_stats_evicted(&n) - n.beams_not_confirmed;
                REQUIRE(n_in >= n_beams);
                REQUIRE(n_in - n_beams <= n.free_cleared); // neither hit nor free segment is left
            }
            const gpom_stats_t n = k.map.stats();
            CHECK((beam_max > 60 || gpom_stats_evicted(&n) + n.beams_redundant > 0));
            CHECK((beam_max != 60 || gpom_stats_evicted(&n) > 0));
            CHECK((clear_scans != 2 || beam_max != 3000 || n.hits_cleared > 0));
            check_answers(k, config.params, 132);
        }
    }
}

// What is kept, and in which slot, does not depend on which beams the trees know already: full maps
// evict by slot, so that the place of a beam decides about others.
TEST_CASE("building in between does not change what is kept, nor where")
{
    GPOM_TELL_SEED();
    for (const std::uint32_t beam_max : {4000u, 500u}) {
        CAPTURE(beam_max);
        std::vector<gpom_beam_t> kept[2];
        for (const bool builds : {false, true}) {
            Keeping k(keep_config(2, beam_max));
            Random random(133);
            for (int i = 0; i < 60; ++i) {
                k.see(yard_scan(random, i % 8, {0, 0}));
                if (builds) {
                    REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
                }
            }
            kept[builds ? 1 : 0] = k.map.beams();
            CHECK(k.map.stats().hits_cleared > 0);
            CHECK(k.map.stats().beams_not_confirmed > 0);
            CHECK((beam_max == 4000 || k.map.n_evicted() > 0));
        }
        REQUIRE(kept[0].size() == kept[1].size());
        CHECK(std::memcmp(kept[0].data(), kept[1].data(), kept[0].size() * sizeof(gpom_beam_t)) ==
              0);
    }
}

// A hit that clear_scans scans of different times in a row see through is gone after the last of
// them and not before; any number of scans of one stamp count once.
TEST_CASE("a hit is cleared by clear_scans scans of different times")
{
    for (const std::uint32_t clear_scans : {2u, 3u, 4u}) {
        for (const int repeats : {1, 3}) {
            for (const int i_start : {0, 1, 2, 3, 7, 100}) { // whatever mark the time has
                Keeping k(keep_config(clear_scans));
                for (int i = 0; i < i_start; ++i) {
                    k.see(look({500, 0}, 0.0, 5.0, i));
                }
                REQUIRE(gpom_map_clear(k.map.get()) == GPOM_OK);
                REQUIRE(k.see(look({0, 0}, 0.0, 5.0, i_start)).beams_hit == 1);
                std::uint32_t n_times = 0;
                while (k.stands(0) && n_times < 10) {
                    ++n_times;
                    for (int j = 0; j < repeats; ++j) {
                        k.see(look({0, 0}, 0.0, 12.0, i_start + static_cast<int>(n_times)));
                    }
                }
                CHECK(n_times == clear_scans);
                CHECK(k.map.stats().hits_cleared == 1);
                CHECK(k.ask({12, 0}).n_hits >= 2); // what was seen behind it is in; it is past
            }
        }
    }
}

// clear_scans = 0: nothing is ever cleared.
TEST_CASE("without clear_scans hits stay for ever")
{
    Keeping k(keep_config(0));
    k.see(look({0, 0}, 0.0, 5.0, 0));
    CHECK(n_times_until_cleared(k, 1, 50) == 0);
    CHECK(k.map.stats().beams_contradicting == 0);
}

// A confirmation in between starts the row anew.
TEST_CASE("a confirmation resets the row of those who see through")
{
    for (const int clear_scans : {2, 3, 4}) {
        Keeping k(keep_config(static_cast<std::uint32_t>(clear_scans)));
        k.see(look({0, 0}, 0.0, 5.0, 0));
        int i_time = 1;
        for (int round = 0; round < 6; ++round) {
            CHECK(n_times_until_cleared(k, i_time, clear_scans - 1) == 0);
            i_time += clear_scans - 1;
            CHECK(k.see(look({1, 1}, std::atan2(-1, 4), std::hypot(4, 1), i_time++)).beams_known ==
                  1);
        }
        CHECK(k.map.stats().hits_cleared == 0);
        CHECK(n_times_until_cleared(k, i_time, 10) == clear_scans);
    }
}

// Agreement of many scans outweighs a few that see through, but not five in a row.
TEST_CASE("five in a row outweigh any number that saw the hit before")
{
    Keeping k(keep_config(2));
    for (int i = 0; i < 40; ++i) {
        k.see(look({0, 0}, 0.0, 5.0, i));
    }
    CHECK(k.beam(0).n_agreed == 15);
    CHECK(n_times_until_cleared(k, 40, 10) == 5);
}

// A scan counts as one agreement however many of its beams see the hit, and so does a time.
TEST_CASE("agreements count times, not beams")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 5.0, 0));
    TestScan s = look({0, 0}, -0.02, 5.0, 1);
    s.ranges_m.assign(40, 5.0f);
    s.angle_step_rad = 0.001;
    k.see(s);
    k.see(s);
    CHECK(k.beam(0).n_agreed == 1);
}

// Beams that graze a wall run along it before they end there; seen at 3.5 degrees and more, for any
// keep_m, they contradict none of its hits.
TEST_CASE("beams grazing a wall do not clear it")
{
    for (const float keep_m : {0.2f, 0.5f, 1.0f}) {
        gpom_config_t config = keep_config(2, 4000);
        config.keep_m = keep_m;
        Keeping k(config);
        for (int i = 0; i < 60; ++i) { // along the wall y = 0, at changing distance from it
            const Xy at = {0.37 * i, 0.3 + 0.05 * (i % 20)};
            TestScan s = look(at, 0.0, 1.0, i);
            s.angle_min_rad = -kPi + 0.0611;
            s.angle_step_rad = 0.02;
            s.ranges_m.clear();
            for (double angle = 0.0611; angle < kPi - 0.0611; angle += 0.02) {
                s.ranges_m.push_back(static_cast<float>(at.y / std::sin(angle)));
            }
            k.see(s);
        }
        CHECK(k.map.stats().hits_cleared == 0);
        CHECK(k.map.stats().beams_contradicting == 0);
        CHECK(k.map.stats().beams_known > 4000);
    }
}

// A beam whose end has a standard deviation over 2 keep_m, by its range or by its pose, speaks
// against nobody; one below it does.
TEST_CASE("an unsure beam clears nothing")
{
    for (const double sd_m : {1.9 * kKeep_m, 2.1 * kKeep_m}) {
        for (const bool is_of_pose : {false, true}) {
            const auto var_m2 = static_cast<float>(sd_m * sd_m);
            const float cov[9] = {var_m2, 0.0f, 0.0f, 0.0f, var_m2, 0.0f, 0.0f, 0.0f, 0.0f};
            const bool is_unsure = sd_m > 2.0 * kKeep_m;
            Keeping k(keep_config(2));
            k.see(look({0, 0}, 0.0, 5.0, 0));
            for (int i = 1; i < 20; ++i) {
                TestScan s = look({0, 0}, 0.0, 12.0, i);
                s.sensor.range_var_m2 = is_of_pose ? 0.0f : var_m2;
                s.pose.cov = is_of_pose ? cov : nullptr;
                k.see(s);
            }
            CHECK(k.stands(0) == is_unsure);
            CHECK((k.map.stats().beams_contradicting == 0) == is_unsure);
        }
    }
}

// A return in known free space is provisional: queries do not see its hit. The next scan that sees
// through it removes it; one of another time that sees it again makes it visible; one of the same
// time does not.
TEST_CASE("a return in known free space waits for a second time")
{
    const auto spurious = look({0, 0}, 0.0, 8.0, 1);
    Keeping seen_through(keep_config(2)), confirmed(keep_config(2));
    for (Keeping *k : {&seen_through, &confirmed}) {
        REQUIRE(k->see(look({0, 0}, 0.0, 20.0, 0)).beams_hit == 1);
        REQUIRE(k->see(spurious).beams_hit == 1);
        CHECK(k->beam(1).provisional == 1);
        CHECK(k->ask({8, 0}).n_hits == 1); // the far one alone
        check_answers(*k, keep_config(2).params, 134);
        CHECK(k->see(spurious).beams_known == 1);
        CHECK(k->see(look({0, 1}, std::atan2(-1, 8), std::hypot(8, 1), 1)).beams_known == 1);
        CHECK(k->beam(1).provisional == 1); // all of one time
    }
    const gpom_stats_t through = seen_through.see(look({0, 0}, 0.0, 20.0, 2));
    CHECK(through.beams_not_confirmed == 1);
    CHECK(through.beams_known == 1);
    CHECK(gpom_map_beam_count(seen_through.map.get()) == 1);
    CHECK(seen_through.map.stats().hits_cleared == 0);
    const gpom_stats_t again = confirmed.see(look({0, 0}, 0.0, 8.0, 2));
    CHECK(again.beams_known == 1);
    CHECK(confirmed.beam(1).provisional == 0);
    CHECK(confirmed.ask({8, 0}).n_hits == 2);
    check_answers(confirmed, keep_config(2).params, 134);
}

// A free segment is given up once a lone return on it is confirmed by a scan of another time, and
// not before; then a new return there is no longer provisional.
TEST_CASE("a free segment yields to a confirmed return")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 20.0, 0));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 1));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 1)); // of the same time
    CHECK(k.beam(0).is_free == 1);
    CHECK(k.n_provisional() == 1);
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 2));
    CHECK(k.beam(0).is_free == 0);
    CHECK(k.beam(0).is_hit == 1);
    CHECK(k.map.stats().free_cleared == 1);
    CHECK(k.see(look({10.0, 2.0}, -kPi / 2, 2.0, 3)).beams_hit == 1);
    CHECK(k.n_provisional() == 0);
}

// Many provisional hits that the tree knows are all confirmed by one scan: to look for the free
// segments they lie on does not disturb the walk that finds them.
TEST_CASE("a whole wall in known free space is confirmed at once")
{
    for (const bool builds : {false, true}) {
        Keeping k(keep_config(2, 4096));
        k.see(look_around({0, 0}, 64, kInf, 0)); // 3 m apart at 30 m
        REQUIRE(k.map.stats().beams_no_return == 64);
        k.see(look_around({0, 0}, 64, 6.0f, 1));
        REQUIRE(k.n_provisional() == 64);
        if (builds) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        CHECK(k.see(look_around({0, 0}, 64, 6.0f, 2)).beams_known == 64);
        CHECK(k.n_provisional() == 0);
        CHECK(k.map.stats().beams_not_confirmed == 0);
    }
}

// A provisional beam stays until it is seen through or too many younger ones wait, also when the
// slots of those that went before it are used again.
TEST_CASE("every provisional beam gets its chance")
{
    Keeping k(keep_config(2, 64)); // 12 may wait
    k.see(look_around({0, 0}, 24, kInf, 0));
    for (int i = 0; i < 40; ++i) {
        const double yaw_rad = 0.1 + 2.0 * kPi * (i % 24) / 24; // along one of the free segments
        k.see(look({0, 0}, yaw_rad, 8.0, 2 * i + 1));
        REQUIRE(k.n_provisional() == 1);
        k.see(look({0, 0}, yaw_rad, 31.0, 2 * i + 2));
        REQUIRE(k.n_provisional() == 0);
        REQUIRE(k.map.stats().beams_not_confirmed == static_cast<std::uint64_t>(i) + 1);
    }
}

// More provisional beams than may wait: the oldest go, and the map's memory stays what it is; also
// after everything was forgotten while they waited.
TEST_CASE("the oldest provisional beams go when too many wait")
{
    Keeping k(keep_config(2, 64)); // 12 may wait
    for (int life = 0; life < 4; ++life) {
        const std::uint64_t n_before = k.map.stats().beams_not_confirmed;
        k.see(look_around({0, 0}, 24, kInf, 10 * life));
        k.see(look_around({0, 0}, 24, 6.0f, 10 * life + 1));
        CHECK(k.n_provisional() == 12);
        CHECK(k.map.stats().beams_not_confirmed == n_before + 12);
        CHECK(k.map.beams().size() == 36);
        REQUIRE(gpom_map_clear(k.map.get()) == GPOM_OK);
        CHECK(k.map.beams().empty());
        if (life % 2 == 1) { // other slots than before
            k.see(look({0, 0}, 0.0, 5.0, 10 * life + 2));
        }
        REQUIRE(gpom_map_clear(k.map.get()) == GPOM_OK);
    }
}
