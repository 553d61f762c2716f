#include "gpom/params.h"

#include "src/base/check.hpp"
#include "src/gp/classify.hpp"
#include "src/gp/context.hpp"
#include "src/gp/sparse_gp.hpp"

void gpom_params_init(gpom_params_t *params)
{
    if (params == nullptr) {
        return;
    }
    *params = gpom_params_t{};
    params->struct_bytes = sizeof(gpom_params_t);
    params->kernel = GPOM_KERNEL_MATERN12;
    params->frame = GPOM_FRAME_QUERY;
    params->sf2 = 13.0f;
    params->s0 = 60.0f;
    params->s1 = 1.0f;
    params->ell_m = 11.0f;
    params->sn2 = 0.02f;
    params->sn2_free = 0.31f;
    params->alpha = 3.2f;
    params->beta = 0.035f;
    params->gap_m = 0.05f;
    params->p_occupied = 0.7f;
    params->p_free = 0.3f;
    params->n_hits = 8;
    params->n_free = 8;
}

namespace
{

using gpom::is_between;

/// Greatest value of most hyperparameters. A product of a few such values cannot overflow float32.
constexpr float kMost = 1e6f;
bool is_scale(float x) { return is_between(x, 1.0f / kMost, kMost); }

/// If a hit is nearer to the free end of its own beam than this [m], both count as one place.
constexpr float kApart_m = 0.05f;

/// Least noise variance that keeps a probability within 0.01 of its value in double. The relative
/// error of a covariance in float32 is 6e-8. If two points with different labels are almost in one
/// place, only the noise separates them. The limits are 0.1 % below the documented ones, because a
/// number that was read from text has few digits.
float noise_floor(const gpom_params_t &p)
{
    const bool is_rough = p.kernel == GPOM_KERNEL_MATERN12 || p.kernel == GPOM_KERNEL_ASKEY;
    const bool is_apart = p.gap_m * (1.0f - p.anisotropy) >= 0.999f * kApart_m;
    return (is_rough && is_apart ? 0.999e-5f : 0.999e-3f) * p.sf2;
}

const char *problem_of_kernel(const gpom_params_t &p)
{
    if (p.kernel < GPOM_KERNEL_NN || p.kernel > GPOM_KERNEL_ASKEY) {
        return "kernel: not one of nn, matern12, matern32, se, askey";
    }
    if (p.frame != GPOM_FRAME_QUERY && p.frame != GPOM_FRAME_MAP) {
        return "frame: not one of query, map";
    }
    if (!is_scale(p.sf2)) {
        return "sf2: must be from 1e-6 to 1e6";
    }
    if (p.kernel == GPOM_KERNEL_NN) {
        if (!is_between(p.s0, 1e-3f, kMost)) {
            return "s0: must be from 1e-3 to 1e6";
        }
        if (!is_between(p.s1, 1.0f / kMost, 1e4f)) {
            return "s1: must be from 1e-6 to 1e4";
        }
    } else if (!is_between(p.ell_m, p.kernel == GPOM_KERNEL_ASKEY ? 0.6f : 0.2f, 1e3f)) {
        return "ell_m: must be from 0.2 (askey: 0.6) to 1000";
    }
    return nullptr;
}

const char *problem_of_noise(const gpom_params_t &p)
{
    if (!is_between(p.sn2, noise_floor(p), kMost) ||
        !is_between(p.sn2_free, noise_floor(p), kMost)) {
        return "sn2, sn2_free: must be from 1e-3 sf2 (1e-5 sf2 for matern12 and askey if gap_m "
               "(1 - anisotropy) >= 0.05) to 1e6";
    }
    if (p.sn2_once != 0.0f && !is_between(p.sn2_once, p.sn2, kMost)) {
        return "sn2_once: must be 0, or from sn2 to 1e6";
    }
    if (!is_between(p.gap_m, 0.0f, kMost)) {
        return "gap_m: must be from 0 to 1e6";
    }
    return nullptr;
}

const char *problem_of_neighbours(const gpom_params_t &p)
{
    if (p.n_hits < 1) {
        return "hits: at least 1";
    }
    if (p.n_free < 1) {
        return "free: at least 1";
    }
    const int n = p.n_hits + p.n_free;
    if (n > static_cast<int>(GPOM_SPARSE_POINTS_MAX)) {
        return "hits, free: together at most 64, with kernel askey 512";
    }
    if (n > static_cast<int>(GPOM_POINTS_MAX) && p.kernel != GPOM_KERNEL_ASKEY) {
        return "hits, free: together at most 64; more needs kernel askey, of compact support";
    }
    if (n > static_cast<int>(GPOM_POINTS_MAX) && GPOM_SPARSE == 0) {
        return "hits, free: together at most 64; more needs a library built with SPARSE=1";
    }
    return nullptr;
}

const char *problem_of_context(const gpom_params_t &p)
{
    if (p.scan_points_max > GPOM_POINTS_MAX) {
        return "scan_points_max: at most 64";
    }
    if (p.n_fading > 0 && (p.n_fading >= p.n_hits || p.n_fading >= p.n_free)) {
        return "fading: must be less than hits and than free";
    }
    if (!is_between(p.depth_m, 0.0f, 5.0f)) {
        return "depth_m: must be from 0 to 5";
    }
    if (!is_between(p.anisotropy, 0.0f, 1.0f)) {
        return "anisotropy: must be from 0 to 1";
    }
    if (p.anisotropy > 0.0f && p.frame == GPOM_FRAME_MAP) {
        return "anisotropy: must be 0 in the map frame";
    }
    if (p.fade_m != 0.0f && !is_between(p.fade_m, 0.1f, kMost)) {
        return "fade_m: must be 0, or from 0.1 to 1e6";
    }
    if (p.fade_m > 0.0f && p.frame == GPOM_FRAME_MAP) {
        return "fade_m: must be 0 in the map frame";
    }
    if (!is_between(p.vote, -kMost, kMost)) {
        return "vote: must be from -1e6 to 1e6";
    }
    if (!is_between(p.line, -kMost, kMost)) {
        return "line: must be from -1e6 to 1e6";
    }
    return nullptr;
}

const char *problem_of_log_terms(const gpom_params_t &p)
{
    const float weights[] = {p.log_hit_first, p.log_hit_last, p.log_free_first, p.log_free_last};
    for (const float weight : weights) {
        if (!is_between(weight, -kMost, kMost)) {
            return "log_hit_first, log_hit_last, log_free_first, log_free_last: must be from -1e6 "
                   "to 1e6";
        }
    }
    return nullptr;
}

const char *problem_of_sigmoid(const gpom_params_t &p)
{
    if (!is_scale(p.alpha)) {
        return "alpha: must be from 1e-6 to 1e6";
    }
    if (!is_between(p.beta, -kMost, kMost)) {
        return "beta: must be from -1e6 to 1e6";
    }
    if (!is_between(p.beta_far, -kMost, kMost)) {
        return "beta_far: must be from -1e6 to 1e6";
    }
    if (p.beta_far != 0.0f && p.fade_m == 0.0f) {
        return "beta_far: must be 0 where fade_m is 0";
    }
    if (!(p.p_free > 0.0f && p.p_free < p.p_occupied && p.p_occupied < 1.0f)) {
        return "p_free, p_occupied: must satisfy 0 < p_free < p_occupied < 1";
    }
    const float p0 = gpom_params_prior_probability(&p);
    if (!(p0 > p.p_free && p0 < p.p_occupied)) {
        return "beta: the prior probability Phi((beta + beta_far) / sqrt(1 + alpha^2 k(x, x))) "
               "must lie between p_free and p_occupied";
    }
    return nullptr;
}

const char *problem_of(const gpom_params_t &p)
{
    const char *(*const checks[])(const gpom_params_t &) = {
        problem_of_kernel,  problem_of_noise,     problem_of_neighbours,
        problem_of_context, problem_of_log_terms, problem_of_sigmoid};
    for (const auto check : checks) {
        const char *const problem = check(p);
        if (problem != nullptr) {
            return problem;
        }
    }
    return nullptr;
}

} // namespace

gpom_status_t gpom_params_check(const gpom_params_t *params, const char **problem)
{
    if (problem != nullptr) {
        *problem = nullptr;
    }
    if (params == nullptr || params->struct_bytes != sizeof(gpom_params_t)) {
        return GPOM_ERR_ARG;
    }
    const char *const found = problem_of(*params);
    if (problem != nullptr) {
        *problem = found;
    }
    return found == nullptr ? GPOM_OK : GPOM_ERR_PARAMS;
}

float gpom_params_prior_variance(const gpom_params_t *params)
{
    return params == nullptr ? 0.0f : gpom::covariance_on_axis(*params, 0.0f, 0.0f);
}

float gpom_params_prior_probability(const gpom_params_t *params)
{
    if (params == nullptr) {
        return 0.0f;
    }
    return gpom::squash(*params, 0.0f, gpom_params_prior_variance(params),
                        gpom::prior_offset(*params));
}
