#include "ports/linux/config/can_config.hpp"

#include "ports/host/toml_table.hpp"
#include "ports/linux/config/values.hpp"

#include <linux/can.h>

#include <cmath>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

namespace gpomd
{

namespace
{

using gpom_tools::TomlTable;

/// An identifier as in struct can_frame. An identifier over 0x7FF has 29 bits.
std::uint32_t identifier(const TomlTable &table, const std::string &key, std::uint32_t otherwise)
{
    const auto id = static_cast<std::uint32_t>(
        whole_or(table, key, static_cast<std::int64_t>(otherwise), 0, CAN_EFF_MASK));
    return id > CAN_SFF_MASK ? id | CAN_EFF_FLAG : id;
}

/// Position and length of a bit field: keys start, length and order.
gpom_can_signal_t read_bits(const TomlTable &table, std::int64_t n_bits_max)
{
    gpom_can_signal_t signal = {};
    signal.start_bit =
        static_cast<std::uint16_t>(table.whole("start", 0, 8 * GPOM_CAN_BYTES_MAX - 1));
    signal.n_bits = static_cast<std::uint8_t>(table.whole("length", 1, n_bits_max));
    const std::string order = table.has("order") ? table.word("order") : "intel";
    if (order != "intel" && order != "motorola") {
        table.fail("order", "order: \"" + order + "\" is not one of intel, motorola");
    }
    signal.is_motorola = order == "motorola";
    signal.factor = 1.0;
    if (gpom_can_signal_bytes(&signal) == 0) {
        table.fail("length", "length: the signal would reach beyond 64 bytes; check start, length "
                             "and order");
    }
    return signal;
}

/// Number of the message with the identifier under `id`. n_messages: there is none.
std::size_t find_message(const TomlTable &table, const CanConfig &config)
{
    table.whole("id", 0, CAN_EFF_MASK); // the key is required
    const std::uint32_t id = identifier(table, "id", 0);
    std::size_t i = 0;
    while (i < config.n_messages && config.messages[i].id != id) {
        ++i;
    }
    return i;
}

/// Length of the longest frame on the bus.
std::size_t bytes_max(const CanConfig &config)
{
    return config.has_fd ? GPOM_CAN_BYTES_MAX : GPOM_CAN_CLASSIC_BYTES;
}

CanSignalConfig read_signal(const TomlTable &odometry, const std::string &key, CanConfig &config)
{
    const TomlTable table = odometry.table(key);
    table.refuse_keys_beyond(
        {"id", "start", "length", "order", "signed", "factor", "offset", "absent"}, kRemove);
    CanSignalConfig signal = {};
    signal.i_message = find_message(table, config);
    if (signal.i_message == config.n_messages) {
        config.messages[config.n_messages++].id = identifier(table, "id", 0);
    }
    signal.signal = read_bits(table, 64);
    signal.signal.is_signed = truth_or(table, "signed", false);
    signal.signal.factor = number_or(table, "factor", 1.0, {-1e9, 1e9});
    signal.signal.offset = number_or(table, "offset", 0.0, {-1e9, 1e9});
    if (gpom_can_signal_bytes(&signal.signal) > bytes_max(config)) {
        table.fail("start", "start: the signal reaches beyond 8 bytes: needs CAN FD; set can.fd = "
                            "true");
    }
    if (signal.signal.factor == 0.0) {
        table.fail("factor", "factor: must not be 0");
    }
    signal.has_absent = table.has("absent");
    const std::int64_t most =
        signal.signal.n_bits < 63 ? (std::int64_t{1} << signal.signal.n_bits) - 1 : INT64_MAX;
    signal.absent = static_cast<std::uint64_t>(whole_or(table, "absent", 0, 0, most));
    return signal;
}

void read_counter(const TomlTable &message, gpom_can_protection_t &protection)
{
    if (!message.has("counter")) {
        return;
    }
    const TomlTable table = message.table("counter");
    table.refuse_keys_beyond({"start", "length", "order", "max"}, kRemove);
    protection.has_counter = true;
    protection.counter = read_bits(table, 31);
    const std::int64_t most = (std::int64_t{1} << protection.counter.n_bits) - 1;
    protection.counter_max = static_cast<std::uint32_t>(whole_or(table, "max", most, 1, most));
}

void read_crc(const TomlTable &table, gpom_can_protection_t &protection)
{
    if (!table.has("crc")) {
        for (const char *const key : {"crc_byte", "data_id"}) {
            if (table.has(key)) {
                table.fail(key, std::string(key) + ": without crc; add crc = \"j1850\" or \"e2e\"");
            }
        }
        return;
    }
    const std::string word = table.word("crc");
    if (word != "j1850" && word != "e2e") {
        table.fail("crc", "crc: \"" + word + "\" is not one of j1850, e2e");
    }
    const std::uint8_t ends = word == "j1850" ? 0xFF : 0;
    protection.has_crc = true;
    protection.crc = {ends, ends};
    protection.i_crc_byte = static_cast<std::uint8_t>(
        table.whole("crc_byte", 0, static_cast<std::int64_t>(GPOM_CAN_BYTES_MAX) - 1));
    protection.data_id = static_cast<std::uint16_t>(table.whole("data_id", 0, UINT16_MAX));
}

/// A message must contain every field that is read from it.
void check_message(const TomlTable &table, const CanConfig &config, std::size_t i_message)
{
    const CanMessageConfig &message = config.messages[i_message];
    const std::size_t n_bytes = message.n_bytes > 0 ? message.n_bytes : bytes_max(config);
    if (n_bytes > bytes_max(config)) {
        table.fail("bytes", "bytes: more than 8 need CAN FD; set can.fd = true");
    }
    for (const CanSignalConfig &signal : config.signals) {
        const std::size_t n_needed = gpom_can_signal_bytes(&signal.signal);
        if (signal.i_message == i_message && n_needed > n_bytes) {
            table.fail("bytes",
                       "bytes: a signal of this message needs " + std::to_string(n_needed));
        }
    }
    const std::string room = " is beyond the message's " + std::to_string(n_bytes) + " bytes";
    if (message.protection.has_crc && message.protection.i_crc_byte >= n_bytes) {
        table.fail("crc_byte", "crc_byte:" + room);
    }
    if (message.protection.has_counter &&
        gpom_can_signal_bytes(&message.protection.counter) > n_bytes) {
        table.fail("counter", "counter:" + room);
    }
}

/// Read [[can.odometry.message]]: how messages are protected.
void read_messages(const TomlTable &odometry, CanConfig &config)
{
    if (!odometry.has("message")) {
        return;
    }
    bool is_read[kCanMessagesMax] = {};
    for (const TomlTable &table : odometry.tables("message")) {
        table.refuse_keys_beyond({"id", "bytes", "crc", "crc_byte", "data_id", "counter"}, kRemove);
        const std::size_t i_message = find_message(table, config);
        if (i_message == config.n_messages) {
            table.fail("id", "id: no signal of the odometry is in this message; remove it");
        }
        if (is_read[i_message]) {
            table.fail("id", "id: an earlier message has the same id; write both as one");
        }
        is_read[i_message] = true;
        CanMessageConfig &message = config.messages[i_message];
        message.n_bytes =
            static_cast<std::size_t>(whole_or(table, "bytes", 0, 1, GPOM_CAN_BYTES_MAX));
        read_crc(table, message.protection);
        read_counter(table, message.protection);
        check_message(table, config, i_message);
    }
}

void read_odometry(const TomlTable &can, CanConfig &config)
{
    if (!can.has("odometry")) {
        return;
    }
    const TomlTable table = can.table("odometry");
    table.refuse_keys_beyond({"speed", "yaw_rate", "left", "right", "track_m", "message",
                              "timeout_s", "latency_s", "carry_s", "speed_scale_sd",
                              "yaw_rate_bias_sd", "speed_noise", "yaw_rate_noise"},
                             kRemove);
    config.is_wheels = table.has("left") || table.has("right");
    config.has_odometry = config.is_wheels || table.has("speed") || table.has("yaw_rate");
    if (config.is_wheels && (table.has("speed") || table.has("yaw_rate"))) {
        table.fail("left", "left: give either speed and yaw_rate, or left and right");
    }
    if (config.is_wheels) {
        config.track_m = number_in(table, "track_m", {0.01, 100.0});
    } else if (table.has("track_m")) {
        table.fail("track_m", "track_m: only with left and right; remove it");
    }
    if (config.has_odometry) {
        config.signals[0] = read_signal(table, config.is_wheels ? "left" : "speed", config);
        config.signals[1] = read_signal(table, config.is_wheels ? "right" : "yaw_rate", config);
    }
    read_messages(table, config); // also refuses messages without a signal
    config.latency_us = seconds_or(table, "latency_s", 0.0, {-10.0, 10.0});
    OdometryConfig &odometry = config.odometry;
    odometry.timeout_us = seconds_or(table, "timeout_s", 0.2, {0.001, 10.0});
    odometry.carry_us = seconds_or(table, "carry_s", 5.0, {0.01, 60.0});
    odometry.speed_scale_sd = number_or(table, "speed_scale_sd", 0.02, {0.0, 1.0});
    odometry.yaw_rate_bias_sd = number_or(table, "yaw_rate_bias_sd", 0.005, {0.0, 10.0});
    odometry.speed_noise = number_or(table, "speed_noise", 0.01, {0.0, 10.0});
    odometry.yaw_rate_noise = number_or(table, "yaw_rate_noise", 0.001, {0.0, 10.0});
}

/// Read `NAME_hz` and `NAME_id`. 0 Hz: the message is not sent.
CanSendConfig read_send(const TomlTable &table, const std::string &name, double otherwise_hz,
                        std::uint32_t otherwise_id)
{
    constexpr double kLeast_hz = 0.001;
    const double hz = number_or(table, name + "_hz", otherwise_hz, {0.0, 100.0});
    if (hz > 0.0 && hz < kLeast_hz) {
        table.fail(name + "_hz", name + "_hz: must be 0 or at least 0.001");
    }
    return {identifier(table, name + "_id", otherwise_id), hz > 0.0 ? microseconds(1.0 / hz) : 0};
}

/// Refuse two messages with the same identifier.
void check_ids(const TomlTable &can, const TomlTable &table, const CanConfig &config)
{
    const struct {
        const char *key;
        const CanSendConfig &to;
    } sent[] = {{"status_id", config.status},
                {"clearance_id", config.clearance},
                {"clearance_fd_id", config.clearance_fd},
                {"tile_id", config.tile}};
    for (std::size_t i = 0; i < std::size(sent); ++i) {
        const std::string key = sent[i].key;
        for (std::size_t j = 0; j < std::size(sent); ++j) {
            if (i != j && table.has(key) && sent[i].to.id == sent[j].to.id &&
                sent[i].to.period_us > 0 && sent[j].to.period_us > 0) {
                table.fail(key, key + ": two messages would have one identifier; it is also " +
                                    sent[j].key);
            }
        }
        for (std::size_t j = 0; j < config.n_messages; ++j) {
            if (sent[i].to.period_us == 0 || sent[i].to.id != config.messages[j].id) {
                continue;
            }
            const std::string text = key + ": an identifier that is sent is one of the odometry's";
            if (can.has("publish")) {
                table.fail(key, text);
            }
            can.fail("odometry", "publish." + text);
        }
    }
}

/// Refuse rasters that tiles cannot describe: a tile's place is in whole cells from the map frame's
/// origin, and the side of a cell is in centimetres.
void check_tiles(const TomlTable &root, const TomlTable &table)
{
    const TomlTable raster = root.table("raster");
    const double cell_m = raster.number("cell_m");
    const auto is_multiple = [](double value_m, double unit_m) {
        return std::fabs(value_m / unit_m - std::round(value_m / unit_m)) < 1e-6;
    };
    if (!is_multiple(cell_m, 0.01) || cell_m > 2.551) {
        table.fail("tile_hz", "tile_hz: tiles need a raster.cell_m of whole centimetres, at most "
                              "2.55 m");
    }
    if (raster.has("corner")) {
        for (const double corner_m : raster.numbers("corner")) {
            if (!is_multiple(corner_m, cell_m)) {
                table.fail("tile_hz", "tile_hz: tiles need a raster.corner at whole multiples of "
                                      "cell_m");
            }
        }
    }
}

void read_sending(const TomlTable &root, const TomlTable &can, CanConfig &config)
{
    static const toml::table kNone;
    const TomlTable table =
        can.has("publish") ? can.table("publish") : TomlTable("", kNone, "can.publish");
    table.refuse_keys_beyond({"status_hz", "status_id", "clearance_hz", "clearance_id",
                              "clearance_fd_hz", "clearance_fd_id", "tile_hz", "tile_id", "range_m",
                              "radius_m", "tiles_beside"},
                             kRemove);
    config.status = read_send(table, "status", 10.0, GPOM_CAN_STATUS_ID);
    config.clearance = read_send(table, "clearance", 10.0, GPOM_CAN_CLEARANCE_ID);
    config.clearance_fd = read_send(table, "clearance_fd", 0.0, GPOM_CAN_CLEARANCE_FD_ID);
    config.tile = read_send(table, "tile", 0.0, GPOM_CAN_TILE_ID);
    config.range_m = static_cast<float>(number_or(table, "range_m", 25.0, {0.1, 25.3}));
    config.radius_m = static_cast<float>(number_or(table, "radius_m", 0.5, {0.0, 20.0}));
    config.tiles_beside = static_cast<std::int32_t>(whole_or(table, "tiles_beside", 2, 0, 7));
    check_ids(can, table, config);
    for (const char *const key : {"clearance_fd_hz", "tile_hz"}) {
        if (table.has(key) && table.number(key) > 0.0 && !config.has_fd) {
            table.fail(key, std::string(key) + ": needs CAN FD; set can.fd = true or remove it");
        }
    }
    if (config.tile.period_us > 0) {
        check_tiles(root, table);
    }
}

} // namespace

void read_can(const TomlTable &root, CanConfig &config)
{
    if (!root.has("can")) {
        return;
    }
    const TomlTable table = root.table("can");
    table.refuse_keys_beyond({"interface", "fd", "receive_bytes", "odometry", "publish"}, kRemove);
    const std::string name = table.has("interface") ? table.word("interface") : "can0";
    if (name.empty() || name.size() >= sizeof config.interface) {
        table.fail("interface", "interface: must be a name of 1 to " +
                                    std::to_string(sizeof config.interface - 1) + " characters");
    }
    std::memcpy(config.interface, name.c_str(), name.size() + 1);
    config.has_fd = truth_or(table, "fd", false);
    config.receive_bytes =
        static_cast<std::uint32_t>(whole_or(table, "receive_bytes", 1 << 20, 4096, 1 << 26));
    read_odometry(table, config);
    read_sending(root, table, config);
}

} // namespace gpomd
