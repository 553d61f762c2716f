#include "gpom/ray.h"

#include "src/base/arena.hpp"
#include "src/base/check.hpp"
#include "src/lane/elementary.hpp"
#include "src/query/hot_path.hpp"
#include "src/query/status.hpp"
#include "src/query/workspace.hpp"

#include <float.h>

namespace gpom
{
namespace
{

/// A place on a ray and the probability of occupancy there.
struct Mark {
    float t_m, p;
};

/// A crossing is found to this [m].
constexpr float kPrecision_m = 0.009f;

/// The least step if the caller gives none [m].
constexpr float kStepMin_m = 0.08f;
/// The greatest step, where a free segment is nearer than kFreeNear_m [m].
constexpr float kStepMax_m = 2.0f;
/// The greatest step farther from free segments: what is not seen may be narrow [m].
constexpr float kFreeStep_m = 0.6f;
constexpr float kFreeNear_m = 0.2f;
/// The greatest step where the ray is not free any more: a surface may touch the threshold only
/// just [m].
constexpr float kUnsureStep_m = 0.12f;
/// Steps end this far before the nearest hit [m], because what a hit occupies begins before it, and
/// use this part of the rest.
constexpr float kHitMargin_m = 0.1f;
constexpr float kHitShare = 0.9f;

/// A ray that is followed, and the point that it evaluates next.
struct Follow {
    Direction direction;
    Mark passed;       ///< Up to here the ray is settled.
    Mark far;          ///< The sample beyond, or `passed`.
    Mark high;         ///< The crossing that is refined is between `passed` and this.
    float next_m;      ///< Where the next point is.
    float step_m;      ///< From `far` on.
    float p0, p_max;   ///< At the start, and the greatest up to `passed`.
    float mean, mean2; ///< Integrals of the expected range and of its square, up to `passed`.
    uint32_t i_ray;
    bool is_refining, is_done;
    int8_t n_low, n_high; ///< How often in a row the end of the bracket moved.
};

struct RayBatch {
    gpom_point_t points[kBatchSize];
    gpom_answer_t answers[kBatchSize];
    gpom_distances distances[kBatchSize];
    Follow follows[kBatchSize];
};

constexpr size_t kRayBatchBytes = 7 + sizeof(RayBatch);
static_assert(kRayBatchBytes <= 2048, "GPOM_RAY_BYTES is too small");

struct Call {
    const gpom_map &map;
    const gpom_fan_t &fan;
    gpom_ray_t *rays;
    float *before;
};

/// Probability that a beam ends up to a place with the greatest probability p_max.
float ended(const Follow &f, float p_max)
{
    return f.p0 < 1.0f ? (lane::max(p_max, f.p0) - f.p0) / (1.0f - f.p0) : 1.0f;
}

float *before_of(const Call &call, const Follow &f)
{
    return call.before + static_cast<size_t>(f.i_ray) * call.fan.n_before;
}

void begin(const Call &call, uint32_t i_ray, Follow &f)
{
    f = Follow{};
    f.i_ray = i_ray;
    f.direction =
        direction_of(call.fan.bearing_rad + static_cast<double>(i_ray) * call.fan.bearing_step_rad);
    call.rays[i_ray] = gpom_ray_t{};
    for (uint32_t i = 0; call.before != nullptr && i < call.fan.n_before; ++i) {
        before_of(call, f)[i] = 0.0f;
    }
}

/// Settle the stretch up to a later mark: the expected range, and the ranges in between.
void pass(const Call &call, Follow &f, const Mark &to)
{
    const float p_max = lane::max(f.p_max, to.p);
    const float ended_a = ended(f, f.p_max);
    const float ended_b = ended(f, p_max);
    const float a = f.passed.t_m;
    const float b = to.t_m;
    f.mean += 0.5f * (b - a) * (2.0f - ended_a - ended_b);
    f.mean2 += (b - a) * (1.0f / 3.0f) *
               ((1.0f - ended_a) * (2.0f * a + b) + (1.0f - ended_b) * (a + 2.0f * b));
    for (uint32_t i = 0; call.before != nullptr && i < call.fan.n_before; ++i) {
        const float r_m = call.fan.before_m[i];
        if (r_m > a) {
            const float share = lane::min((r_m - a) / lane::max(b - a, FLT_MIN), 1.0f);
            before_of(call, f)[i] = ended_a + share * (ended_b - ended_a);
        }
    }
    f.p_max = p_max;
    f.passed = to;
}

/// The ray ends: a beam that has not ended before ends here.
void finish(const Call &call, Follow &f)
{
    gpom_ray_t &ray = call.rays[f.i_ray];
    ray.range_m = f.passed.t_m;
    if ((ray.flags & GPOM_RAY_NOT_FREE) == 0) {
        ray.not_free_m = ray.range_m;
    }
    ray.expected_m = f.mean;
    ray.deviation_m = lane::sqrt(lane::max(f.mean2 - f.mean * f.mean, 0.0f));
    for (uint32_t i = 0; call.before != nullptr && i < call.fan.n_before; ++i) {
        if (call.fan.before_m[i] > ray.range_m) {
            before_of(call, f)[i] = 1.0f;
        }
    }
    f.is_done = true;
}

bool is_free(const Call &call, float p) { return p <= call.map.config.params.p_free; }

/// True if a mark crosses a level that the ray has not crossed yet.
bool is_crossing(const Call &call, const Follow &f, const Mark &mark)
{
    const bool was_free = (call.rays[f.i_ray].flags & GPOM_RAY_NOT_FREE) == 0;
    return mark.p >= call.fan.threshold || (was_free && !is_free(call, mark.p));
}

/// Mark the levels that the ray crosses at `passed`. True if this is the end of the ray.
bool take_levels(const Call &call, const Follow &f)
{
    gpom_ray_t &ray = call.rays[f.i_ray];
    if (!is_free(call, f.passed.p) && (ray.flags & GPOM_RAY_NOT_FREE) == 0) {
        ray.flags = static_cast<uint8_t>(ray.flags | GPOM_RAY_NOT_FREE);
        ray.not_free_m = f.passed.t_m;
    }
    if (f.passed.p >= call.fan.threshold) {
        ray.flags = static_cast<uint8_t>(ray.flags | GPOM_RAY_REACHED);
        return true;
    }
    return false;
}

/// The place to look at between `passed` and `high`: by the secant to the level between them, or in
/// the middle if one end stayed twice.
float between(const Call &call, const Follow &f)
{
    const Mark &low = f.passed;
    const float width_m = f.high.t_m - low.t_m;
    const float level = is_free(call, low.p)
                            ? lane::min(call.map.config.params.p_free, call.fan.threshold)
                            : call.fan.threshold;
    const float rise = lane::max(f.high.p - low.p, FLT_MIN);
    const bool is_slow = f.n_low > 1 || f.n_high > 1;
    const float share = is_slow ? 0.5f : (level - low.p) / rise;
    const float edge_m = 0.4f * kPrecision_m;
    return lane::clamp(low.t_m + share * width_m + (f.n_high > f.n_low ? -edge_m : edge_m),
                       low.t_m + edge_m, f.high.t_m - edge_m);
}

/// Go on from a sample beyond `passed`: refine a crossing before it, or step.
void settle(const Call &call, Follow &f)
{
    if (f.far.t_m > f.passed.t_m && is_crossing(call, f, f.far)) {
        f.is_refining = true;
        f.high = f.far;
        f.n_low = f.n_high = 0;
        f.next_m = between(call, f);
        return;
    }
    f.is_refining = false;
    if (f.far.t_m > f.passed.t_m) {
        pass(call, f, f.far);
    }
    const float length_m = static_cast<float>(call.fan.length_m);
    if (f.passed.t_m >= length_m) {
        finish(call, f);
        return;
    }
    f.next_m = lane::min(f.passed.t_m + f.step_m, length_m);
}

/// Narrow the bracket of a crossing by a sample.
void refine(const Call &call, Follow &f, const Mark &sample)
{
    if (is_crossing(call, f, sample)) {
        f.high = sample;
        f.n_high = static_cast<int8_t>(f.n_high + 1);
        f.n_low = 0;
        if (sample.p >= call.fan.threshold) {
            f.far = sample; // a crossing of the threshold is not behind it
        }
    } else {
        pass(call, f, sample);
        f.n_low = static_cast<int8_t>(f.n_low + 1);
        f.n_high = 0;
    }
    if (f.high.t_m - f.passed.t_m > kPrecision_m) {
        f.next_m = between(call, f);
        return;
    }
    pass(call, f, f.high);
    if (take_levels(call, f)) {
        finish(call, f);
    } else {
        settle(call, f);
    }
}

/// How far the next sample may be: not farther than the neighbours allow.
float step_after(const Call &call, float p, const gpom_distances &d)
{
    const float given_m = call.fan.step_min_m;
    const float step_min_m = given_m > 0.0f ? given_m : kStepMin_m;
    const float by_hit_m = kHitShare * (d.hit_m - kHitMargin_m);
    const float by_free_m = d.free_m > kFreeNear_m ? kFreeStep_m : kStepMax_m;
    const float most_m = is_free(call, p) ? by_free_m : lane::min(by_free_m, kUnsureStep_m);
    return lane::max(lane::min(by_hit_m, most_m), step_min_m);
}

void add_flags(gpom_ray_t &ray, const gpom_answer_t &answer)
{
    unsigned flags = ray.flags;
    flags |= (answer.flags & GPOM_ANSWER_CUT) != 0 ? GPOM_RAY_CUT : 0;
    flags |= (answer.flags & GPOM_ANSWER_OUT_OF_REACH) != 0 ? GPOM_RAY_OUT_OF_REACH : 0;
    flags |= (answer.flags & GPOM_ANSWER_PIVOT) != 0 ? GPOM_RAY_PIVOT : 0;
    ray.flags = static_cast<uint8_t>(flags);
}

/// Take the answer at `next_m`.
void take(const Call &call, Follow &f, const gpom_answer_t &answer, const gpom_distances &distances)
{
    gpom_ray_t &ray = call.rays[f.i_ray];
    const Mark sample = {f.next_m, answer.probability};
    add_flags(ray, answer);
    if (ray.n_evaluated++ == 0) {
        f.p0 = f.p_max = sample.p;
        f.passed = f.far = sample;
        f.step_m = step_after(call, sample.p, distances);
        if (take_levels(call, f)) {
            finish(call, f);
            return;
        }
        settle(call, f);
    } else if (f.is_refining) {
        refine(call, f, sample);
    } else {
        f.far = sample;
        f.step_m = step_after(call, sample.p, distances);
        settle(call, f);
    }
    if (!f.is_done && ray.n_evaluated >= GPOM_RAY_EVALUATIONS_MAX) {
        ray.flags = static_cast<uint8_t>(ray.flags | GPOM_RAY_CUT);
        finish(call, f);
    }
}

/// Follow all rays, up to kBatchSize side by side. A ray that ends makes room for the next one.
/// Returns the bitwise or of the flags of all points.
unsigned follow_all(const Call &call, RayBatch &batch, void *scratch)
{
    const gpom_hot_path path = hot_path();
    uint32_t n_begun = 0;
    size_t n = 0;
    unsigned flags = 0;
    while (n > 0 || n_begun < call.fan.n_rays) {
        for (; n < kBatchSize && n_begun < call.fan.n_rays; ++n) {
            begin(call, n_begun++, batch.follows[n]);
        }
        for (size_t i = 0; i < n; ++i) {
            const Follow &f = batch.follows[i];
            batch.points[i] = {
                call.fan.x_m + static_cast<double>(f.next_m) * static_cast<double>(f.direction.x),
                call.fan.y_m + static_cast<double>(f.next_m) * static_cast<double>(f.direction.y)};
        }
        flags |=
            path.probe_points(call.map, {batch.points, n}, batch.answers, batch.distances, scratch);
        size_t n_left = 0;
        for (size_t i = 0; i < n; ++i) {
            take(call, batch.follows[i], batch.answers[i], batch.distances[i]);
            if (!batch.follows[i].is_done) {
                batch.follows[n_left++] = batch.follows[i];
            }
        }
        n = n_left;
    }
    return flags;
}

bool is_angle(double angle_rad) { return angle_rad >= -1e6 && angle_rad <= 1e6; }

bool is_fan(const gpom_fan_t &fan)
{
    if (!is_finite(fan.x_m) || !is_finite(fan.y_m) || !is_angle(fan.bearing_rad)) {
        return false;
    }
    if (!is_angle(fan.bearing_step_rad) || fan.n_rays == 0 ||
        (fan.n_before > 0 && fan.before_m == nullptr)) {
        return false;
    }
    return fan.length_m > 0.0 && fan.length_m <= GPOM_RAY_LENGTH_MAX_M && fan.threshold >= 0.0f &&
           fan.threshold <= 1.0f && fan.step_min_m >= 0.0f && fan.step_min_m <= 1.0f;
}

} // namespace
} // namespace gpom

