#include "src/map/near_hits.hpp"

#include "src/map/map.hpp"

namespace gpom
{

namespace
{

/// True if a hit became past before the time of the scan that is inserted.
bool was_past(const gpom_map &map, const Beam &beam)
{
    return is_past(beam) && !became_past_at(beam, map.keeper.time_number);
}

/// Which hits count: hits that became past before this scan's time, or hits that are not past.
enum class Wanted : uint8_t { kPast, kNotPast };

/// Not inlined: if both callers contained it, the compiler would make the traversal a separate
/// function and keep its state in memory instead of registers.
[[gnu::noinline]] NearHits search_hits(const gpom_map &map, Subtree *stack, const HitSearch &search,
                                       Wanted wanted)
{
    NearHits near = {{{search.within2_m2, kNoId, -1}, {search.within2_m2, kNoId, -1}}};
    NearestK<float> nearest = {near.best, 2, 2};
    const Offset<float> at = {search.at.x_m, search.at.y_m};
    const Index &index = map.index;
    traverse(
        index, index.hit_part, stack,
        [&](const Box &box) {
            return box_distance2(box, at.x_m, at.y_m) <= box_reach2(nearest.worst());
        },
        [&](uint32_t slot) {
            const Beam &beam = index.beams[slot];
            if (wanted == Wanted::kPast ? was_past(map, beam) : !is_past(beam)) {
                offer_beam(nearest, at, index.hit_part, {index.beams, slot, {0, index.next_id}});
            }
            return !(near.best[0].d2 < search.enough2_m2);
        });
    return near;
}

} // namespace

NearHits near_hits(gpom_map &map, const HitSearch &search)
{
    return search_hits(map, map.keeper.hit_stack, search, Wanted::kNotPast);
}

bool is_near_past(gpom_map &map, const Point &at)
{
    const float keep2_m2 = map.config.keep_m * map.config.keep_m;
    const NearHits near =
        search_hits(map, map.keeper.inner_stack, {at, keep2_m2, keep2_m2}, Wanted::kPast);
    return near.best[0].d2 < keep2_m2;
}

} // namespace gpom
