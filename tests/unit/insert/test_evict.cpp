// A full map: which beam makes room for a new one, and what it is counted under.
#include "src/map/map.hpp"
#include "tests/common/keeping.hpp"

using namespace reference;

namespace
{

constexpr double kAlone2 = 4.0 * kKeep_m * kKeep_m;  ///< Worth of a hit that stands alone [m2].
constexpr double kMost2 = 256.0 * kKeep_m * kKeep_m; ///< No beam is worth more [m2].

/// One beam of no depth down to (x, 0).
TestScan look_down(double x_m, int i_time) { return look({x_m, 5.0}, -kPi / 2, 5.0, i_time); }

double distance2(Xy a, Xy b) { return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y); }

Xy place_of(const gpom::Beam &b)
{
    const double range_m = static_cast<double>(b.range_m);
    return {static_cast<double>(b.x_m) + range_m * static_cast<double>(b.dir_x),
            static_cast<double>(b.y_m) + range_m * static_cast<double>(b.dir_y)};
}

/// From a place to a hit and what is occupied behind it.
double distance2(Xy at, const gpom::Beam &b, double depth_m)
{
    const Xy hit = place_of(b);
    const Xy dir = {static_cast<double>(b.dir_x), static_cast<double>(b.dir_y)};
    const double along = (at.x - hit.x) * dir.x + (at.y - hit.y) * dir.y;
    const double foot = std::clamp(along, 0.0, depth_m);
    return distance2(at, Xy{hit.x + foot * dir.x, hit.y + foot * dir.y});
}

/// A map before a scan, and what the rule says of it in double precision, beam by beam.
struct Oracle {
    gpom_config_t config;
    std::vector<gpom::Beam> beams;
    std::uint32_t hand;

    explicit Oracle(gpom_map_t *map)
        : config(map->config), beams(map->index.beams, map->index.beams + map->index.n_slots),
          hand(map->keeper.hand)
    {
    }

    double worth(const gpom::Beam &beam, std::size_t own_slot) const
    {
        if (beam.hit == gpom::kNoHit || beam.hit == gpom::kPast) {
            return beam.has_free != 0 ? kAlone2 : 0.0;
        }
        double least = kMost2;
        for (std::size_t i = 0; i < beams.size(); ++i) {
            if (i != own_slot && beams[i].hit == gpom::kStanding) {
                const double depth_m = static_cast<double>(config.params.depth_m);
                least = std::min(least, distance2(place_of(beam), beams[i], depth_m));
            }
        }
        return least;
    }

    /// What far_m, old_s and the contradicting scans add to the divisor of a beam's worth.
    std::array<double, 3> discounts(const gpom::Beam &beam, const gpom::Keeper &now) const
    {
        const Xy robot = {static_cast<double>(now.robot.x_m), static_cast<double>(now.robot.y_m)};
        const double far_m = static_cast<double>(config.far_m);
        const double age_s = 1e-3 * std::max(0.0, static_cast<double>(now.stamp_ms) -
                                                      static_cast<double>(beam.stamp_ms));
        return {far_m > 0.0 ? distance2(place_of(beam), robot) / (far_m * far_m) : 0.0,
                config.old_s > 0.0f ? age_s / static_cast<double>(config.old_s) : 0.0,
                beam.hit == gpom::kPast ? 0.0 : static_cast<double>(beam.hit_against)};
    }

    double usefulness(std::size_t slot, const gpom::Keeper &now) const
    {
        const gpom::Beam &beam = beams[slot];
        const std::array<double, 3> d = discounts(beam, now);
        return beam.hit == gpom::kProvisional ? 0.0
                                              : worth(beam, slot) / (1.0 + d[0] + d[1] + d[2]);
    }

    /// The counter of what lowers a beam's usefulness by the greatest factor.
    std::size_t cause(std::size_t slot, const gpom::Keeper &now) const
    {
        const std::array<double, 3> d = discounts(beams[slot], now);
        const double divisor = 1.0 + d[0] + d[1] + d[2];
        const std::array<double, 4> factors = {
            std::max(1.0, kAlone2 / worth(beams[slot], slot)), divisor / (divisor - d[0]),
            divisor / (divisor - d[1]), divisor / (divisor - d[2])};
        const auto greatest = std::max_element(factors.begin(), factors.end());
        const bool is_only_past = beams[slot].hit == gpom::kPast && beams[slot].has_free == 0;
        const auto of_gap_and_discounts = static_cast<std::size_t>(greatest - factors.begin());
        return beams[slot].hit == gpom::kProvisional ? 4 : is_only_past ? 3 : of_gap_and_discounts;
    }
};

