#include "src/align/refine.hpp"

#include "src/map/map.hpp"
#include "src/map/se2.hpp"

namespace gpom
{

namespace
{

/// The circle in which hits are searched becomes narrower: in metres, and after which iteration.
constexpr float kReach_m[] = {1.0f, 0.5f, 0.25f};
constexpr uint32_t kStages = 3;
constexpr uint32_t kStageIterations = 5;

/// A stage ends when the step is shorter.
constexpr float kStep_m = 5e-4f;
constexpr float kStep_rad = 2e-4f;

/// The pose has not converged if the last step was longer.
constexpr float kLongStep_m = 0.01f;
constexpr float kLongStep_rad = 0.005f;

/// The weight of a return falls to a half at this many median distances, or at kScaleMin_m.
constexpr float kScale = 2.5f;
constexpr float kScaleMin_m = 0.03f;

/// Weight of a return that is compared with a spot.
constexpr float kSpotWeight = 0.25f;

/// With fewer matched returns there is no step.
constexpr uint32_t kMatchedMin = 8;

/// Normal equations of the pose.
struct Normal {
    Eigen::Matrix3f h;
    Eigen::Vector3f g;

    /// Add a row: a distance e that changes by `j` with the pose.
    void add(const Eigen::Vector3f &j, float e, float weight)
    {
        const Eigen::Vector3f weighted = weight * j;
        h += weighted * j.transpose();
        g += e * weighted;
    }
};

Eigen::Vector2f turned(const Direction &turn, const Eigen::Vector2f &v)
{
    return {turn.x * v.x() - turn.y * v.y(), turn.y * v.x() + turn.x * v.y()};
}

/// True if the line of a return must be searched anew: the return moved, or hits are out of reach.
bool is_old(const Line &line, const Eigen::Vector2f &at_m, float reach_m)
{
    const float stay_m = kStay * reach_m;
    return (at_m - line.searched_m).squaredNorm() > stay_m * stay_m ||
           line.found2_m2 > reach_m * reach_m;
}

/// Find the lines of all returns, and how far the returns are from them. Returns the number of
/// returns that have a line.
uint32_t match(const AlignWork &work, const Motion &motion, float reach_m, bool is_first)
{
    const Direction turn = direction_of(static_cast<double>(motion.turn_rad));
    const Eigen::Vector2f robot_m = work.robot_m + motion.step_m;
    uint32_t n_matched = 0;
    for (uint32_t i = 0; i < work.n_returns; ++i) {
        const Return &r = work.returns[i];
        Line &line = work.lines[i];
        const Placed placed = {robot_m + turned(turn, r.lever_m), turned(turn, r.direction)};
        if (is_first) {
            line.n_hits = 0;
        }
        if (is_first || is_old(line, placed.at_m, reach_m)) {
            find_line(*work.map, placed, reach_m, *work.search, line);
        }
        const Eigen::Vector2f off_m = placed.at_m - line.middle_m;
        line.error_m = line.shape == Shape::kLine ? lane::abs(line.normal.dot(off_m))
                                                  : 0.5f * lane::sqrt(off_m.squaredNorm());
        n_matched += line.shape != Shape::kNone ? 1 : 0;
    }
    return n_matched;
}

/// The median distance of the matched returns, to 1 mm at worst: half of the interval, ten times.
float median_error(const AlignWork &work, uint32_t n_matched)
{
    float low_m = 0.0f;
    float high_m = kReach_m[0];
    for (int round = 0; round < 10; ++round) {
        const float middle_m = 0.5f * (low_m + high_m);
        uint32_t n_below = 0;
        for (uint32_t i = 0; i < work.n_returns; ++i) {
            const Line &line = work.lines[i];
            n_below += line.shape != Shape::kNone && line.error_m < middle_m ? 1 : 0;
        }
        (2 * n_below > n_matched ? high_m : low_m) = middle_m;
    }
    return high_m;
}

/// A return without a line contradicts the map if a free segment is nearer than this [m].
constexpr float kFreeReach_m = 0.1f;

bool is_in_free(const AlignWork &work, const Motion &motion, const Return &r)
{
    const Direction turn = direction_of(static_cast<double>(motion.turn_rad));
    const Eigen::Vector2f at_m = work.robot_m + motion.step_m + turned(turn, r.lever_m);
    return is_near_free(work.map->index, work.search->stack, {at_m.x(), at_m.y()}, kFreeReach_m);
}

/// Judge how well the scan fits. A return without a line contradicts the map if it ends where the
/// map knows free space. If the map knows nothing there, it says nothing.
void judge(const AlignWork &work, Fit &fit)
{
    float sum_m = 0.0f;
    uint32_t n_against = 0;
    for (uint32_t i = 0; i < work.n_returns; ++i) {
        const Line &line = work.lines[i];
        if (line.shape != Shape::kNone) {
            sum_m += lane::min(line.error_m, kClip_m);
        } else {
            n_against += is_in_free(work, fit.motion, work.returns[i]) ? 1 : 0;
        }
    }
    const uint32_t n_unmatched = work.n_returns - fit.n_matched;
    const float against_m = kContradiction_m * static_cast<float>(n_against);
    fit.n_new = n_unmatched - n_against;
    fit.residual_m = (sum_m + against_m) / static_cast<float>(fit.n_matched + n_against);
    fit.misfit_m =
        (sum_m + kClip_m * static_cast<float>(n_unmatched)) / static_cast<float>(work.n_returns);
}

/// Sum the rows of all matched returns, weighted as Cauchy's distribution weighs them.
Normal sum_rows(const AlignWork &work, const Motion &motion, float scale_m)
{
    const Direction turn = direction_of(static_cast<double>(motion.turn_rad));
    Normal sum = {Eigen::Matrix3f::Zero(), Eigen::Vector3f::Zero()};
    for (uint32_t i = 0; i < work.n_returns; ++i) {
        const Line &line = work.lines[i];
        if (line.shape == Shape::kNone) {
            continue;
        }
        const Eigen::Vector2f lever_m = turned(turn, work.returns[i].lever_m);
        const Eigen::Vector2f off_m = work.robot_m + motion.step_m + lever_m - line.middle_m;
        const float ratio = line.error_m / scale_m;
        const float weight = 1.0f / (1.0f + ratio * ratio);
        if (line.shape == Shape::kLine) {
            const Eigen::Vector2f &n = line.normal;
            const float by_turn = n.y() * lever_m.x() - n.x() * lever_m.y();
            sum.add({n.x(), n.y(), by_turn}, n.dot(off_m), weight);
        } else {
            sum.add({1.0f, 0.0f, -lever_m.y()}, off_m.x(), kSpotWeight * weight);
            sum.add({0.0f, 1.0f, lever_m.x()}, off_m.y(), kSpotWeight * weight);
        }
    }
    return sum;
}

/// How much one row of the scan tells: the inverse variance of a return, shared by neighbours whose
/// errors are alike.
float row_information(const AlignWork &work, float scale_m, uint32_t n_matched)
{
    const gpom_align_config_t &config = *work.config;
    const float sd_m = lane::max(config.return_sd_m, scale_m / kScale);
    const float share = static_cast<float>(config.n_independent) / static_cast<float>(n_matched);
    return lane::min(share, 1.0f) / (sd_m * sd_m);
}

/// Make one step. Returns false if there is none.
bool step(const AlignWork &work, Fit &fit, Eigen::Vector3f &change)
{
    const float scale_m = lane::max(kScale * median_error(work, fit.n_matched), kScaleMin_m);
    const Normal rows = sum_rows(work, fit.motion, scale_m);
    const float information = row_information(work, scale_m, fit.n_matched);
    fit.scan = information * rows.h;
    const Eigen::Vector3f off(fit.motion.step_m.x(), fit.motion.step_m.y(), fit.motion.turn_rad);
    Eigen::Matrix3f cov;
    if (!invert(fit.scan + work.prior, cov)) {
        return false;
    }
    change = -(cov * (information * rows.g + work.prior * off));
    fit.motion.step_m += change.head<2>();
    fit.motion.turn_rad += change(2);
    return true;
}

bool is_short(const Eigen::Vector3f &change, float step_m, float step_rad)
{
    return change.head<2>().squaredNorm() < step_m * step_m && lane::abs(change(2)) < step_rad;
}

} // namespace

Fit refine(const AlignWork &work, const Motion &start)
{
    Fit fit = {start, Eigen::Matrix3f::Zero(), kClip_m, kClip_m, 0, 0, false};
    Eigen::Vector3f change(1.0f, 1.0f, 1.0f);
    uint32_t stage = 0;
    uint32_t n_in_stage = 0;
    bool is_done = false;
    for (uint32_t i = 0; i < work.config->n_iterations && !is_done; ++i) {
        fit.n_matched = match(work, fit.motion, kReach_m[stage], i == 0);
        if (fit.n_matched < kMatchedMin || !step(work, fit, change)) {
            fit.has_converged = false;
            return fit;
        }
        ++n_in_stage;
        const bool is_still = is_short(change, kStep_m, kStep_rad);
        is_done = is_still && stage + 1 == kStages;
        if (stage + 1 < kStages && (is_still || n_in_stage == kStageIterations)) {
            ++stage;
            n_in_stage = 0;
        }
    }
    fit.has_converged = is_short(change, kLongStep_m, kLongStep_rad);
    judge(work, fit);
    return fit;
}

} // namespace gpom