size_t gpom_ray_bytes(const gpom_map_t *map)
{
    return gpom::is_map(map) ? gpom_scratch_bytes(map) + gpom::kRayBatchBytes : 0;
}

gpom_status_t gpom_ray_fan(const gpom_map_t *map, const gpom_fan_t *fan, gpom_ray_t *rays,
                           float *before, const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || fan == nullptr || rays == nullptr || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_fan(*fan)) {
        return GPOM_ERR_ARG;
    }
    if (scratch->mem == nullptr || scratch->mem_bytes < gpom_ray_bytes(map)) {
        return GPOM_ERR_MEM;
    }
    auto *const batch = static_cast<gpom::RayBatch *>(gpom::align_pointer(scratch->mem, 8));
    const gpom::Call call = {*map, *fan, rays, before};
    const gpom_status_t status = gpom::status_of(gpom::follow_all(call, *batch, batch + 1));
    if (status != GPOM_OK) {
        return status;
    }
    for (uint32_t i = 0; i < fan->n_rays; ++i) {
        if ((rays[i].flags & GPOM_RAY_CUT) != 0) {
            return GPOM_ERR_CUT;
        }
    }
    return GPOM_OK;
}

gpom_status_t gpom_ray_query(const gpom_map_t *map, const gpom_fan_t *fan, gpom_ray_t *ray,
                             float *before, const gpom_scratch_t *scratch)
{
    if (fan == nullptr) {
        return GPOM_ERR_ARG;
    }
    gpom_fan_t first = *fan;
    first.n_rays = 1;
    return gpom_ray_fan(map, &first, ray, before, scratch);
}