std::array<std::uint64_t, 5> counts_by_cause(const gpom_stats_t &n)
{
    return {n.beams_evicted_redundant, n.beams_evicted_far, n.beams_evicted_old,
            n.beams_evicted_contradicted, n.beams_not_confirmed};
}

/// Marks that scans would leave behind in time, on a few beams at random.
void disturb(gpom_map_t *map, Random &random)
{
    for (int i = 0; i < 4; ++i) {
        gpom::Beam &beam = map->index.beams[random.below(map->index.n_slots)];
        if (!gpom::has_hit(beam) || beam.has_free == 0) {
            continue;
        }
        const std::uint32_t state = random.below(8);
        beam.hit = state == 0 ? gpom::kProvisional : state == 1 ? gpom::kPast : gpom::kStanding;
        beam.hit_against = beam.hit == gpom::kStanding ? random.below(4) & 3u : 0u;
        if (beam.hit == gpom::kPast && random.below(2) == 0) {
            beam.has_free = 0;
        }
    }
}

TestScan random_look(Random &random, int i_time)
{
    const Xy at = {random.uniform(-12.0, 12.0), random.uniform(-12.0, 12.0)};
    const double range_m = random.below(5) == 0 ? 40.0 : random.uniform(0.5, 6.0);
    return look(at, random.uniform(0.0, 2.0 * kPi), range_m, i_time);
}

bool is_close(double a, double b) { return std::abs(a - b) < 1e-4 * std::max(a, b); }

/// What one scan of a beam did to a full map that the oracle saw before. Returns the counter of the
/// eviction's cause, or 5: none.
std::size_t check_eviction(Keeping &k, const Oracle &before, const gpom_stats_t &change,
                           double worth)
{
    const gpom::Keeper &now = k.map.get()->keeper;
    const std::vector<gpom::Beam> after = Oracle(k.map.get()).beams;
    const std::size_t n = before.beams.size();
    const std::array<std::size_t, 2> turn = {before.hand, (before.hand + 1) % n};
    const std::array<double, 2> use = {before.usefulness(turn[0], now),
                                       before.usefulness(turn[1], now)};
    const std::size_t least = turn[use[1] < use[0] ? 1 : 0];
    CHECK(now.hand == (before.hand + 2) % n);
    if (is_close(use[0], use[1]) || is_close(std::min(use[0], use[1]), worth)) {
        return 5; // rounding decides
    }
    const bool makes_room = std::min(use[0], use[1]) < worth;
    CHECK(change.beams_redundant == (makes_room ? 0 : 1));
    for (std::size_t slot = 0; slot < n; ++slot) {
        CHECK((after[slot].id != before.beams[slot].id) == (makes_room && slot == least));
    }
    const std::array<std::uint64_t, 5> counts = counts_by_cause(change);
    const std::size_t cause = makes_room ? before.cause(least, now) : 5;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        CHECK(counts[i] == (i == cause ? 1 : 0));
    }
    return cause;
}

} // namespace

// Of the next two beams in turn the one worth less in double precision, by brute force over all
// hits, makes room if it is worth less than the new one, and is counted under what lowers its worth
// by the greatest factor, whatever the trees know.
TEST_CASE("the less useful of two beams makes room and is counted by cause")
{
    GPOM_TELL_SEED();
    for (const float depth_m : {0.0f, 0.3f}) {
        gpom_config_t config = keep_config(0, 90);
        config.params.depth_m = depth_m;
        config.far_m = 12.0f;
        config.old_s = 100.0f;
        Keeping k(config);
        Random random(160);
        std::array<int, 6> n_by_cause = {};
        for (int i = 0; i < 3000; ++i) {
            const bool was_full = gpom::is_full(k.map.get()->index);
            if (was_full) {
                disturb(k.map.get(), random);
            }
            const Oracle before(k.map.get());
            const gpom_stats_t change = k.see(random_look(random, i));
            if (was_full && change.beams_known == 0) {
                const gpom::Group &group = k.map.get()->keeper.group;
                ++n_by_cause[check_eviction(k, before, change,
                                            before.worth(group.beams[0], SIZE_MAX))];
            }
            if (i % 50 == 0) {
                REQUIRE(gpom_map_build(k.map.get()) == GPOM_OK);
            }
        }
        for (const int n : n_by_cause) {
            CHECK(n > 10);
        }
    }
}

