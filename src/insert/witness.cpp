#include "src/insert/witness.hpp"

#include "src/insert/known_free.hpp"
#include "src/lane/width.hpp"
#include "src/map/map.hpp"
#include "src/map/store.hpp"

namespace gpom
{

namespace
{

/// A hit that arrived in free space has settled when it has this many counts.
constexpr uint32_t kArrivedCounts = 3;

/// A hit nearer to its own sensor than keep_m times this refuses no beam. It would refuse the beams
/// of a sector of 9 degrees or more. A hit a few millimetres away would refuse half of all beams.
constexpr float kNearSpacings = 2.0f;

/// A hit refuses no beam if this many scans in a row, or more, saw through it.
constexpr uint32_t kDoubtedScans = 3;

/// No hit refuses a beam at times whose marks are below this, which is one time in eight. Without
/// such times, a hit that is confirmed again and again between beams that pass it would refuse
/// beams for ever. From one such time to the next are 5, 8 or 13 times.
constexpr uint32_t kOpenTimeMarks = 4;

/// Lanes of a vector, and vectors of a complete group.
constexpr uint32_t kWidth = static_cast<uint32_t>(kLanes);
constexpr uint32_t kVectors = kGroup / kWidth;

/// Rounding error of the distance from a place to a beam, relative to the beam's length.
constexpr float kRounding = 4e-6f;

/// kLanes new beams of a group. Lanes beyond the last beam of the group repeat the last beam.
struct BeamLanes {
    F x_m, y_m; ///< Starts, relative to the start of the first beam. Only set if the sensor moves.
    F dir_x, dir_y, length_m;
};

/// Places on one side of a line, and a little beyond the line: x_m nx + y_m ny >= least_m, where
/// (nx, ny) is the unit normal.
struct HalfPlane {
    float nx, ny, least_m;

    bool has(const Point &at) const { return nx * at.x_m + ny * at.y_m >= least_m; }

