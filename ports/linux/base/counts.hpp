// Counters that several threads raise and that the status message reads.
#ifndef GPOM_LINUX_COUNTS_HPP
#define GPOM_LINUX_COUNTS_HPP

#include "ports/codec/codec.h"

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// One counter per place of gpom.status_t. The index is GPOM_WIRE_SCANS_RECEIVED and so on.
class Counts {
public:
    void add(std::size_t place, std::int64_t n = 1)
    {
        counts_[place].fetch_add(n, std::memory_order_relaxed);
    }
    /// For counters that another part counts by itself.
    void set(std::size_t place, std::int64_t n)
    {
        counts_[place].store(n, std::memory_order_relaxed);
    }
    std::int64_t operator[](std::size_t place) const
    {
        return counts_[place].load(std::memory_order_relaxed);
    }

private:
    std::atomic<std::int64_t> counts_[GPOM_WIRE_COUNTS] = {};
};

} // namespace gpomd

#endif