// A full map gives up what is near to another hit, be it only nearer than others are, what is far
// from the robot, or old; the last two if that is asked for. A clock that steps back makes nobody
// old.
TEST_CASE("redundant, far and old beams go first")
{
    for (const double gap_m : {0.8, 3.0}) {
        Keeping k(keep_config(0, 2));
        k.see(look_down(0.0, 0));
        k.see(look_down(gap_m, 0));
        CHECK(k.see(look_down(10.0, 1)).beams_evicted_redundant == 1);
    }
    for (const bool is_old : {false, true}) {
        gpom_config_t config = keep_config(0, 2);
        config.far_m = is_old ? 0.0f : 5.0f;
        config.old_s = is_old ? 20.0f : 0.0f;
        Keeping k(config);
        k.see(look_down(0.0, 0)); // the older one is the nearer one
        k.see(look_down(20.0, 10));
        const gpom_stats_t change = k.see(look_down(-15.0, 30));
        CHECK(change.beams_evicted_old == (is_old ? 1 : 0));
        CHECK(change.beams_evicted_far == (is_old ? 0 : 1));
        CHECK(k.stands(0) == !is_old);
        CHECK(k.stands(1) == is_old);
    }
    gpom_config_t config = keep_config(0, 2);
    config.old_s = 20.0f;
    Keeping k(config);
    k.see(look_down(0.0, 0));
    k.see(look_down(20.0, 100));
    CHECK(k.see(look_down(-15.0, 50)).beams_evicted_old == 1);
    CHECK(k.stands(1));
}

// A hit that one scan saw through, and that stands, goes before one that nobody saw through.
TEST_CASE("a contradicted hit goes first")
{
    for (const bool is_contradicted : {false, true}) {
        Keeping k(keep_config(3, 2));
        k.see(look_down(0.0, 0));
        k.see(look_down(20.0, 1));
        if (is_contradicted) {
            CHECK(k.see(look({20.0, 5.0}, -kPi / 2, 9.0, 2)).beams_contradicting == 1);
        }
        const gpom_stats_t change = k.see(look_down(-7.0, 3)); // worth 49 m2; the others 64
        CHECK(change.beams_evicted_contradicted == (is_contradicted ? 1 : 0));
        CHECK(gpom_stats_evicted(&change) == (is_contradicted ? 1 : 0));
        CHECK(k.stands(0));
        CHECK(k.stands(1) == !is_contradicted);
    }
}

// A beam that waits for confirmation is worth nothing, and counted as not confirmed when it goes.
TEST_CASE("a beam that waits makes room for any other")
{
    Keeping k(keep_config(2, 2));
    k.see(look({0.0, 5.0}, -kPi / 2, 9.0, 0));
    k.see(look_down(0.0, 1));
    REQUIRE(k.n_provisional() == 1);
    const gpom_stats_t change = k.see(look_down(0.8, 2));
    CHECK(change.beams_not_confirmed == 1);
    CHECK(gpom_stats_evicted(&change) == 0);
    CHECK(change.beams_hit == 1);
    CHECK(k.n_provisional() == 0);
}

// The sum has every cause in it once.
TEST_CASE("evicted beams are summed over their causes")
{
    gpom_stats_t n = {};
    n.beams_evicted_redundant = 1;
    n.beams_evicted_far = 20;
    n.beams_evicted_old = 300;
    n.beams_evicted_contradicted = 4000;
    n.beams_not_confirmed = 50000;
    CHECK(gpom_stats_evicted(&n) == 4321);
    CHECK(gpom_stats_evicted(nullptr) == 0);
}
