// What new beams say of kept hits (live.h), against each beam and each hit compared in double.
#include "tests/common/keeping.hpp"

#include <set>

using namespace reference;

namespace
{

/// Beams of one scan that are judged together.
constexpr std::size_t kGroup = 16;

/// What a beam is to a hit by the rules of live.h.
struct Testimony {
    bool ends, passes;
    bool is_beside; ///< Runs by within keep_m, as far as its margin allows.
    double left_m;  ///< How far the hit is to the left of the beam.
    bool is_close;  ///< To a bound: rounding may decide.
};

Testimony testimony_of(const TestScan &s, std::size_t i_beam, const gpom_beam_t &hit)
{
    const double yaw_rad =
        s.pose.yaw_rad + s.angle_min_rad + static_cast<double>(i_beam) * s.angle_step_rad;
    const double hit_range_m = static_cast<double>(hit.range_m);
    const double x = hit.x_m + hit_range_m * static_cast<double>(hit.dir_x) - s.pose.x_m;
    const double y = hit.y_m + hit_range_m * static_cast<double>(hit.dir_y) - s.pose.y_m;
    const double along = x * std::cos(yaw_rad) + y * std::sin(yaw_rad);
    const double left = y * std::cos(yaw_rad) - x * std::sin(yaw_rad);
    const double to_go = static_cast<double>(s.ranges_m[i_beam]) - along;
    const double keep = static_cast<double>(kKeep_m);
    const double beside = std::min(keep, 0.05 * to_go);
    const double width = std::min(0.15 * keep, beside);
    const double bounds[] = {std::hypot(left, to_go) - keep,
                             std::abs(left) - width,
                             std::abs(left) - beside,
                             left,
                             along,
                             to_go - keep};
    const bool goes_on = along > 0.0 && to_go > keep;
    return {std::hypot(left, to_go) < keep, goes_on && std::abs(left) < width,
            goes_on && std::abs(left) < beside, left,
            std::any_of(std::begin(bounds), std::end(bounds),
                        [](double b) { return std::abs(b) < 1e-4; })};
}

/// Whether two neighbouring beams have the hit between them, keep_m apart or less.
bool is_pair(const Testimony &a, const Testimony &b)
{
    return a.is_beside && b.is_beside && a.left_m * b.left_m < 0.0 &&
           std::abs(a.left_m - b.left_m) <= static_cast<double>(kKeep_m);
}

bool is_close_pair(const Testimony &a, const Testimony &b)
{
    return std::abs(std::abs(a.left_m - b.left_m) - static_cast<double>(kKeep_m)) < 1e-4;
}

/// What the beams of a scan say, group by group.
struct Verdict {
    std::set<std::uint32_t> confirmed;    ///< Ids of hits that a beam ends at.
    std::set<std::uint32_t> seen_through; ///< Ids of hits of which a group says that they are gone.
    std::set<std::size_t>
        contradicting;         ///< Beams that pass a hit that none of their group ends at.
    std::size_t n_between = 0; ///< Hits that only pairs saw through.
    bool is_close = false;
};

/// Add what one group says of one hit.
void add_group(Verdict &verdict, const TestScan &s, std::size_t first, const gpom_beam_t &hit)
{
    std::set<std::size_t> passing;
    bool is_confirmed = false, is_between = false;
    Testimony before = {};
    for (std::size_t i = first; i < std::min(first + kGroup, s.ranges_m.size()); ++i) {
        const Testimony beam = testimony_of(s, i, hit);
        verdict.is_close = verdict.is_close || beam.is_close;
        is_confirmed = is_confirmed || beam.ends;
        if (beam.passes) {
            passing.insert(i);
        }
        if (i > first) {
            verdict.is_close = verdict.is_close || is_close_pair(before, beam);
            is_between = is_between || is_pair(before, beam);
        }
        before = beam;
    }
    if (is_confirmed) {
        verdict.confirmed.insert(hit.id);
        return;
    }
    verdict.contradicting.insert(passing.begin(), passing.end());
    if (!passing.empty() || is_between) {
        verdict.seen_through.insert(hit.id);
        verdict.n_between += passing.empty() ? 1 : 0;
    }
}

Verdict verdict_of(const TestScan &s, const std::vector<gpom_beam_t> &hits)
{
    Verdict verdict;
    for (std::size_t first = 0; first < s.ranges_m.size(); first += kGroup) {
        for (const gpom_beam_t &hit : hits) {
            add_group(verdict, s, first, hit);
        }
    }
    for (const std::uint32_t id : verdict.confirmed) {
        verdict.seen_through.erase(id);
    }
    return verdict;
}

/// Sixty beams all around the origin, of random ranges, two by two so that none is isolated.
TestScan random_surroundings(Random &random)
{
    TestScan s = look_around({0, 0}, 60, 1.0f, 0);
    for (std::size_t i = 0; i < s.ranges_m.size(); i += 2) {
        s.ranges_m[i] = s.ranges_m[i + 1] = random.uniform_f(1.0, 12.0);
    }
    return s;
}

/// Up to forty beams from somewhere near: a sector from a sliver to several turns.
TestScan random_look(Random &random)
{
    TestScan s =
        look({random.uniform(-3, 3), random.uniform(-3, 3)}, random.uniform(-4, 4), 1.0, 1);
    s.ranges_m.resize(static_cast<std::size_t>(1 + random.below(40)));
    for (float &range_m : s.ranges_m) {
        range_m = random.uniform_f(0.1, 15.0);
    }
    s.angle_step_rad = random.uniform(-1, 1) * std::exp(random.uniform(-6, 1));
    return s;
}

/// Beams from the origin at these bearings from the x axis, in steps of one size, and ranges.
TestScan fan(double first_rad, double step_rad, const std::vector<float> &ranges_m, int i_time)
{
    TestScan s = look({0, 0}, first_rad, 1.0, i_time);
    s.ranges_m = ranges_m;
    s.angle_step_rad = step_rad;
    return s;
}

/// Whether a hit 5 m ahead of the origin is gone after ten scans of a kind.
bool clears(double first_rad, double step_rad, const std::vector<float> &ranges_m)
{
    Keeping k(keep_config(3));
    k.see(look({0, 0}, 0.0, 5.0, 0));
    for (int i = 1; i <= 10; ++i) {
        k.see(fan(first_rad, step_rad, ranges_m, i));
    }
    return !k.stands(0);
}

} // namespace

