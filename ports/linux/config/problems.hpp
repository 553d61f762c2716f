// What is wrong with what comes: noted by the thread that sees it, told by the one that writes the
// log, and shown in the status.
#ifndef GPOM_LINUX_PROBLEMS_HPP
#define GPOM_LINUX_PROBLEMS_HPP

#include "ports/codec/codec.h"
#include "ports/linux/config/config.hpp"

#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// One case of a kind of problem. Which fields are used is up to the kind (words.cpp).
struct Problem {
    std::uint32_t kind; ///< GPOM_WIRE_PROBLEM_...
    /// Of the [[sensor]] whose scan it is; kSensorsMax: of no sensor.
    std::size_t i_sensor = kSensorsMax;
    std::uint64_t type = 0;     ///< Fingerprint that came.
    std::int64_t stamp_us = 0;  ///< That came.
    std::int64_t other_us = 0;  ///< What it is compared with: a clock, or another stamp.
    double value = 0.0;         ///< That came.
    double limit = 0.0;         ///< What it is compared with.
    std::uint64_t sender = 0;   ///< Address << 16 | port.
    ChannelName channel = {};   ///< Another channel than the configured one.
    const char *text = nullptr; ///< Static storage.
    std::size_t i_drop = 0;     ///< Place of a counter in kDrops (words.hpp).
};

/// Any thread may note; one thread tells. A kind is told when it is new: at once the first time,
/// and again once it had been absent for a minute, so that the log stays short whatever comes.
class Problems {
public:
    void note(const Problem &problem);

    /// The next problem that has not been told; false: there is none.
    bool next(Problem &problem);

    /// Bits of the kinds seen in the last 10 s, as in gpom.status_t.
    std::int64_t bits();

private:
    struct Kind {
        Problem problem;
        bool is_seen;
        bool is_untold;
        std::int64_t seen_us; ///< When it was noted last; monotonic.
    };

    std::mutex mutex_;
    Kind kinds_[GPOM_WIRE_PROBLEM_KINDS] = {}; ///< Guarded by mutex_.
};

} // namespace gpomd

#endif
