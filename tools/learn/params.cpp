#include "tools/learn/params.hpp"

#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace gpom_tools
{

Ingredients parse_ingredients(const std::string &text)
{
    if (text == "full") {
        return {true, true, true, true, true, true, true};
    }
    Ingredients chosen;
    const struct {
        const char *name;
        bool *flag;
    } known[] = {{"noise", &chosen.noise}, {"anisotropy", &chosen.anisotropy},
                 {"vote", &chosen.vote},   {"line", &chosen.line},
                 {"logs", &chosen.logs},   {"depth", &chosen.depth},
                 {"cap", &chosen.cap}};
    std::istringstream names(text == "paper" ? "" : text);
    for (std::string name; std::getline(names, name, ',');) {
        bool *found = nullptr;
        for (const auto &ingredient : known) {
            found = name == ingredient.name ? ingredient.flag : found;
        }
        if (found == nullptr) {
            throw std::runtime_error("--model: '" + name +
                                     "' is not one of paper, full, or a comma list of noise, "
                                     "anisotropy, vote, line, logs, depth, cap");
        }
        *found = true;
    }
    return chosen;
}

FixedParams parse_fixed(const std::string &text)
{
    FixedParams fixed;
    std::istringstream pairs(text);
    for (std::string pair; std::getline(pairs, pair, ',');) {
        const std::size_t equals = std::min(pair.find('='), pair.size());
        const std::string name = pair.substr(0, equals);
        const std::string digits = pair.substr(std::min(equals + 1, pair.size()));
        char *end = nullptr;
        const double value = std::strtod(digits.c_str(), &end);
        if (digits.empty() || *end != '\0' || !(value >= 0.0 && value <= 1e6)) {
            throw std::runtime_error("--fix: '" + pair + "' is not name=value with a value from 0");
        }
        if (name == "fade_m") {
            fixed.fade_m = value;
        } else if (name == "gap_m") {
            fixed.gap_m = value;
        } else if (name == "depth_m") {
            fixed.depth_m = value;
        } else if (name == "scan_points_max" && value == std::floor(value)) {
            fixed.scan_points_max = static_cast<int>(value);
        } else if (name == "fading" && value == std::floor(value)) {
            fixed.n_fading = static_cast<int>(value);
        } else {
            throw std::runtime_error("--fix: '" + pair +
                                     "': only fade_m, gap_m, depth_m and the "
                                     "whole numbers scan_points_max and fading can be fixed");
        }
    }
    static_cast<void>(to_library(with_fixed({}, fixed))); // refuse now, not after learning
    return fixed;
}

LearntParams with_fixed(LearntParams params, const FixedParams &fixed)
{
    params.fade_m = fixed.fade_m.value_or(params.fade_m);
    params.gap_m = fixed.gap_m.value_or(params.gap_m);
    params.depth_m = fixed.depth_m.value_or(params.depth_m);
    params.scan_points_max = fixed.scan_points_max.value_or(params.scan_points_max);
    params.n_fading = fixed.n_fading.value_or(params.n_fading);
    return params;
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

double prior_variance(const LearntParams &params)
{
    return params.kernel == GPOM_KERNEL_NN
               ? params.sf2 * std::asin(2.0 * params.s0 / (1.0 + 2.0 * params.s0))
               : params.sf2;
}

double prior_probability(const LearntParams &params)
{
    const double weight =
        std::accumulate(params.log_weights.begin(), params.log_weights.end(), 0.0);
    const double argument =
        params.beta + params.beta_far + weight * std::log(kLogDistanceMax + kLogDistanceMin);
    return normal_cdf(argument /
                      std::sqrt(1.0 + params.alpha * params.alpha * prior_variance(params)));
}

gpom_params_t to_library(const LearntParams &params)
{
    gpom_params_t rounded;
    gpom_params_init(&rounded);
    rounded.kernel = params.kernel;
    rounded.frame = GPOM_FRAME_QUERY;
    rounded.sf2 = static_cast<float>(params.sf2);
    rounded.s0 = static_cast<float>(params.s0);
    rounded.s1 = static_cast<float>(params.s1);
    rounded.ell_m = static_cast<float>(params.ell_m);
    rounded.sn2 = static_cast<float>(params.sn2);
    rounded.sn2_free = static_cast<float>(params.sn2_free);
    rounded.sn2_once = static_cast<float>(params.sn2_once);
    rounded.alpha = static_cast<float>(params.alpha);
    rounded.beta = static_cast<float>(params.beta);
    rounded.beta_far = static_cast<float>(params.beta_far);
    rounded.gap_m = static_cast<float>(params.gap_m);
    rounded.p_occupied = static_cast<float>(params.p_occupied);
    rounded.p_free = static_cast<float>(params.p_free);
    rounded.n_hits = static_cast<std::uint16_t>(params.n_hits);
    rounded.n_free = static_cast<std::uint16_t>(params.n_free);
    rounded.depth_m = static_cast<float>(params.depth_m);
    rounded.scan_points_max = static_cast<std::uint16_t>(params.scan_points_max);
    rounded.n_fading = static_cast<std::uint16_t>(params.n_fading);
    rounded.anisotropy = static_cast<float>(params.anisotropy);
    rounded.vote = static_cast<float>(params.vote);
    rounded.line = static_cast<float>(params.line);
    rounded.fade_m = static_cast<float>(params.fade_m);
    rounded.log_hit_first = static_cast<float>(params.log_weights[0]);
    rounded.log_hit_last = static_cast<float>(params.log_weights[1]);
    rounded.log_free_first = static_cast<float>(params.log_weights[2]);
    rounded.log_free_last = static_cast<float>(params.log_weights[3]);
    require_good(rounded);
    return rounded;
}

gpom_params_t to_six_digits(const LearntParams &params)
{
    gpom_params_t rounded = to_library(params);
    for (const ParamField &field : kParamFields) {
        if (field.number != nullptr) {
            char digits[40];
            std::snprintf(digits, sizeof digits, "%.6g", double{rounded.*field.number});
            rounded.*field.number = std::strtof(digits, nullptr);
        }
    }
    reset_unused(rounded);
    require_good(rounded);
    return rounded;
}

} // namespace gpom_tools
