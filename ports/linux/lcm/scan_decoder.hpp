// Messages of scan channels, read into slots and checked.
#ifndef GPOM_LINUX_SCAN_DECODER_HPP
#define GPOM_LINUX_SCAN_DECODER_HPP

#include "ports/codec/codec.h"
#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"
#include "ports/linux/lcm/scan_queue.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A message from the bus.
struct Message {
    const std::uint8_t *bytes;
    std::size_t n_bytes;
    std::int64_t wall_us;    ///< When it came, by the clock that stamps are of.
    std::int64_t arrived_us; ///< When it came; monotonic.
};

/// What became of a message. `slot` has room for IntakeConfig::ranges_max.
struct DecodedScan {
    ScanSlot *slot;
    std::uint32_t sequence; ///< Of gpom.scan_t; else 0.
    Problem problem;        ///< After a fault: what is wrong.
};

/// Read a message of a channel that is configured. After a fault only `problem` may be relied on.
gpom_wire_fault_t decode_scan(const Config &config, const char *channel, const Message &message,
                              DecodedScan &scan);

/// Is a stamp, of a scan or a pose, one that can be worked with? Else `problem` says why not:
/// negative or centuries ahead, or the time of day in another unit.
bool is_good_stamp(std::int64_t stamp_us, std::int64_t wall_us, Problem &problem);

} // namespace gpomd

#endif
