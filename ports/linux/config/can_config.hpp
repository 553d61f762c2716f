// CAN configuration of gpomd: table [can] of its configuration file.
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

/// Number of odometry signals: speed and yaw rate, or left and right wheels.
constexpr std::size_t kCanSignals = 2;
/// Most messages that the signals are in.
constexpr std::size_t kCanMessagesMax = kCanSignals;

/// A message that contains odometry.
struct CanMessageConfig {
    std::uint32_t id;    ///< As in struct can_frame: CAN_EFF_FLAG for 29 bits.
    std::size_t n_bytes; ///< Exact length. 0: any length that holds the signals.
    gpom_can_protection_t protection;
};

/// A signal of the odometry.
struct CanSignalConfig {
    std::size_t i_message;
    gpom_can_signal_t signal;
    bool has_absent;      ///< The signal has a raw value that means "no value".
    std::uint64_t absent; ///< The raw value that means "no value".
};

/// A message that is sent. Period 0: it is not sent.
struct CanSendConfig {
    std::uint32_t id;
    std::int64_t period_us;
};

struct CanConfig {
    char interface[IF_NAMESIZE]; ///< Empty: no CAN.
    bool has_fd;
    std::uint32_t receive_bytes; ///< Size of the socket's buffer.

    bool has_odometry;
    bool is_wheels; ///< The signals are left and right wheels, otherwise speed and yaw rate.
    double track_m; ///< Distance between the wheels.
    std::int64_t latency_us;
    std::size_t n_messages;
    CanMessageConfig messages[kCanMessagesMax];
    CanSignalConfig signals[kCanSignals];
    OdometryConfig odometry;

    CanSendConfig status, clearance, clearance_fd, tile;
    float range_m;  ///< Clearance is computed up to this distance.
    float radius_m; ///< Cells this near to the reference point are the robot's own place.
    std::int32_t tiles_beside; ///< Number of tiles sent on each side of the robot's tile.
};

/// Read [can] of a whole configuration. Without [can], `config` has no interface. Throws
/// gpom_tools::FileError, which names file, line and key.
void read_can(const gpom_tools::TomlTable &root, CanConfig &config);

} // namespace gpomd

#endif
