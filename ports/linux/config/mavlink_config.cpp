#include "ports/linux/config/mavlink_config.hpp"

#include "ports/host/serial_port.hpp"
#include "ports/host/toml_table.hpp"
#include "ports/linux/config/values.hpp"

#include <arpa/inet.h>

#include <cstdlib>
#include <cstring>
#include <string>

namespace gpomd
{

namespace
{

using gpom_tools::TomlTable;

/// Start bit, 8 bits, stop bit.
constexpr unsigned kBitsOfByte = 10;

constexpr Named<gpom_mavlink_sensor_t> kSensors[] = {{"laser", GPOM_MAVLINK_LASER},
                                                     {"ultrasound", GPOM_MAVLINK_ULTRASOUND},
                                                     {"infrared", GPOM_MAVLINK_INFRARED},
                                                     {"radar", GPOM_MAVLINK_RADAR},
                                                     {"unknown", GPOM_MAVLINK_UNKNOWN_SENSOR}};

constexpr char kUdp[] = "udp:";

/// Parse udp:ADDRESS:PORT. False: it is none.
bool parse_udp(const std::string &text, sockaddr_in &address)
{
    const std::size_t begin = std::strlen(kUdp);
    const std::size_t colon = text.find(':', begin);
    const std::string digits = colon != std::string::npos ? text.substr(colon + 1) : "";
    const bool is_number = !digits.empty() && digits.size() <= 5 &&
                           digits.find_first_not_of("0123456789") == std::string::npos;
    const long port = is_number ? std::strtol(digits.c_str(), nullptr, 10) : 0;
    address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return port > 0 && port <= UINT16_MAX && text.rfind(kUdp, 0) == 0 &&
           inet_pton(AF_INET, text.substr(begin, colon - begin).c_str(), &address.sin_addr) == 1;
}

/// Read where messages go.
void read_link(const TomlTable &table, MavlinkConfig &config)
{
    const std::string to = table.has("to") ? table.word("to") : "udp:127.0.0.1:14550";
    config.is_serial = !to.empty() && to[0] == '/';
    if (!config.is_serial && !parse_udp(to, config.udp)) {
        table.fail("to", "to: must be \"udp:ADDRESS:PORT\" with an IPv4 address in digits, or the "
                         "path of a serial port");
    }
    if (to.size() >= sizeof config.to) {
        table.fail("to", "to: longer than " + std::to_string(sizeof config.to - 1) + " characters");
    }
    std::memcpy(config.to, to.c_str(), to.size() + 1);
    config.baud = static_cast<unsigned>(whole_or(table, "baud", 921600, 0, UINT32_MAX));
    if (!gpom_tools::is_baud_rate(config.baud)) {
        table.fail("baud", "baud: must be one of " + gpom_tools::baud_rates());
    }
}

void read_sectors(const TomlTable &table, MavlinkConfig &config)
{
    config.n_sectors = static_cast<std::uint32_t>(
        whole_or(table, "sectors", GPOM_MAVLINK_SECTORS_MAX, 0, UINT32_MAX));
    if (!gpom_mavlink_is_sector_count(config.n_sectors)) {
        table.fail("sectors", "sectors: must be from 8 to 72 and divide 360, as 36 and 72 do");
    }
    config.range_m =
        static_cast<float>(number_or(table, "range_m", 25.0, {0.1, GPOM_MAVLINK_RANGE_MAX_M}));
    config.radius_m = static_cast<float>(number_or(table, "radius_m", 0.5, {0.0, 20.0}));
    if (!(config.range_m > config.radius_m)) {
        table.fail("radius_m", "radius_m: must be below range_m");
    }
}

/// A serial line must carry the messages, or each would wait behind older ones.
void check_rate(const TomlTable &table, const MavlinkConfig &config, double rate_hz)
{
    const double needed = rate_hz * GPOM_MAVLINK_BYTES * kBitsOfByte;
    if (config.is_serial && needed > config.baud) {
        const std::string key = table.has("rate_hz") ? "rate_hz" : "baud";
        table.fail(key, key + ": " + std::to_string(config.baud) + " baud carry at most " +
                            std::to_string(config.baud / (GPOM_MAVLINK_BYTES * kBitsOfByte)) +
                            " messages a second; lower rate_hz or raise baud");
    }
}

} // namespace

void read_mavlink(const TomlTable &root, MavlinkConfig &config)
{
    config.is_used = root.has("mavlink");
    if (!config.is_used) {
        return;
    }
    const TomlTable table = root.table("mavlink");
    table.refuse_keys_beyond({"to", "baud", "system_id", "component_id", "rate_hz", "sectors",
                              "sensor", "range_m", "radius_m"},
                             kRemove);
    read_link(table, config);
    config.system_id = static_cast<std::uint8_t>(whole_or(table, "system_id", 1, 1, UINT8_MAX));
    config.component_id = static_cast<std::uint8_t>(
        whole_or(table, "component_id", GPOM_MAVLINK_COMPONENT_ID, 1, UINT8_MAX));
    const double rate_hz = number_or(table, "rate_hz", 10.0, {1.0, 100.0});
    config.period_us = microseconds(1.0 / rate_hz);
    config.sensor = table.has("sensor") ? choice_of(table, "sensor", kSensors) : GPOM_MAVLINK_LASER;
    read_sectors(table, config);
    check_rate(table, config, rate_hz);
}

} // namespace gpomd
