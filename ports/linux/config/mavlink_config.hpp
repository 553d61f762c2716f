// MAVLink configuration of gpomd: table [mavlink] of its configuration file.
#ifndef GPOM_LINUX_MAVLINK_CONFIG_HPP
#define GPOM_LINUX_MAVLINK_CONFIG_HPP

#include "ports/mavlink/messages.h"

#include <netinet/in.h>

#include <cstdint>

namespace gpom_tools
{
class TomlTable;
}

namespace gpomd
{

struct MavlinkConfig {
    bool is_used;
    char to[128]; ///< Path of a serial port, or "udp:ADDRESS:PORT".
    bool is_serial;
    unsigned baud;   ///< Rate of the serial port.
    sockaddr_in udp; ///< Where datagrams are sent if there is no serial port.
    std::uint8_t system_id, component_id;
    std::int64_t period_us; ///< Period of OBSTACLE_DISTANCE.
    std::uint32_t n_sectors;
    gpom_mavlink_sensor_t sensor;
    float range_m;  ///< Distances are computed up to this one.
    float radius_m; ///< Cells this near to the reference point are the robot's own place.
};

/// Read [mavlink] of a whole configuration. Throws gpom_tools::FileError, which names file, line
/// and key.
void read_mavlink(const gpom_tools::TomlTable &root, MavlinkConfig &config);

} // namespace gpomd

#endif
