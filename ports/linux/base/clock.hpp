// The two clocks of gpomd, in microseconds.
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

/// Time since the Unix epoch. Anybody may set this clock, so compare it with stamps only.
inline std::int64_t wall_us() { return read_clock_us(CLOCK_REALTIME); }

/// gpomd accepts stamps from 0 to this value. Sums and differences of a few of them cannot
/// overflow.
constexpr std::int64_t kStampMax_us = INT64_MAX / 4;

/// Time since some fixed moment. This clock never runs backwards.
inline std::int64_t monotonic_us() { return read_clock_us(CLOCK_MONOTONIC); }

} // namespace gpomd

#endif
