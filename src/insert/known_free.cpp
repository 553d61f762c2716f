#include "src/insert/known_free.hpp"

#include "src/map/map.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// True if the free segment of a kept beam passes a place within a margin. Most segments are too
/// far to the side, so that this is compared first.
inline bool is_on_free(const gpom_map &map, const Beam &beam, const Point &at, const Margin &margin)
{
    const float keep_m = map.config.keep_m;
    const float from_x = at.x_m - beam.x_m;
    const float from_y = at.y_m - beam.y_m;
    const float across = lane::abs(from_x * beam.dir_y - from_y * beam.dir_x);
    if (!(across < margin.width * keep_m)) {
        return false;
    }
    const float along = from_x * beam.dir_x + from_y * beam.dir_y;
    const float to_go = beam.range_m - along;
    const bool is_beside = along > 0.0f && along < map.index.free_part(beam).length_m;
    return is_beside && to_go > keep_m && across < margin.slope * to_go;
}

/// True if the free segment of a kept beam crosses another segment, `part`. From there on the beam
/// must still go farther than keep_m and than the length of `part`.
bool is_across(const gpom_map &map, const Beam &beam, const Segment &part)
{
    const float from_x = part.x_m - beam.x_m;
    const float from_y = part.y_m - beam.y_m;
    const float near_side = from_x * beam.dir_y - from_y * beam.dir_x;
    const float across_per_m = part.dir_x * beam.dir_y - part.dir_y * beam.dir_x;
    const float far_side = near_side + part.length_m * across_per_m;
    if ((near_side < 0.0f) == (far_side < 0.0f)) {
        return false;
    }
    const float share = near_side / (near_side - far_side);
    const float in_m = share * part.length_m;
    const float along =
        (from_x + in_m * part.dir_x) * beam.dir_x + (from_y + in_m * part.dir_y) * beam.dir_y;
    const float to_go = beam.range_m - along;
    const bool is_on = along > 0.0f && along < map.index.free_part(beam).length_m;
    return is_on && to_go > lane::max(map.config.keep_m, part.length_m);
}

/// Call visit(slot) for kept beams of earlier scans with free segments whose boxes are within
/// reach_m of the box around a segment. Stops when visit() returns false, and then returns false.
/// May be called inside a traversal of hits.
template <class Visit>
bool for_each_free_near(gpom_map &map, const Segment &part, float reach_m, const Visit &visit)
{
    Box box_of_part = empty_box();
    include(box_of_part, part);
    const Area around(widened(box_of_part, reach_m));
    return traverse(
        map.index, map.index.free_part, {map.keeper.inner_stack, map.keeper.scan_first_id},
        [&](const Box &box) { return around.touches(box); }, visit);
}

} // namespace

bool is_known_free(gpom_map &map, const Point &at, const Margin &margin)
{
    const float reach_m = margin.width * map.config.keep_m;
    return !for_each_free_near(
        map, {at.x_m, at.y_m, 1.0f, 0.0f, 0.0f}, reach_m,
        [&](uint32_t slot) { return !is_on_free(map, map.index.beams[slot], at, margin); });
}

void clear_free(gpom_map &map, const Beam &hit)
{
    const Segment part = map.index.hit_part(hit);
    const Point at = end_of(hit);
    const float reach_m = kClear.width * map.config.keep_m;
    for_each_free_near(map, part, reach_m, [&](uint32_t slot) {
        const Beam &beam = map.index.beams[slot];
        if (is_on_free(map, beam, at, kClear) || is_across(map, beam, part)) {
            drop_free(map, slot);
            ++map.stats.free_cleared;
        }
        return true;
    });
}

} // namespace gpom