    /// True if it has a corner of a box.
    bool has_part_of(const Box &box) const
    {
        const float x = lane::max(nx * box.x_min_m, nx * box.x_max_m);
        const float y = lane::max(ny * box.y_min_m, ny * box.y_max_m);
        return x + y >= least_m;
    }
};

/// The sector in which all beams of a group run, if it is less than half a turn. It is the common
/// part of two half-planes.
struct Sector {
    HalfPlane left_of_right_edge, right_of_left_edge;
    bool is_wide; ///< True: the beams may span half a turn or more. The half-planes are not used.
};

/// A group whose beams are judged together.
struct Trial {
    gpom_map &map;
    Judgement &judgement;
    Box box;       ///< The box around all beams, wider by keep_m on each side.
    Area area;     ///< The same.
    Point sensor;  ///< Start of the first beam. If the sensor moves, other beams start elsewhere.
    bool moves;    ///< The sensor moves from beam to beam.
    float reach_m; ///< keep_m + greatest distance of a start from `sensor` + rounding error.
    Sector sector;
    const BeamLanes *lanes; ///< All beams, in n_vectors elements.
    uint32_t n_vectors;
};

/// How the beams of a group meet one hit.
struct Witnesses {
    uint32_t ends;    ///< Bit i: beam i ends at the hit.
    uint32_t ends_in; ///< Bit i: beam i ends at the occupied part behind the hit. A beam whose line
                      ///< misses the hit by keep_m or more may lack its bit: keep.cpp then finds
                      ///< the hit near its end.
    uint32_t beside;  ///< Bit i: beam i passes the hit within keep_m.
};

BeamLanes lanes_of(const Group &group, uint32_t i_vector, bool moves)
{
    BeamLanes lanes = {};
    for (uint32_t i = 0; i < kWidth; ++i) {
        const uint32_t i_beam = i_vector * kWidth + i;
        const Beam &beam = group.beams[i_beam < group.n ? i_beam : group.n - 1];
        if (moves) {
            lane::set(lanes.x_m, static_cast<int>(i), beam.x_m - group.beams[0].x_m);
            lane::set(lanes.y_m, static_cast<int>(i), beam.y_m - group.beams[0].y_m);
        }
        lane::set(lanes.dir_x, static_cast<int>(i), beam.dir_x);
        lane::set(lanes.dir_y, static_cast<int>(i), beam.dir_y);
        lane::set(lanes.length_m, static_cast<int>(i), beam.range_m);
    }
    return lanes;
}

/// How far the place `to` is to the left of the ray along the direction `from`. `to` is relative to
/// the start of the ray.
float cross(const Point &from, const Point &to) { return from.x_m * to.y_m - from.y_m * to.x_m; }

/// The places that are to the left of a ray from `start`, or at most reach_m to the right of it.
HalfPlane left_of_ray(const Point &start, const Point &dir, float reach_m)
{
    const float rounding_m = kRounding * (lane::abs(start.x_m) + lane::abs(start.y_m));
    const float at_start_m = dir.x_m * start.y_m - dir.y_m * start.x_m;
    return {-dir.y_m, dir.x_m, at_start_m - reach_m - rounding_m};
}

/// The sector of a group that starts at `sensor`, and reach_m more on either side.
Sector sector_of(const Group &group, const Point &sensor, float reach_m)
{
    const Beam &middle = group.beams[group.n / 2];
    const Point ahead = {middle.dir_x, middle.dir_y};
    Point right = ahead;
    Point left = ahead;
    bool is_wide = false;
    for (uint32_t i = 0; i < group.n; ++i) {
        const Point dir = {group.beams[i].dir_x, group.beams[i].dir_y};
        is_wide = is_wide || !(ahead.x_m * dir.x_m + ahead.y_m * dir.y_m > 0.0f);
        right = cross(right, dir) < 0.0f ? dir : right;
        left = cross(left, dir) > 0.0f ? dir : left;
    }
    const Point back = {-left.x_m, -left.y_m}; // what is to the right of an edge
    return {left_of_ray(sensor, right, reach_m), left_of_ray(sensor, back, reach_m), is_wide};
}

/// True if one of kLanes beams from the sensor comes within reach_m of a box. Compares the
/// projections of the box on the direction of the beam and on the normal of the beam.
bool touches(const BeamLanes &s, const Point &centre, const Point &half, float reach_m)
{
    const F along = centre.x_m * s.dir_x + centre.y_m * s.dir_y;
    const F across = lane::abs(F(centre.x_m * s.dir_y - centre.y_m * s.dir_x));
    const F half_along = half.x_m * lane::abs(s.dir_x) + half.y_m * lane::abs(s.dir_y) + reach_m;
    const F half_across = half.x_m * lane::abs(s.dir_y) + half.y_m * lane::abs(s.dir_x) + reach_m;
    return lane::any((across <= half_across) & (along >= -half_along) &
                     (along <= s.length_m + half_along));
}

/// True if a box may contain hits that a beam of the group ends at or passes. The test with the
/// group's sector is cheap and almost as good as a test of every beam. Every beam is tested only if
/// the sector is too wide.
bool may_matter(const Trial &trial, const Box &box)
{
    if (!trial.area.touches(box)) {
        return false;
    }
    const Sector &sector = trial.sector;
    if (!sector.is_wide) {
        return sector.left_of_right_edge.has_part_of(box) &
               sector.right_of_left_edge.has_part_of(box);
    }
    const Point centre = {0.5f * (box.x_min_m + box.x_max_m) - trial.sensor.x_m,
                          0.5f * (box.y_min_m + box.y_max_m) - trial.sensor.y_m};
    const Point half = {0.5f * (box.x_max_m - box.x_min_m), 0.5f * (box.y_max_m - box.y_min_m)};
    for (uint32_t v = 0; v < trial.n_vectors; ++v) {
        if (touches(trial.lanes[v], centre, half, trial.reach_m)) {
            return true;
        }
    }
    return false;
}

/// The same for one hit.
bool may_matter(const Trial &trial, const Point &at)
{
    const Sector &sector = trial.sector;
    return is_inside(trial.box, at) && (sector.is_wide || (sector.left_of_right_edge.has(at) &
                                                           sector.right_of_left_edge.has(at)));
}

/// kLanes beams, and the occupied part of a hit relative to the start of each beam.
struct Meeting {
    const BeamLanes &beams;
    F x_m, y_m;
    Point dir;
    float length_m;
};

/// Squared distances from the ends of the beams to the occupied part.
F distance2_of_ends(const Meeting &hit)
{
    const BeamLanes &s = hit.beams;
    const F x = s.length_m * s.dir_x - hit.x_m;
    const F y = s.length_m * s.dir_y - hit.y_m;
    const F along = x * hit.dir.x_m + y * hit.dir.y_m;
    const F foot = lane::clamp(along, lane::splat<F>(0.0f), lane::splat<F>(hit.length_m));
    const F dx = x - foot * hit.dir.x_m;
    const F dy = y - foot * hit.dir.y_m;
    return dx * dx + dy * dy;
}

/// Compare a hit with kLanes beams. `ends` and `ends_in` are valid for beams that returned, and
/// `beside` for beams that are sure. The caller clears the bits of all other beams.
Witnesses witnesses_of(const Meeting &hit, float keep_m)
{
    const BeamLanes &s = hit.beams;
    const F across = lane::abs(F(hit.x_m * s.dir_y - hit.y_m * s.dir_x));
    if (!lane::any(across < keep_m)) {
        return {0, 0, 0};
    }
    const F along = hit.x_m * s.dir_x + hit.y_m * s.dir_y;
    const F to_go = s.length_m - along;
    const F gap2 = across * across + to_go * to_go;
    const F width = lane::min(F(kPass.slope * to_go), lane::splat<F>(keep_m));
    const auto beside = (along > 0.0f) & (to_go > keep_m) & (across < width);
    const F gap_in2 = hit.length_m > 0.0f ? distance2_of_ends(hit) : gap2;
    return {lane::bits_of_mask(gap2 < keep_m * keep_m),
            lane::bits_of_mask(gap_in2 < keep_m * keep_m), lane::bits_of_mask(beside)};
}

/// Compare a hit with all beams of the group.
Witnesses witnesses_of(const Trial &trial, const Beam &beam)
{
    const Group &group = trial.map.keeper.group;
    const Segment hit = trial.map.index.hit_part(beam);
    const F x_m = lane::splat<F>(hit.x_m - trial.sensor.x_m);
    const F y_m = lane::splat<F>(hit.y_m - trial.sensor.y_m);
    const Point dir = {hit.dir_x, hit.dir_y};
    Witnesses all = {0, 0, 0};
    for (uint32_t v = 0; v < trial.n_vectors; ++v) {
        const BeamLanes &s = trial.lanes[v];
        const F from_x = trial.moves ? F(x_m - s.x_m) : x_m;
        const F from_y = trial.moves ? F(y_m - s.y_m) : y_m;
        const Witnesses some =
            witnesses_of({s, from_x, from_y, dir, hit.length_m}, trial.map.config.keep_m);
        all.ends |= some.ends << (v * kWidth);
        all.ends_in |= some.ends_in << (v * kWidth);
        all.beside |= some.beside << (v * kWidth);
    }
    return {all.ends & group.returned, all.ends_in & group.returned, all.beside & group.sure};
}

/// A scan saw the hit again. The hit gets one count more, unless a scan of the same time confirmed
/// it before. Scans that saw through the hit no longer count against it. A provisional hit gets no
/// count, but becomes standing, unless the scan is of the hit's own time. A hit that arrived in
/// free space clears the free segments there when it stops being provisional, and again when it
/// gets count kArrivedCounts.
void confirm(gpom_map &map, Beam &beam)
{
    const uint16_t time = map.keeper.time_mark;
    const bool is_own_time = beam.stamp_ms == map.keeper.stamp_ms && beam.hit_time == time;
    const bool was_provisional = is_provisional(beam);
    if (was_provisional && is_own_time) {
        return;
    }
    const bool is_counted = !was_provisional && beam.agreed < kAgreedMax &&
                            !(beam.hit_against == 0 && beam.hit_time == time);
    set_agreed(map, beam, beam.agreed + (is_counted ? 1u : 0u));
    make_standing(map, beam);
    beam.hit_against = 0;
    beam.hit_time = time & kTimeMarkMask;
    if (beam.arrived != 0 && (was_provisional || (is_counted && beam.agreed == kArrivedCounts))) {
        clear_free(map, beam);
    }
}

/// Note a hit for the beams that end at it. A new beam takes the place of its hit if that hit has
/// no free segment. For a beam that ends at several hits, the oldest hit is noted.
void offer_renewal(const Trial &trial, uint32_t ends, uint32_t slot)
{
    const Beam *const beams = trial.map.index.beams;
    for (uint32_t left = ends; left != 0; left &= left - 1) {
        uint32_t &oldest = trial.judgement.renews[__builtin_ctz(left)];
        if (oldest == kNoSlot || beams[slot].id < beams[oldest].id) {
            oldest = slot;
        }
    }
}

/// A scan saw through a hit. The first scan in a row takes one count from the hit, the next scans
/// take two, four and eight. So five in a row outweigh any number of scans that saw the hit before.
/// The hit becomes past if its counts are used up and at least clear_scans scans were in the row.
/// A provisional hit is dropped at once. A hit that was confirmed or contradicted at this time
/// before stays as it is. True if the hit became past or was dropped.
bool contradict(gpom_map &map, uint32_t slot)
{
    Beam &beam = map.index.beams[slot];
    if (is_provisional(beam)) {
        drop_unconfirmed(map, slot);
        return true;
    }
    if (beam.hit_time == map.keeper.time_mark) {
        return false;
    }
    beam.hit_time = map.keeper.time_mark & kTimeMarkMask;
    const uint32_t in_row = beam.hit_against;
    const uint32_t counts = 1u << in_row;
    if (beam.agreed < counts && in_row + 1u >= map.config.clear_scans) {
        retire_hit(map, slot);
        return true;
    }
    set_agreed(map, beam, beam.agreed > counts ? beam.agreed - counts : 0u);
    beam.hit_against = (in_row < 3 ? in_row + 1u : 3u) & 3u;
    return false;
}

/// How far a hit is to the left of beam i_beam of the group [m].
float left_of(const Trial &trial, uint32_t i_beam, const Point &hit)
{
    const Beam &beam = trial.map.keeper.group.beams[i_beam];
    return cross({beam.dir_x, beam.dir_y}, {hit.x_m - beam.x_m, hit.y_m - beam.y_m});
}

/// Selects, from the beams beside a hit, the beams that pass it nearer than kPass allows.
uint32_t passing(const Trial &trial, uint32_t beside, const Point &hit)
{
    const float width_m = kPass.width * trial.map.config.keep_m;
    uint32_t passes = 0;
    for (uint32_t left = beside; left != 0; left &= left - 1) {
        const uint32_t i = static_cast<uint32_t>(__builtin_ctz(left));
        passes |= lane::abs(left_of(trial, i, hit)) < width_m ? 1u << i : 0u;
    }
    return passes;
}

/// Selects, from the beams beside a hit, two neighbours that pass on either side of it, keep_m
/// apart or less. 0 if there are none.
uint32_t pair_around(const Trial &trial, uint32_t beside, const Point &hit)
{
    for (uint32_t both = beside & (beside >> 1); both != 0; both &= both - 1) {
        const uint32_t i = static_cast<uint32_t>(__builtin_ctz(both));
        const float first_m = left_of(trial, i, hit);
        const float second_m = left_of(trial, i + 1, hit);
        const bool is_on_both_sides = (first_m < 0.0f) != (second_m < 0.0f);
        if (is_on_both_sides && lane::abs(first_m - second_m) <= trial.map.config.keep_m) {
            return 3u << i;
        }
    }
    return 0;
}

/// True if beams that pass a standing hit are refused (live.h).
bool is_refusing(const gpom_map &map, const Beam &beam)
{
    return beam.range_m >= kNearSpacings * map.config.keep_m && beam.hit_against < kDoubtedScans &&
           map.keeper.time_mark >= kOpenTimeMarks;
}

/// Judge a kept hit of an earlier scan by the beams of the group. If beams end at the hit, they
/// confirm it. Else beams that pass it contradict it. If no beam passes it, two neighbours on
/// either side of it contradict it, too. Neighbours do not contradict a provisional hit, because
/// one contradiction is enough to drop it.
void judge_hit(const Trial &trial, uint32_t slot, const Witnesses &witnesses)
{
    gpom_map &map = trial.map;
    Beam &beam = map.index.beams[slot];
    const uint32_t passes = passing(trial, witnesses.beside, end_of(beam));
    if (passes != 0) { // then nothing stands there that hides the space behind
        beam.arrived = 0;
    }
    if (witnesses.ends != 0) {
        confirm(map, beam);
        offer_renewal(trial, witnesses.ends, slot);
        return;
    }
    const bool was_provisional = is_provisional(beam);
    const uint32_t through = passes != 0 || was_provisional
                                 ? passes
                                 : pair_around(trial, witnesses.beside, end_of(beam));
    if (through != 0 && map.config.clear_scans > 0) {
        const bool gone = contradict(map, slot);
        trial.judgement.clears |= gone && !was_provisional ? through : 0u;
        trial.judgement.against |= gone || !is_refusing(map, beam) ? 0u : passes;
    }
}

/// Compare a kept hit with the beams of the group. Beams that end at the hit are known. If the hit
/// stands, beams that end at the occupied part behind it are known, too. A hit of an earlier scan
/// is also judged. Not inlined, because the compiler would otherwise keep the state of the
/// traversal in memory instead of registers.
[[gnu::noinline]] void compare(const Trial &trial, uint32_t slot)
{
    gpom_map &map = trial.map;
    const Beam &beam = map.index.beams[slot];
    const Witnesses witnesses = witnesses_of(trial, beam);
    if (beam.id < map.keeper.scan_first_id) {
        judge_hit(trial, slot, witnesses);
    }
    trial.judgement.known |= witnesses.ends | (beam.hit == kStanding ? witnesses.ends_in : 0u);
}

Box box_around(const Group &group, float reach_m)
{
    Box box = empty_box();
    for (uint32_t i = 0; i < group.n; ++i) {
        const Beam &beam = group.beams[i];
        const Point end = end_of(beam);
        box = {lane::min(box.x_min_m, lane::min(beam.x_m, end.x_m)),
               lane::min(box.y_min_m, lane::min(beam.y_m, end.y_m)),
               lane::max(box.x_max_m, lane::max(beam.x_m, end.x_m)),
               lane::max(box.y_max_m, lane::max(beam.y_m, end.y_m))};
    }
    return widened(box, reach_m);
}

/// Upper bound of the distance from the start of the first beam to the start of any other beam.
float spread_of(const Group &group)
{
    float spread_m = 0.0f;
    for (uint32_t i = 1; i < group.n; ++i) {
        const float x_m = group.beams[i].x_m - group.beams[0].x_m;
        const float y_m = group.beams[i].y_m - group.beams[0].y_m;
        spread_m = lane::max(spread_m, lane::abs(x_m) + lane::abs(y_m));
    }
    return spread_m;
}

/// Prepares the comparison of the keeper's group. Fills `lanes`, which has kVectors elements.
Trial trial_of(gpom_map &map, Judgement &judgement, BeamLanes *lanes)
{
    const Group &group = map.keeper.group;
    const float keep_m = map.config.keep_m;
    const Box box = box_around(group, keep_m);
    const Point sensor = {group.beams[0].x_m, group.beams[0].y_m};
    const float length_m = lane::max(box.x_max_m - box.x_min_m, box.y_max_m - box.y_min_m);
    const uint32_t n_vectors = (group.n + kWidth - 1) / kWidth;
    const bool moves = map.keeper.moves != 0;
    for (uint32_t v = 0; v < n_vectors; ++v) {
        lanes[v] = lanes_of(group, v, moves);
    }
    const float reach_m = keep_m + (moves ? spread_of(group) : 0.0f) + kRounding * length_m;
    const Sector sector = sector_of(group, sensor, reach_m);
    return {map, judgement, box, Area(box), sensor, moves, reach_m, sector, lanes, n_vectors};
}

} // namespace

void judge(gpom_map &map, Judgement &judgement)
{
    judgement.known = 0;
    judgement.against = 0;
    judgement.clears = 0;
    for (uint32_t &slot : judgement.renews) {
        slot = kNoSlot;
    }
    BeamLanes lanes[kVectors];
    const Trial trial = trial_of(map, judgement, lanes);
    traverse(
        map.index, map.index.hit_part, {map.keeper.hit_stack, map.index.next_id},
        [&](const Box &box) { return may_matter(trial, box); },
        [&](uint32_t slot) {
            const Beam &beam = map.index.beams[slot];
            if (!is_past(beam) && may_matter(trial, end_of(beam))) {
                compare(trial, slot);
            }
            return true;
        });
}

} // namespace gpom
