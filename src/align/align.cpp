#include "gpom/align.h"

#include "src/align/refine.hpp"
#include "src/base/arena.hpp"
#include "src/base/check.hpp"
#include "src/map/map.hpp"
#include "src/map/scan_input.hpp"

namespace gpom
{

namespace
{

/// The greatest squared Mahalanobis distance from the prediction: it is exceeded by chance once in
/// 100 times (chi-square, 3 degrees of freedom).
constexpr float kFar2 = 11.34f;

/// Places beside the one found are tried at this distance along the weakest direction.
constexpr float kSlip_m = 0.4f;

/// Another pose fits better if its misfit is below this many times that of the best.
constexpr float kBetter = 0.9f;

/// Another pose fits about as well if its misfit is below this many times that of the best. It is
/// another pose if it is this far away.
constexpr float kRival = 1.25f;
constexpr float kRivalWay_m = 0.15f;
constexpr float kRivalTurn_rad = 0.05f;

/// Starts: the predicted pose, four headings, two places.
constexpr uint32_t kStartsMax = 7;

/// Byte offsets in the scratch, from an aligned start.
struct AlignLayout {
    size_t returns, lines, search, total;
};

constexpr AlignLayout align_layout(size_t n_returns)
{
    AlignLayout layout = {};
    layout.lines = align8(n_returns * sizeof(Return));
    layout.search = layout.lines + align8(n_returns * sizeof(Line));
    layout.total = layout.search + sizeof(LineSearch) + 7; // 7: to align the start
    return layout;
}

static_assert(align_layout(8).total <= GPOM_ALIGN_BYTES(8), "public macro too small");
static_assert(align_layout(GPOM_ALIGN_RETURNS_MAX).total <=
                  GPOM_ALIGN_BYTES(GPOM_ALIGN_RETURNS_MAX),
              "public macro too small");

bool is_config(const gpom_align_config_t *c)
{
    return c != nullptr && c->struct_bytes == sizeof *c &&
           is_between<uint32_t>(c->n_returns_max, 8, GPOM_ALIGN_RETURNS_MAX) &&
           is_between<uint32_t>(c->n_iterations, 1, GPOM_ALIGN_ITERATIONS_MAX) &&
           c->n_independent >= 1 && is_between(c->return_sd_m, 1e-4f, 10.0f) &&
           is_between(c->residual_good_m, FLT_MIN, FLT_MAX) &&
           is_between(c->residual_max_m, FLT_MIN, FLT_MAX) &&
           is_between(c->heading_step_rad, 0.0f, 1.0f) &&
           is_between(c->ambiguous_sd_m, FLT_MIN, FLT_MAX) &&
           is_between(c->ambiguous_sd_rad, FLT_MIN, FLT_MAX) &&
           is_between(c->matched_share_min, 0.0f, 1.0f);
}

bool is_task(const gpom_align_task_t *task)
{
    return task != nullptr && is_sensor(task->sensor) && is_pose(task->predicted) &&
           task->predicted.cov != nullptr && is_config(task->config);
}

AlignWork carve_work(const gpom_map &map, const gpom_align_task_t &task, void *scratch)
{
    const AlignLayout layout = align_layout(task.config->n_returns_max);
    void *const mem = reinterpret_cast<void *>(align_up(reinterpret_cast<uintptr_t>(scratch), 8));
    AlignWork work = {};
    work.map = &map;
    work.config = task.config;
    work.robot_m = {static_cast<float>(task.predicted.x_m - map.config.origin_x_m),
                    static_cast<float>(task.predicted.y_m - map.config.origin_y_m)};
    work.returns = carve<Return>(mem, layout.returns);
    work.lines = carve<Line>(mem, layout.lines);
    work.search = carve<LineSearch>(mem, layout.search);
    work.search->n_searches = 0;
    return work;
}

/// A pose that was found from some start.
struct Outcome {
    Motion motion;
    float misfit_m;
};

/// The search for the best pose.
struct Search {
    Fit best;
    Outcome found[kStartsMax];
    uint32_t n_found;
};

/// Refine from one more start.
void try_start(const AlignWork &work, const Motion &start, Search &search)
{
    const Fit fit = refine(work, start);
    search.found[search.n_found++] = {fit.motion, fit.misfit_m};
    if (search.n_found == 1 || fit.misfit_m < kBetter * search.best.misfit_m) {
        search.best = fit;
    }
}

bool is_good(const AlignWork &work, const Search &search)
{
    return search.best.residual_m <= work.config->residual_good_m;
}

/// From the predicted pose. If that does not fit well, also from headings beside it and from places
/// on both sides along the weakest direction.
void search_pose(const AlignWork &work, Search &search)
{
    constexpr float kHeadings[] = {-1.0f, 1.0f, -2.0f, 2.0f};
    const float heading_rad = work.config->heading_step_rad;
    search.n_found = 0;
    try_start(work, {{0.0f, 0.0f}, 0.0f}, search);
    if (heading_rad == 0.0f || search.best.n_matched == 0) {
        return;
    }
    for (int i = 0; i < 4 && !is_good(work, search); ++i) {
        try_start(work, {{0.0f, 0.0f}, kHeadings[i] * heading_rad}, search);
    }
    if (!is_good(work, search)) {
        const Weakness weakness = weakness_of(search.best.scan);
        const Motion middle = search.best.motion;
        const Eigen::Vector2f aside_m = kSlip_m * weakness.direction;
        try_start(work, {middle.step_m - aside_m, middle.turn_rad}, search);
        try_start(work, {middle.step_m + aside_m, middle.turn_rad}, search);
    }
}

/// True if another pose fits about as well as the best.
bool has_rival(const Search &search)
{
    const Motion &best = search.best.motion;
    for (uint32_t i = 0; i < search.n_found; ++i) {
        const Outcome &found = search.found[i];
        const bool is_other =
            (found.motion.step_m - best.step_m).squaredNorm() > kRivalWay_m * kRivalWay_m ||
            lane::abs(found.motion.turn_rad - best.turn_rad) > kRivalTurn_rad;
        if (is_other && found.misfit_m < kRival * search.best.misfit_m) {
            return true;
        }
    }
    return false;
}

bool is_far(const AlignWork &work, const Motion &motion)
{
    const Eigen::Vector3f off(motion.step_m.x(), motion.step_m.y(), motion.turn_rad);
    return !(off.dot(work.prior * off) <= kFar2);
}

unsigned flags_of(const AlignWork &work, const Search &search, const Weakness &weakness)
{
    const gpom_align_config_t &config = *work.config;
    const Fit &fit = search.best;
    const bool is_open = weakness.sd_m > config.ambiguous_sd_m || has_rival(search);
    unsigned flags = is_open ? GPOM_ALIGN_AMBIGUOUS : 0u;
    flags |= weakness.sd_rad > config.ambiguous_sd_rad ? GPOM_ALIGN_AMBIGUOUS_YAW : 0u;
    flags |= fit.has_converged ? 0u : GPOM_ALIGN_NOT_CONVERGED;
    flags |= fit.residual_m <= config.residual_max_m ? 0u : GPOM_ALIGN_POOR;
    flags |= is_far(work, fit.motion) ? GPOM_ALIGN_FAR : 0u;
    return flags;
}

/// The result if the scan says nothing: the prediction.
gpom_alignment_t predicted_alignment(const AlignWork &work, const gpom_pose_t &predicted)
{
    gpom_alignment_t alignment = {};
    alignment.x_m = predicted.x_m;
    alignment.y_m = predicted.y_m;
    alignment.yaw_rad = predicted.yaw_rad;
    for (int i = 0; i < 9; ++i) {
        alignment.cov[i] = predicted.cov[i];
    }
    const Weakness weakness = weakness_of(Eigen::Matrix3f::Zero());
    alignment.residual_m = kClip_m;
    alignment.weak_x = weakness.direction.x();
    alignment.weak_y = weakness.direction.y();
    alignment.weak_sd_m = weakness.sd_m;
    alignment.weak_sd_rad = weakness.sd_rad;
    alignment.n_returns = static_cast<uint16_t>(work.n_returns);
    alignment.n_searches = work.search->n_searches;
    alignment.flags = GPOM_ALIGN_FEW;
    return alignment;
}

bool has_enough(const AlignWork &work, const Fit &fit)
{
    const float n_min = work.config->matched_share_min * static_cast<float>(work.n_returns);
    return fit.n_matched >= 8 && static_cast<float>(fit.n_matched) >= n_min;
}

gpom_alignment_t align(const AlignWork &work, const gpom_pose_t &predicted)
{
    gpom_alignment_t alignment = predicted_alignment(work, predicted);
    Search search;
    search_pose(work, search);
    const Fit &fit = search.best;
    alignment.n_searches = work.search->n_searches;
    alignment.n_matched = static_cast<uint16_t>(fit.n_matched);
    alignment.n_new = static_cast<uint16_t>(fit.n_new);
    alignment.residual_m = fit.residual_m;
    Eigen::Matrix3f cov;
    if (!has_enough(work, fit) || !invert(fit.scan + work.prior, cov)) {
        return alignment;
    }
    const Weakness weakness = weakness_of(fit.scan);
    alignment.x_m += static_cast<double>(fit.motion.step_m.x());
    alignment.y_m += static_cast<double>(fit.motion.step_m.y());
    alignment.yaw_rad += static_cast<double>(fit.motion.turn_rad);
    for (int i = 0; i < 9; ++i) {
        alignment.cov[i] = cov(i / 3, i % 3);
    }
    alignment.weak_x = weakness.direction.x();
    alignment.weak_y = weakness.direction.y();
    alignment.weak_sd_m = weakness.sd_m;
    alignment.weak_sd_rad = weakness.sd_rad;
    alignment.flags = static_cast<uint8_t>(flags_of(work, search, weakness));
    return alignment;
}

bool is_in_reach(const gpom_map &map, const gpom_sensor_t &sensor, const gpom_pose_t &pose)
{
    return place_of(map, sensor, pose).from_origin_m.squaredNorm() <= GPOM_REACH_M * GPOM_REACH_M;
}

/// What both calls have in common, after the checks of the scan.
template <class Scan>
gpom_status_t align_checked(const gpom_map &map, const Scan &scan, const gpom_align_task_t &task,
                            gpom_alignment_t &alignment, const gpom_scratch_t *scratch)
{
    const size_t need_bytes = GPOM_ALIGN_BYTES(task.config->n_returns_max);
    if (scratch == nullptr || scratch->mem == nullptr || scratch->mem_bytes < need_bytes) {
        return GPOM_ERR_MEM;
    }
    if (!is_in_reach(map, *task.sensor, task.predicted)) {
        return GPOM_ERR_REACH;
    }
    AlignWork work = carve_work(map, task, scratch->mem);
    if (!information_of(task.predicted.cov, work.prior)) {
        return GPOM_ERR_ARG;
    }
    work.n_returns = gather_returns(scan, task, work.returns);
    alignment = align(work, task.predicted);
    return GPOM_OK;
}

} // namespace
} // namespace gpom

