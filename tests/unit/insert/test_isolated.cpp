// Returns that the scan they are of contradicts itself: the beams beside them look past them.
#include "tests/common/keeping.hpp"

#include <map>

using namespace reference;

namespace
{

/// Beams from the origin, 0.06 rad from one to the next, the third one straight ahead.
TestScan ahead(const std::vector<float> &ranges_m, int i_time)
{
    TestScan s = look({0, 0}, 0.0, 1.0, i_time);
    s.ranges_m = ranges_m;
    s.angle_min_rad = -0.12;
    s.angle_step_rad = 0.06;
    return s;
}

const std::vector<float> kIsolated = {12.0f, 12.0f, 5.0f, 12.0f, 12.0f};

/// How many returns of a scan wait for confirmation in an empty map.
std::size_t n_waiting(const TestScan &scan, gpom_config_t config = keep_config(3))
{
    Keeping k(config);
    k.see(scan);
    return k.n_provisional();
}

/// What a scan of its own says of one of its readings, by distances in the plane.
struct Verdict {
    bool isolated;
    bool is_close; ///< To being told otherwise.
};

Verdict verdict_of(const TestScan &s, const std::vector<std::size_t> &used, std::size_t k)
{
    if (k == 0 || k + 1 == used.size()) {
        return {false, false};
    }
    const auto range_m = [&](std::size_t i) {
        const double raw = static_cast<double>(s.ranges_m[used[i]]);
        return std::min(raw, static_cast<double>(s.sensor.range_max_m));
    };
    const auto turned = [&](std::size_t i) {
        const double steps = static_cast<double>(used[i]) - static_cast<double>(used[k]);
        return steps * s.angle_step_rad;
    };
    const double keep_m = static_cast<double>(kKeep_m);
    Verdict verdict = {true, false};
    for (const std::size_t i : {k - 1, k + 1}) {
        const double beside_m = 2.0 * range_m(k) * std::abs(std::sin(0.5 * turned(i)));
        const double beyond_m = range_m(i) - range_m(k);
        verdict.isolated = verdict.isolated && beside_m < keep_m && beyond_m > 2.0 * keep_m;
        verdict.is_close = verdict.is_close || std::abs(beside_m - keep_m) < 1e-4 ||
                           std::abs(beyond_m - 2.0 * keep_m) < 1e-4;
    }
    return verdict;
}

/// A scan of random ranges and step, some readings missing or too near.
TestScan random_scan(Random &random)
{
    TestScan s = look({0, 0}, random.uniform(-4, 4), 1.0, 0);
    s.sensor.range_min_m = 0.3f;
    s.ranges_m.resize(1 + random.below(60));
    for (float &range_m : s.ranges_m) {
        const std::uint64_t kind = random.below(10);
        range_m = kind == 0   ? std::numeric_limits<float>::quiet_NaN()
                  : kind == 1 ? kInf
                  : kind == 2 ? 0.1f
                              : random.uniform_f(0.4, 15.0);
    }
    s.angle_step_rad = random.uniform(-1, 1) * std::exp(random.uniform(-5, 1.2));
    return s;
}

} // namespace

// Of a scan into an empty map those returns wait, and no others, that its own readings tell are
// isolated, wherever in the scan they are: the beams before and after, readings that cannot be used
// left out, are keep_m beside its end or nearer and reach 2 keep_m beyond.
TEST_CASE("a return waits for confirmation if the beams beside it look past it")
{
    GPOM_TELL_SEED();
    Random random(221);
    std::size_t n_isolated = 0, n_others = 0;
    for (int i = 0; i < 1000; ++i) {
        const TestScan scan = random_scan(random);
        Keeping k(keep_config(2));
        k.see(scan);
        std::vector<std::size_t> used;
        for (std::size_t j = 0; j < scan.ranges_m.size(); ++j) {
            if (scan.ranges_m[j] >= scan.sensor.range_min_m) { // NaN fails
                used.push_back(j);
            }
        }
        std::map<float, Verdict> verdicts; // by range; of two that are equal neither judges
        for (std::size_t j = 0; j < used.size(); ++j) {
            const auto entry = verdicts.emplace(scan.ranges_m[used[j]], verdict_of(scan, used, j));
            entry.first->second.is_close = entry.first->second.is_close || !entry.second;
        }
        for (const gpom_beam_t &beam : k.map.beams()) {
            if (beam.is_hit == 0 || verdicts.at(beam.range_m).is_close) {
                continue;
            }
            const bool isolated = verdicts.at(beam.range_m).isolated;
            CAPTURE(scan.angle_step_rad);
            CHECK((beam.provisional == 1) == isolated);
            ++(isolated ? n_isolated : n_others);
        }
    }
    CHECK(n_isolated > 500);
    CHECK(n_others > 5000);
}

TEST_CASE("an isolated return is not seen until another time confirms it")
{
    Keeping k(keep_config(3));
    k.see(ahead(kIsolated, 0));
    CHECK(k.n_provisional() == 1);
    CHECK(k.ask({5, 0}).n_hits == 4);
    check_answers(k, keep_config(3).params, 222);
    k.see(ahead(kIsolated, 0));
    CHECK(k.n_provisional() == 1); // the same time tells nothing
    k.see(ahead(kIsolated, 1));
    CHECK(k.n_provisional() == 0);
    CHECK(k.ask({5, 0}).n_hits == 5);
    check_answers(k, keep_config(3).params, 223);
}

TEST_CASE("an isolated return that nobody confirms goes at the first beam that passes it")
{
    Keeping k(keep_config(3));
    k.see(ahead(kIsolated, 0));
    const gpom_stats_t change = k.see(look({0, 0}, 0.0, 12.0, 1));
    CHECK(change.beams_not_confirmed == 1);
    CHECK(change.hits_cleared == 0); // and leaves no past
    CHECK(k.n_provisional() == 0);
}

// What is wider than the beams are apart, or slants away, is no single return.
TEST_CASE("what a neighbour sees as well, or what is too sparse to tell, does not wait")
{
    CHECK(n_waiting(ahead(kIsolated, 0)) == 1);
    CHECK(n_waiting(ahead({12.0f, 5.2f, 5.0f, 12.0f, 12.0f}, 0)) == 0);
    CHECK(n_waiting(ahead({9.0f, 7.0f, 5.0f, 3.5f, 2.4f}, 0)) == 0);
    CHECK(n_waiting(ahead({12.0f, 5.9f, 5.0f, 5.9f, 12.0f}, 0)) == 0);   // not 1 m beyond
    CHECK(n_waiting(ahead({12.0f, 12.0f, 9.0f, 12.0f, 12.0f}, 0)) == 0); // 0.54 m apart there
    CHECK(n_waiting(ahead({5.0f, 12.0f, 12.0f, 12.0f, 5.0f}, 0)) == 0);  // nothing on one side
}

TEST_CASE("isolated returns stand where nothing clears, or where their place is not known")
{
    CHECK(n_waiting(ahead(kIsolated, 0), keep_config(0)) == 0);
    TestScan vague = ahead(kIsolated, 0);
    vague.sensor.range_var_m2 = 1.1f; // over (2 keep_m)^2
    CHECK(n_waiting(vague) == 0);
}

// The last beams of one scan are no neighbours of the first of the next.
TEST_CASE("neighbours are of one scan")
{
    Keeping k(keep_config(3));
    k.see(ahead({12.0f, 12.0f}, 0));
    TestScan next = ahead({5.0f, 12.0f}, 0);
    next.angle_min_rad = 0.0;
    k.see(next);
    CHECK(k.n_provisional() == 0);
}
