// Problems of incoming data. The thread that sees a problem notes it, and the log thread reports
// it. The status shows the kinds.
#ifndef GPOM_LINUX_PROBLEMS_HPP
#define GPOM_LINUX_PROBLEMS_HPP

#include "ports/codec/codec.h"
#include "ports/linux/config/config.hpp"

#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// One problem. Its kind decides which fields are used (words.cpp).
struct Problem {
    std::uint32_t kind; ///< GPOM_WIRE_PROBLEM_...
    /// The [[sensor]] whose scan has the problem. kSensorsMax: no sensor.
    std::size_t i_sensor = kSensorsMax;
    std::uint64_t type = 0;     ///< The fingerprint received.
    std::int64_t stamp_us = 0;  ///< The stamp received.
    std::int64_t other_us = 0;  ///< The time to compare with: of a clock, or another stamp.
    double value = 0.0;         ///< The value received.
    double limit = 0.0;         ///< The limit to compare with.
    std::uint64_t sender = 0;   ///< Address << 16 | port.
    ChannelName channel = {};   ///< Another channel than the configured one.
    const char *text = nullptr; ///< Static storage.
    std::size_t i_drop = 0;     ///< Place of a counter in kDrops (words.hpp).
};

/// Any thread may note problems. One thread reports them. A kind is reported at once when it is
/// new, and again if it was absent for a minute. So the log stays short, whatever comes.
class Problems {
public:
    void note(const Problem &problem);

    /// Get the next problem that has not been reported. False: there is none.
    bool next(Problem &problem);

    /// Bits of the kinds seen in the last 10 s, as in gpom.status_t.
    std::int64_t bits();

private:
    struct Kind {
        Problem problem;
        bool is_seen;
        bool is_untold;
        std::int64_t seen_us; ///< When it was last noted, monotonic.
    };

    std::mutex mutex_;
    Kind kinds_[GPOM_WIRE_PROBLEM_KINDS] = {}; ///< Guarded by mutex_.
};

} // namespace gpomd

#endif
