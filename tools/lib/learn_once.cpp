#include "tools/lib/learn_once.hpp"

#include "tools/lib/live_judge.hpp"
#include "tools/lib/protocol.hpp"

#include <algorithm>

namespace gpom_tools
{
namespace
{

/// Multiples of sn2 that are tried, in order.
constexpr double kFactors[] = {1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0};

/// By how many times the least NLL may be exceeded.
constexpr double kSlack = 1.005;

constexpr std::uint64_t kSplits = 4;

/// Stream of numbers besides those of gpom-live judge's usual seeds.
constexpr std::uint64_t kSplitSeed = 1000;

gpom_params_t with_factor(LearntParams params, double factor)
{
    params.sn2_once = factor * params.sn2;
    return to_library(params);
}

/// The greatest factor that costs no more than kSlack allows.
double chosen(const std::vector<OnceAttempt> &attempts)
{
    const auto less = [](const OnceAttempt &a, const OnceAttempt &b) { return a.nll < b.nll; };
    const double most = kSlack * std::min_element(attempts.begin(), attempts.end(), less)->nll;
    const auto last = std::find_if(attempts.rbegin(), attempts.rend(),
                                   [&](const OnceAttempt &a) { return a.nll <= most; });
    return last->factor;
}

} // namespace

OnceFit fit_once(const LearntParams &params, const std::vector<LearnSource> &sources,
                 const DataOptions &options, const Advance &advance)
{
    OnceFit fit{1.0, {}};
    for (const double factor : kFactors) {
        fit.attempts.push_back({factor, 0.0});
    }
    const auto n_all = static_cast<double>(sources.size() * kSplits);
    double n_done = 0.0;
    for (const LearnSource &source : sources) {
        const std::vector<Scan> scans =
            first_metres(read_log(source.scans_path, options.reading), options.first_m);
        for (std::uint64_t i = 0; i < kSplits; ++i) {
            LogSplit split = split_log(scans, kTrainingShareMax, options.seed + kSplitSeed + i);
            const JudgeData data{std::move(split.training), std::move(split.points)};
            for (OnceAttempt &attempt : fit.attempts) {
                const gpom_params_t tried = with_factor(params, attempt.factor);
                attempt.nll += live_accuracy(tried, {}, data).nll / n_all;
            }
            advance(++n_done / n_all);
        }
    }
    fit.factor = chosen(fit.attempts);
    return fit;
}

} // namespace gpom_tools
