#include "gpom/distances.h"

#include "src/base/check.hpp"
#include "src/lane/elementary.hpp"
#include "src/query/workspace.hpp"

namespace gpom
{
namespace
{

constexpr float kHalf = 0.5f; ///< Probability of a surface.
constexpr uint32_t kHits = 4; ///< Rays towards hits.
/// Rays go on this far behind their hit [m].
constexpr float kBehind_m = 0.5f;
/// Arcs: their number at most, half of the first one's angle, what becomes of it if the arc meets
/// nothing, and the angle at which the search ends [rad].
constexpr int kArcs = 6;
constexpr double kArc_rad = 1.5707963;
constexpr double kNarrower = 0.4;
constexpr double kArcMin_rad = 0.1;
/// Arcs are nearer than the best place by this part and this length [m].
constexpr float kNearer = 0.97f;
constexpr float kNearer_m = 0.005f;
/// Parts of the deviation (distances.h).
constexpr float kLeast_m = 0.1f;
constexpr float kUnsure_m = 6.4f;
constexpr float kHidden_m = 22.0f;

constexpr float kNothing = -1.0f;

static_assert(1 + kHits * 2 * kBatchSize + kArcs * 3 * kBatchSize + 1 <= GPOM_DISTANCE_POINTS_MAX,
              "the header says fewer");

/// One search. Lengths are from the point.
struct Probe {
    const gpom_map &map;
    const gpom_scratch_t &scratch;
    PointBatch &batch;
    gpom_point_t at;
    Direction best;
    float best_m; ///< range_m before anything was found.
    bool is_found;
    uint8_t answer_flags;
};

void set_point(Probe &probe, uint32_t i, Direction direction, float length_m)
{
    probe.batch.points[i] = {
        probe.at.x_m + static_cast<double>(direction.x) * static_cast<double>(length_m),
        probe.at.y_m + static_cast<double>(direction.y) * static_cast<double>(length_m)};
}

/// Ask the map at the first n points of the batch.
void ask(Probe &probe, uint32_t n)
{
    const gpom_status_t status =
        gpom_query_points(&probe.map, probe.batch.points, n, probe.batch.answers, &probe.scratch);
    (void)status; // the flags of the answers tell the errors; the arguments were checked
    for (uint32_t i = 0; i < n; ++i) {
        probe.answer_flags |= probe.batch.answers[i].flags;
    }
}

/// Ask at equal steps of a ray. Returns the first step whose probability is at least 1/2, 1 ..
/// kBatchSize, or 0 if there is none.
uint32_t first_step(Probe &probe, Direction ray, float from_m, float to_m)
{
    const float step_m = (to_m - from_m) / static_cast<float>(kBatchSize);
    for (uint32_t i = 0; i < kBatchSize; ++i) {
        set_point(probe, i, ray, from_m + step_m * static_cast<float>(i + 1));
    }
    ask(probe, kBatchSize);
    for (uint32_t i = 0; i < kBatchSize; ++i) {
        if (probe.batch.answers[i].probability >= kHalf) {
            return i + 1;
        }
    }
    return 0;
}

/// Look for the first surface on a ray up to to_m. If it is the nearest so far, keep it.
void search_ray(Probe &probe, Direction ray, float to_m)
{
    const uint32_t coarse = first_step(probe, ray, 0.0f, to_m);
    if (coarse == 0) {
        return;
    }
    const float step_m = to_m / static_cast<float>(kBatchSize);
    const float from_m = step_m * static_cast<float>(coarse - 1);
    const uint32_t fine = first_step(probe, ray, from_m, from_m + step_m);
    const float part = static_cast<float>(fine > 0 ? fine : kBatchSize) - 0.5f;
    const float found_m = from_m + step_m * part / static_cast<float>(kBatchSize);
    if (found_m < probe.best_m) {
        probe.best = ray;
        probe.best_m = found_m;
        probe.is_found = true;
    }
}

/// The hits that are nearest to the point. Those that are missing have slot -1.
void find_hits(const Probe &probe, Found<float> *found)
{
    const Index &index = probe.map.index;
    const Lowres &place = probe.map.lowres;
    const Offset<float> at = {static_cast<float>(probe.at.x_m - place.origin_x_m),
                              static_cast<float>(probe.at.y_m - place.origin_y_m)};
    NearestK<float> nearest = {found, kHits, 0};
    nearest.clear();
    const Workspace work = carve_workspace(probe.map, probe.scratch.mem);
    (void)search(nearest, at, index, index.hit_part,
                 from_root(index.hit_tree, work.stack, probe.map.config.walk_max));
    for (uint32_t i = 0; i < kHits; ++i) {
        found[i].slot = i < nearest.n ? found[i].slot : -1;
    }
}

/// Search the rays towards the nearest hits. Returns the distance to the nearest hit that is not
/// past, and sets `towards`. kNothing if there is none within range.
float search_hits(Probe &probe, Direction &towards)
{
    Found<float> found[kHits];
    find_hits(probe, found);
    const float range_m = probe.best_m;
    float hit_m = kNothing;
    for (const Found<float> &hit : found) {
        if (hit.slot < 0) {
            continue;
        }
        const Beam &beam = probe.map.index.beams[hit.slot];
        const Point end = end_of(beam);
        const double x_m = probe.map.lowres.origin_x_m + static_cast<double>(end.x_m);
        const double y_m = probe.map.lowres.origin_y_m + static_cast<double>(end.y_m);
        const float dx = static_cast<float>(x_m - probe.at.x_m);
        const float dy = static_cast<float>(y_m - probe.at.y_m);
        const float length_m = lane::sqrt(dx * dx + dy * dy);
        if (!(length_m > 0.0f) || length_m > range_m + kBehind_m) {
            continue;
        }
        const Direction ray = {dx / length_m, dy / length_m};
        if (hit_m < 0.0f && length_m <= range_m && !is_past(beam)) {
            hit_m = length_m;
            towards = ray;
        }
        search_ray(probe, ray, lane::min(probe.best_m, length_m + kBehind_m));
    }
    return hit_m;
}

Direction turned(Direction a, Direction by)
{
    return {a.x * by.x - a.y * by.y, a.x * by.y + a.y * by.x};
}

/// Search on arcs about the best direction for a nearer surface.
void search_arcs(Probe &probe, double half_rad)
{
    for (int i_arc = 0; i_arc < kArcs && half_rad >= kArcMin_rad; ++i_arc) {
        const float arc_m = probe.best_m * kNearer - kNearer_m;
        if (!(arc_m > 0.0f)) {
            return;
        }
        const Direction middle = probe.best;
        const auto ray_of = [&](uint32_t i) {
            const double place = (2.0 * i + 1.0) / kBatchSize - 1.0; // -1 .. 1
            return turned(middle, direction_of(half_rad * place));
        };
        for (uint32_t i = 0; i < kBatchSize; ++i) {
            set_point(probe, i, ray_of(i), arc_m);
        }
        ask(probe, kBatchSize);
        uint32_t i_most = 0;
        for (uint32_t i = 1; i < kBatchSize; ++i) {
            const bool is_more =
                probe.batch.answers[i].probability > probe.batch.answers[i_most].probability;
            i_most = is_more ? i : i_most;
        }
        if (probe.batch.answers[i_most].probability >= kHalf) {
            search_ray(probe, ray_of(i_most), arc_m);
        } else {
            half_rad *= kNarrower;
        }
    }
}

float deviation_of(Probe &probe)
{
    set_point(probe, 0, probe.best, probe.best_m);
    ask(probe, 1);
    const float unsure = kUnsure_m * probe.batch.answers[0].variance / probe.map.prior_variance;
    const float hidden = probe.best_m * probe.best_m / kHidden_m;
    return lane::sqrt(kLeast_m * kLeast_m + unsure * unsure + hidden * hidden);
}

gpom_distance_answer_t answer_of(Probe &probe)
{
    set_point(probe, 0, {0.0f, 0.0f}, 0.0f);
    ask(probe, 1);
    if (probe.batch.answers[0].probability >= kHalf) {
        probe.best_m = 0.0f;
        probe.best = {0.0f, 0.0f};
        return {0.0f, deviation_of(probe), 0.0f, 0.0f, GPOM_DISTANCE_INSIDE};
    }
    Direction towards = {1.0f, 0.0f};
    const float hit_m = search_hits(probe, towards);
    uint8_t flags = 0;
    if (!probe.is_found && hit_m > 0.0f) {
        probe.best = towards;
        probe.best_m = hit_m;
        flags = GPOM_DISTANCE_HIT;
    }
    const bool has_direction = probe.is_found || flags != 0;
    search_arcs(probe, has_direction ? kArc_rad : 2.0 * kArc_rad);
    flags = probe.is_found ? 0 : flags;
    if (!has_direction && !probe.is_found) {
        probe.best = {0.0f, 0.0f};
        flags = GPOM_DISTANCE_NONE;
    }
    return {probe.best_m, deviation_of(probe), probe.best.x, probe.best.y, flags};
}

} // namespace
} // namespace gpom