void gpom_align_config_init(gpom_align_config_t *config)
{
    if (config == nullptr) {
        return;
    }
    *config = gpom_align_config_t{};
    config->struct_bytes = sizeof *config;
    config->n_returns_max = 180;
    config->n_iterations = 30;
    config->n_independent = 10;
    config->return_sd_m = 0.03f;
    config->residual_good_m = 0.02f;
    config->residual_max_m = 0.033f;
    config->heading_step_rad = 0.17f;
    config->ambiguous_sd_m = 0.05f;
    config->ambiguous_sd_rad = 0.1f;
    config->matched_share_min = 0.3f;
}

gpom_status_t gpom_scan_align(const gpom_map_t *map, const gpom_scan_t *scan,
                              const gpom_align_task_t *task, gpom_alignment_t *alignment,
                              const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || !gpom::is_scan(scan) || !gpom::is_task(task) ||
        alignment == nullptr) {
        return GPOM_ERR_ARG;
    }
    return gpom::align_checked(*map, *scan, *task, *alignment, scratch);
}

gpom_status_t gpom_sweep_align(const gpom_map_t *map, const gpom_sweep_t *sweep,
                               const gpom_align_task_t *task, gpom_alignment_t *alignment,
                               const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || !gpom::is_sweep(sweep) || !gpom::is_task(task) ||
        alignment == nullptr || !gpom::are_poses(*sweep)) {
        return GPOM_ERR_ARG;
    }
    return gpom::align_checked(*map, *sweep, *task, *alignment, scratch);
}
