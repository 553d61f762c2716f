// The two clocks, in microseconds.
#ifndef GPOM_LINUX_CLOCK_HPP
#define GPOM_LINUX_CLOCK_HPP

#include <ctime>

#include <cstdint>

namespace gpomd
{

inline std::int64_t read_clock_us(clockid_t id)
{
    timespec time = {};
    clock_gettime(id, &time);
    return static_cast<std::int64_t>(time.tv_sec) * 1000000 + time.tv_nsec / 1000;
}

/// Since the Unix epoch; may be set by anybody: only to be compared with stamps.
inline std::int64_t wall_us() { return read_clock_us(CLOCK_REALTIME); }

/// Stamps from 0 to this are let in: no sum or difference of a few of them overflows.
constexpr std::int64_t kStampMax_us = INT64_MAX / 4;

/// Never runs backwards.
inline std::int64_t monotonic_us() { return read_clock_us(CLOCK_MONOTONIC); }

} // namespace gpomd

#endif