gpom_status_t gpom_distance_query(const gpom_map_t *map, const gpom_point_t *point, double range_m,
                                  gpom_distance_answer_t *answer, const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || point == nullptr || answer == nullptr || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_finite(point->x_m) || !gpom::is_finite(point->y_m) || !(range_m > 0.0) ||
        range_m > GPOM_REACH_M) {
        return GPOM_ERR_ARG;
    }
    if (scratch->mem == nullptr || scratch->mem_bytes < gpom_scratch_bytes(map)) {
        return GPOM_ERR_MEM;
    }
    const double dx_m = point->x_m - map->lowres.origin_x_m;
    const double dy_m = point->y_m - map->lowres.origin_y_m;
    if (!(dx_m * dx_m + dy_m * dy_m <= GPOM_REACH_M * GPOM_REACH_M)) {
        return GPOM_ERR_REACH;
    }
    gpom::Probe probe = {*map,
                         *scratch,
                         *gpom::carve_batch(scratch->mem),
                         *point,
                         {1.0f, 0.0f},
                         static_cast<float>(range_m),
                         false,
                         0};
    *answer = gpom::answer_of(probe);
    answer->flags |= probe.answer_flags != 0 ? GPOM_DISTANCE_FLAGGED : 0;
    return GPOM_OK;
}
