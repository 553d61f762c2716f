// Reads messages of scan channels into slots and checks them.
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
    std::int64_t wall_us;    ///< Arrival time, by the clock that stamps are of.
    std::int64_t arrived_us; ///< Arrival time, monotonic.
};

/// Result of decode_scan(). `slot` has room for IntakeConfig::ranges_max ranges.
struct DecodedScan {
    ScanSlot *slot;
    std::uint32_t sequence; ///< Sequence number of gpom.scan_t. Other types: 0.
    Problem problem;        ///< What is wrong, after a fault.
};

/// Read a message of a configured channel. After a fault only `problem` is valid.
gpom_wire_fault_t decode_scan(const Config &config, const char *channel, const Message &message,
                              DecodedScan &scan);

/// True if the stamp of a scan or a pose can be used. Else `problem` says why not: it is negative
/// or centuries ahead, or it is a time of day in another unit.
bool is_good_stamp(std::int64_t stamp_us, std::int64_t wall_us, Problem &problem);

} // namespace gpomd

#endif
