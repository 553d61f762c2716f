// What gpomd is told of CAN: table [can] of its configuration.
#ifndef GPOM_LINUX_CAN_CONFIG_HPP
#define GPOM_LINUX_CAN_CONFIG_HPP

#include "ports/can/messages.h"
#include "ports/linux/pose/odometry.hpp"

#include <net/if.h>

#include <cstddef>
#include <cstdint>

namespace gpom_tools
{
class TomlTable;
}

namespace gpomd
{

/// Signals of the odometry: speed and yaw rate, or left and right wheels.
constexpr std::size_t kCanSignals = 2;
/// Messages they are in.
constexpr std::size_t kCanMessagesMax = kCanSignals;

/// A message that odometry is in.
struct CanMessageConfig {
    std::uint32_t id;    ///< As in struct can_frame: CAN_EFF_FLAG for 29 bits.
    std::size_t n_bytes; ///< Exactly; 0: as many as the signals need, at least.
    gpom_can_protection_t protection;
};

/// A signal of the odometry.
struct CanSignalConfig {
    std::size_t i_message;
    gpom_can_signal_t signal;
    bool has_absent;      ///< Bits that say "no value":
    std::uint64_t absent; ///< these.
};

/// A message that is sent, or not: period 0.
struct CanSendConfig {
    std::uint32_t id;
    std::int64_t period_us;
};

struct CanConfig {
    char interface[IF_NAMESIZE]; ///< Empty: no CAN.
    bool has_fd;
    std::uint32_t receive_bytes; ///< Of the socket's buffer.

    bool has_odometry;
    bool is_wheels; ///< Signals are left and right wheels, else speed and yaw rate.
    double track_m; ///< Between the wheels.
    std::int64_t latency_us;
    std::size_t n_messages;
    CanMessageConfig messages[kCanMessagesMax];
    CanSignalConfig signals[kCanSignals];
    OdometryConfig odometry;

    CanSendConfig status, clearance, clearance_fd, tile;
    float range_m;  ///< Clearance is looked for so far.
    float radius_m; ///< Cells this near to the reference point are the robot's own place.
    std::int32_t tiles_beside; ///< Tiles sent on each side of the robot's.
};

/// Read [can] of a whole configuration; leaves `config` without an interface where there is none.
/// Throws gpom_tools::FileError, which names file, line and key.
void read_can(const gpom_tools::TomlTable &root, CanConfig &config);

} // namespace gpomd

#endif
