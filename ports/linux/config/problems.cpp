#include "ports/linux/config/problems.hpp"

#include "ports/linux/base/clock.hpp"

namespace gpomd
{

namespace
{

/// The status shows a kind for this time after it was seen.
constexpr std::int64_t kShown_us = 10000000;

/// A kind that was absent for this time is new again.
constexpr std::int64_t kForgotten_us = 60000000;

} // namespace

void Problems::note(const Problem &problem)
{
    const std::int64_t now_us = monotonic_us();
    const std::lock_guard<std::mutex> lock(mutex_);
    Kind &kind = kinds_[problem.kind];
    if (!kind.is_seen || now_us - kind.seen_us > kForgotten_us) {
        kind.problem = problem;
        kind.is_untold = true;
    }
    kind.is_seen = true;
    kind.seen_us = now_us;
}

bool Problems::next(Problem &problem)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    for (Kind &kind : kinds_) {
        if (kind.is_untold) {
            kind.is_untold = false;
            problem = kind.problem;
            return true;
        }
    }
    return false;
}

std::int64_t Problems::bits()
{
    const std::int64_t now_us = monotonic_us();
    std::int64_t bits = 0;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t i = 0; i < GPOM_WIRE_PROBLEM_KINDS; ++i) {
        const bool is_shown = kinds_[i].is_seen && now_us - kinds_[i].seen_us < kShown_us;
        bits |= is_shown ? std::int64_t{1} << i : 0;
    }
    return bits;
}

} // namespace gpomd
