#include "gpom/params.h"

#include "src/classify.hpp"
#include "src/context.hpp"
#include "src/sparse_gp.hpp"

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

// Written so that a NaN fails.
bool is_within(float x, float low, float high) { return x >= low && x <= high; }

/// Values that no float32 product of a few of them can overflow.
constexpr float kMost = 1e6f;
bool is_scale(float x) { return is_within(x, 1.0f / kMost, kMost); }

/// Least noise, as a share of sf2, that keeps a 64 x 64 matrix factorable in float32.
float noise_floor(const gpom_params_t &p)
{
    const bool is_smooth = p.kernel == GPOM_KERNEL_NN || p.kernel == GPOM_KERNEL_SE;
    return (is_smooth ? 1e-3f : 1e-6f) * p.sf2;
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
        if (!is_scale(p.s0)) {
            return "s0: must be from 1e-6 to 1e6";
        }
        if (!is_scale(p.s1)) {
            return "s1: must be from 1e-6 to 1e6";
        }
    } else if (!is_scale(p.ell_m)) {
        return "ell_m: must be from 1e-6 to 1e6";
    }
    return nullptr;
}

const char *problem_of_noise(const gpom_params_t &p)
{
    if (!is_within(p.sn2, noise_floor(p), kMost)) {
        return "sn2: must be at least 1e-3 sf2 for nn and se, else 1e-6 sf2, and at most 1e6";
    }
    if (!is_within(p.sn2_free, noise_floor(p), kMost)) {
        return "sn2_free: must be at least 1e-3 sf2 for nn and se, else 1e-6 sf2, and at most 1e6";
    }
    if (p.sn2_once != 0.0f && !is_within(p.sn2_once, p.sn2, kMost)) {
        return "sn2_once: must be 0, or from sn2 to 1e6";
    }
    if (!is_within(p.gap_m, 0.0f, kMost)) {
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
    if (!is_within(p.depth_m, 0.0f, 5.0f)) {
        return "depth_m: must be from 0 to 5";
    }
    if (!is_within(p.anisotropy, 0.0f, 1.0f)) {
        return "anisotropy: must be from 0 to 1";
    }
    if (p.anisotropy > 0.0f && p.frame == GPOM_FRAME_MAP) {
        return "anisotropy: must be 0 in the map frame";
    }
    if (p.fade_m != 0.0f && !is_within(p.fade_m, 0.1f, kMost)) {
        return "fade_m: must be 0, or from 0.1 to 1e6";
    }
    if (p.fade_m > 0.0f && p.frame == GPOM_FRAME_MAP) {
        return "fade_m: must be 0 in the map frame";
    }
    if (!is_within(p.vote, -kMost, kMost)) {
        return "vote: must be from -1e6 to 1e6";
    }
    if (!is_within(p.line, -kMost, kMost)) {
        return "line: must be from -1e6 to 1e6";
    }
    return nullptr;
}

const char *problem_of_log_terms(const gpom_params_t &p)
{
    if (!is_within(p.log_hit_first, -kMost, kMost)) {
        return "log_hit_first: must be from -1e6 to 1e6";
    }
    if (!is_within(p.log_hit_last, -kMost, kMost)) {
        return "log_hit_last: must be from -1e6 to 1e6";
    }
    if (!is_within(p.log_free_first, -kMost, kMost)) {
        return "log_free_first: must be from -1e6 to 1e6";
    }
    if (!is_within(p.log_free_last, -kMost, kMost)) {
        return "log_free_last: must be from -1e6 to 1e6";
    }
    return nullptr;
}

const char *problem_of_sigmoid(const gpom_params_t &p)
{
    if (!is_scale(p.alpha)) {
        return "alpha: must be from 1e-6 to 1e6";
    }
    if (!is_within(p.beta, -kMost, kMost)) {
        return "beta: must be from -1e6 to 1e6";
    }
    if (!is_within(p.beta_far, -kMost, kMost)) {
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
