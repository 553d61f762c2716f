/// \file gradient.cpp
/// The hot path of gradients for one lane width. It is compiled as answer.cpp is.
#include "src/query/gradient_path.hpp"

#include "src/query/moving.hpp"
#include "src/query/packet.hpp"

namespace gpom
{
namespace
{

constexpr size_t gradient_scratch_bytes(const ScratchNeed &need)
{
    return scratch_bytes(need) - scratch_layout(need).total + moving_at(need) +
           moving_layout(need).total;
}

/// True if GPOM_GRADIENT_BYTES() is enough to choose n neighbours from 2 n.
constexpr bool is_enough_for_gradients(size_t n)
{
    return gradient_scratch_bytes({n, 2 * n, n > GPOM_POINTS_MAX}) <=
           GPOM_GRADIENT_BYTES(n, kLanes);
}

static_assert(is_enough_for_gradients(2) && is_enough_for_gradients(5) &&
                  is_enough_for_gradients(16) && is_enough_for_gradients(GPOM_POINTS_MAX) &&
                  is_enough_for_gradients(GPOM_POINTS_MAX + 1) &&
                  is_enough_for_gradients(GPOM_SPARSE_POINTS_MAX),
              "public macro too small");

/// 0 for a map with a sparse solve, which has no gradients.
size_t scratch_bytes_for(const gpom_map &map)
{
    return is_sparse(map) ? 0 : gradient_scratch_bytes(scratch_need(map));
}

/// Mean and variance of a packet with derivatives. In the frame of the map the query moves.
template <gpom_kernel_t K>
Moments<Dual<F>> moving_moments(const gpom_map &map, Workspace &work, const MovingWork &moving)
{
    const F zero = lane::splat<F>(0.0f);
    const F one = lane::splat<F>(1.0f);
    const Offset<F> at = work.packet->at;
    const bool in_map_frame = map.config.params.frame == GPOM_FRAME_MAP;
    const Dual<F> x_m = in_map_frame ? Dual<F>{at.x_m, one, zero} : fixed(zero);
    const Dual<F> y_m = in_map_frame ? Dual<F>{at.y_m, zero, one} : fixed(zero);
    return predict_moving<K>(map.kernel, moving.points, work.gp, moving.slopes, {x_m, y_m});
}

void set_slopes(gpom_gradient_t &gradient, const Moments<Dual<F>> &moments,
                const Dual<F> &probability, int i)
{
    gradient.mean_x = lane::get(moments.mean.by_x, i);
    gradient.mean_y = lane::get(moments.mean.by_y, i);
    gradient.variance_x = lane::get(moments.variance.by_x, i);
    gradient.variance_y = lane::get(moments.variance.by_y, i);
    gradient.probability_x = lane::get(probability.by_x, i);
    gradient.probability_y = lane::get(probability.by_y, i);
}

/// The arrays of a call, and where its results go.
struct GradientOut {
    const MovingWork &moving;
    gpom_gradient_t *gradients;
};

/// Answer a packet whose neighbours were found. Returns the bitwise or of the flags of the answers.
template <gpom_kernel_t K>
unsigned gradients_found(const gpom_map &map, Workspace &work, const GradientOut &out)
{
    const MovingWork &moving = out.moving;
    const gpom_params_t &params = map.config.params;
    const MovingContext context = prepare_moving(map, work, moving);
    Evidence<Dual<F>> evidence = {moving_moments<K>(map, work, moving), context.offset};
    if (params.fade_m > 0.0f) {
        evidence = faded(params, map.prior_variance, context.nearest2_m2, evidence);
    }
    const Moments<Dual<F>> &moments = evidence.moments;
    const Dual<F> probability = squash(params, moments.mean, moments.variance, evidence.offset);
    Answers lanes = {};
    lanes.moments = {moments.mean.value, moments.variance.value, moments.bad.value};
    lanes.probability = probability.value;
    lanes.n_hits = count_found(work.hits, moving.points.n_hits);
    lanes.n_free = count_found(work.free, moving.points.n_free);
    lanes.is_cut = work.is_cut;
    unsigned flags = 0;
    for (int i = 0; i < work.packet->n; ++i) {
        gpom_gradient_t gradient = {};
        gradient.answer = answer_of(map, *work.packet, lanes, i);
        if ((gradient.answer.flags & (GPOM_ANSWER_OUT_OF_REACH | GPOM_ANSWER_PIVOT)) == 0) {
            set_slopes(gradient, moments, probability, i);
        }
        out.gradients[work.packet->i_answer[i]] = gradient;
        flags |= gradient.answer.flags;
    }
    return flags;
}

AnswerFound<GradientOut> gradients_found_for(int32_t kernel)
{
    switch (kernel) {
    case GPOM_KERNEL_NN:
        return gradients_found<GPOM_KERNEL_NN>;
    case GPOM_KERNEL_MATERN12:
        return gradients_found<GPOM_KERNEL_MATERN12>;
    case GPOM_KERNEL_MATERN32:
        return gradients_found<GPOM_KERNEL_MATERN32>;
    case GPOM_KERNEL_SE:
        return gradients_found<GPOM_KERNEL_SE>;
    default:
        return gradients_found<GPOM_KERNEL_ASKEY>;
    }
}

unsigned all_gradients(const gpom_map &map, const gpom_point_list &points,
                       gpom_gradient_t *gradients, void *scratch)
{
    Workspace work = carve_workspace(map, scratch);
    const MovingWork moving = carve_moving(map, scratch);
    const GradientOut out = {moving, gradients};
    return answer_list(map, work, points, gradients_found_for(map.config.params.kernel), out);
}

} // namespace

gpom_gradient_path gradient_path_here() { return {scratch_bytes_for, all_gradients}; }

} // namespace gpom
