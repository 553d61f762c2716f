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

/// The square around a place that holds all hits within a distance. Its half side is a little
/// longer, because distances are rounded.
struct Square {
    Point at;
    float half_m;

    Square(const Point &place, float within2_m2)
        : at(place), half_m(1.0001f * lane::sqrt(within2_m2))
    {
    }

    Area area() const { return Area(widened({at.x_m, at.y_m, at.x_m, at.y_m}, half_m)); }

    /// False for a hit that is too far away along an axis. Its occupied part is depth_m long.
    bool may_hold(const Point &hit, float depth_m) const
    {
        const float reach_m = half_m + depth_m;
        return lane::abs(hit.x_m - at.x_m) <= reach_m && lane::abs(hit.y_m - at.y_m) <= reach_m;
    }
};

/// Not inlined: if both callers contained it, the compiler would make the traversal a separate
/// function and keep its state in memory instead of registers.
[[gnu::noinline]] NearHits search_hits(const gpom_map &map, Subtree *stack, const HitSearch &search,
                                       Wanted wanted)
{
    NearHits near = {{{search.within2_m2, kNoId, -1}, {search.within2_m2, kNoId, -1}}};
    NearestK<float> nearest = {near.best, 2, 2};
    const Offset<float> at = {search.at.x_m, search.at.y_m};
    const Index &index = map.index;
    Square square(search.at, search.within2_m2);
    Area area = square.area();
    traverse(
        index, index.hit_part, {stack, index.next_id},
        [&](const Box &box) { return area.touches(box); },
        [&](uint32_t slot) {
            const Beam &beam = index.beams[slot];
            const bool is_wanted = wanted == Wanted::kPast ? was_past(map, beam) : !is_past(beam);
            if (!is_wanted || !square.may_hold(end_of(beam), index.hit_part.depth_m)) {
                return true;
            }
            const float worst2_m2 = nearest.worst();
            offer_beam(nearest, at, index.hit_part, {index.beams, slot, {0, index.next_id}});
            if (nearest.worst() < worst2_m2) {
                square = Square(search.at, nearest.worst());
                area = square.area();
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