// Whatever sector a scan's beams cover, from a sliver to several turns, and whether the index was
// built: the hits that they end at are confirmed, the beams that pass others are counted, and those
// that they see through are gone when they come a second time, as comparing each beam with each
// hit tells.
TEST_CASE("what a scan says of kept hits is what each of its beams says of each")
{
    GPOM_TELL_SEED();
    Random random(137);
    std::size_t n_sure = 0, n_confirmed = 0, n_contradicting = 0, n_between = 0;
    for (int i = 0; i < 1500; ++i) {
        Keeping k(keep_config(2));
        REQUIRE(k.see(random_surroundings(random)).beams_contradicting == 0);
        if (i % 3 == 0) {
            REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
        }
        const std::vector<gpom_beam_t> hits = k.map.beams();
        TestScan scan = random_look(random);
        const Verdict verdict = verdict_of(scan, hits);
        if (verdict.is_close) {
            continue;
        }
        const gpom_stats_t change = k.see(scan);
        CAPTURE(scan.angle_step_rad);
        CHECK(change.beams_contradicting == verdict.contradicting.size());
        for (const gpom_beam_t &hit : hits) {
            CHECK(k.beam(hit.id).n_agreed == verdict.confirmed.count(hit.id));
        }
        scan.stamp_us = second(2);
        CHECK(k.see(scan).hits_cleared == verdict.seen_through.size());
        for (const std::uint32_t id : verdict.seen_through) {
            CHECK_FALSE(k.stands(id));
        }
        ++n_sure;
        n_confirmed += verdict.confirmed.size();
        n_contradicting += verdict.contradicting.size();
        n_between += verdict.n_between;
    }
    CHECK(n_sure > 200);
    CHECK(n_confirmed > 200);
    CHECK(n_contradicting > 200);
    CHECK(n_between > 50);
}

// Neither of two beams meets the margin of the hit, 0.15 keep_m = 7.5 cm: it is gone if both run by
// on either side of it, as near to each other as keep_m, and go on.
TEST_CASE("two neighbours that have a hit between them see through it")
{
    CHECK(clears(-0.03, 0.06, {12.0f, 12.0f}));
    CHECK(clears(-0.03, 0.08, {12.0f, 12.0f}));
    CHECK_FALSE(clears(-0.06, 0.12, {12.0f, 12.0f}));       // 0.6 m apart
    CHECK_FALSE(clears(0.03, 0.03, {12.0f, 12.0f}));        // both on one side
    CHECK_FALSE(clears(-0.03, 0.06, {12.0f, 5.3f}));        // one ends beside it
    CHECK_FALSE(clears(-0.03, 0.06, {12.0f, 4.0f}));        // or before
    CHECK_FALSE(clears(-0.04, 0.04, {12.0f, 4.5f, 12.0f})); // not neighbours: one ends between them
}

// A return that waits for confirmation is gone at the first beam that passes it; a pair does not
// tell so surely that nothing is there.
TEST_CASE("a pair does not make a return go that waits for confirmation")
{
    Keeping k(keep_config(3));
    k.see(look({0, 0}, 0.0, 12.0, 0));
    k.see(look({0, 0}, 0.0, 5.0, 1));
    REQUIRE(k.n_provisional() == 1);
    k.see(fan(-0.03, 0.06, {12.0f, 12.0f}, 2));
    CHECK(k.n_provisional() == 1);
    k.see(look({0, 0}, 0.0, 12.0, 3));
    CHECK(k.n_provisional() == 0);
}
