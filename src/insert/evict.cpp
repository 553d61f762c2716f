#include "src/insert/evict.hpp"

#include "src/map/near_hits.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// Gaps beyond this many times keep_m count alike.
constexpr float kWorthGap = 16.0f;

/// How many kept beams are compared. The least useful of them makes room.
constexpr uint32_t kCandidates = 2;

float square(float x) { return x * x; }

float distance2(const Point &a, const Point &b)
{
    const float dx_m = a.x_m - b.x_m;
    const float dy_m = a.y_m - b.y_m;
    return dx_m * dx_m + dy_m * dy_m;
}

/// The worth of a beam: the squared gap between its hit and the nearest hit of another beam than
/// `own_id`. The gap counts up to kWorthGap. The search ends at `most2_m2`: a greater worth may
/// come out smaller, but never below `most2_m2`. A beam whose hit does not stand is worth as much
/// as a hit that stands alone if it has a free segment, else nothing.
float worth_of(gpom_map &map, const Beam &beam, uint32_t own_id, float most2_m2)
{
    if (!has_hit(beam) || is_past(beam)) {
        return beam.has_free != 0 ? alone2_of(map) : 0.0f;
    }
    const float within2_m2 = lane::min(most2_m2, square(kWorthGap * spacing_of(map)));
    const NearHits near = near_hits(map, {end_of(beam), within2_m2, 0.0f});
    return near.best[near.best[0].id == static_cast<int32_t>(own_id) ? 1 : 0].d2;
}

/// What lowers the worth of a kept beam: its distance from the robot and its age, if the
/// configuration asks for that, and how many scans in a row saw through its hit.
struct Discount {
    float far, old, against;

    float divisor() const { return 1.0f + far + old + against; }
};

Discount discount_of(const gpom_map &map, const Beam &beam)
{
    const uint32_t against = is_past(beam) ? 0u : beam.hit_against;
    Discount discount = {0.0f, 0.0f, static_cast<float>(against)};
    if (map.config.far_m > 0.0f) {
        const float far2 = distance2(end_of(beam), map.keeper.robot);
        discount.far = far2 / (map.config.far_m * map.config.far_m);
    }
    if (map.config.old_s > 0.0f) {
        const uint32_t now_ms = map.keeper.stamp_ms; // a clock may step back
        const uint32_t age_ms = now_ms > beam.stamp_ms ? now_ms - beam.stamp_ms : 0;
        discount.old = 1e-3f * static_cast<float>(age_ms) / map.config.old_s;
    }
    return discount;
}

/// A kept beam and its usefulness, which is its worth after the discount.
struct Candidate {
    uint32_t slot;
    float worth, usefulness;
};

/// The next beam in turn. A provisional beam is worth nothing. The usefulness is exact if it is
/// less than `most`, because the search for the nearest hit ends there.
Candidate next_candidate(gpom_map &map, float most)
{
    constexpr float kRounding = 1.00001f; // the division below rounds
    const uint32_t slot = map.keeper.hand;
    map.keeper.hand = slot + 1 == map.index.n_slots ? 0 : slot + 1;
    const Beam &beam = map.index.beams[slot];
    if (is_provisional(beam)) {
        return {slot, 0.0f, 0.0f};
    }
    const float divisor = discount_of(map, beam).divisor();
    const float worth = worth_of(map, beam, beam.id, kRounding * most * divisor);
    return {slot, worth, worth / divisor};
}

/// The counter of the greatest cause why a beam was the least useful: its small gap, or one part of
/// its discount.
uint64_t &cause_of(gpom_map &map, const Candidate &evicted)
{
    gpom_stats_t &stats = map.stats;
    const Beam &beam = map.index.beams[evicted.slot];
    if (is_provisional(beam)) {
        return stats.beams_not_confirmed;
    }
    if (is_past(beam) && beam.has_free == 0) {
        return stats.beams_evicted_contradicted;
    }
    const Discount discount = discount_of(map, beam);
    const float divisor = discount.divisor();
    const float most = lane::max(discount.against, lane::max(discount.far, discount.old));
    const float worth_alone = lane::max(evicted.worth, alone2_of(map));
    if (worth_alone * (divisor - most) >= evicted.worth * divisor) {
        return stats.beams_evicted_redundant;
    }
    if (most == discount.far) {
        return stats.beams_evicted_far;
    }
    return most == discount.old ? stats.beams_evicted_old : stats.beams_evicted_contradicted;
}

/// Drop the least useful of kCandidates beams if it is worth less than `worth`.
bool evict_below(gpom_map &map, float worth)
{
    Candidate least = {kNoSlot, worth, worth};
    for (uint32_t i = 0; i < kCandidates; ++i) {
        const Candidate here = next_candidate(map, least.usefulness);
        if (here.usefulness < least.usefulness) {
            least = here;
        }
    }
    if (least.slot == kNoSlot) {
        return false;
    }
    ++cause_of(map, least);
    drop_beam(map, least.slot);
    return true;
}

} // namespace

bool make_room(gpom_map &map, const Beam &beam, float gap2_m2)
{
    if (!is_full(map.index)) {
        return true;
    }
    const bool is_exact = gap2_m2 < alone2_of(map);
    return evict_below(map, is_exact ? gap2_m2 : worth_of(map, beam, kIdEnd, kGapUnknown2_m2));
}

} // namespace gpom
