#include "ports/linux/config/config.hpp"

#include "ports/host/params_toml.hpp"
#include "ports/host/toml_table.hpp"
#include "ports/linux/base/network.hpp"
#include "ports/linux/config/grid_corner.hpp"
#include "ports/linux/config/values.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

namespace gpomd
{

namespace
{

using gpom_tools::TomlTable;

/// Copy a word into a fixed array. Refuse a word that does not fit.
template <std::size_t N>
void copy_word(const TomlTable &table, const std::string &key, const std::string &word,
               char (&target)[N])
{
    if (word.size() >= N) {
        table.fail(key, key + ": longer than " + std::to_string(N - 1) + " characters");
    }
    std::memcpy(target, word.c_str(), word.size() + 1);
}

/// A channel's name, or the default for an absent key. liblcm reads the names that it subscribes to
/// as regular expressions. So only characters without a special meaning are allowed.
void read_channel(const TomlTable &table, const std::string &key, const std::string &otherwise,
                  ChannelName &channel)
{
    const std::string word = table.has(key) ? table.word(key) : otherwise;
    const bool is_plain = std::all_of(word.begin(), word.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || std::strchr("_-/.:#", c) != nullptr;
    });
    if (!is_plain || (word.empty() && !otherwise.empty())) {
        table.fail(key, key + ": must be a channel's name of letters, digits and _-/.:#");
    }
    copy_word(table, key, word, channel);
}

/// The word of a key, or the default for an absent key.
template <std::size_t N>
void read_word(const TomlTable &table, const std::string &key, const std::string &otherwise,
               char (&target)[N])
{
    copy_word(table, key, table.has(key) ? table.word(key) : otherwise, target);
}

std::uint32_t count_or(const TomlTable &table, const std::string &key, std::uint32_t otherwise,
                       std::int64_t low, std::int64_t high)
{
    return static_cast<std::uint32_t>(whole_or(table, key, otherwise, low, high));
}

/// Largest value of a position or an angle. Everything computed from it is finite. Beyond it, float
/// steps are much coarser than a cell.
constexpr double kTupleMax = 1e9;

/// A list of exactly `n` numbers, all within kTupleMax.
std::vector<double> tuple(const TomlTable &table, const std::string &key, std::size_t n)
{
    std::vector<double> values = table.numbers(key);
    const bool is_small = std::all_of(values.begin(), values.end(), [](double value) {
        return std::fabs(value) <= kTupleMax; // false for NaN
    });
    if (values.size() != n || !is_small) {
        table.fail(key, key + ": must be a list of " + std::to_string(n) +
                            " finite numbers of at most 1e9");
    }
    return values;
}

constexpr Named<ScanType> kScanTypes[] = {{"gpom.scan_t", ScanType::gpom_scan},
                                          {"bot_core.planar_lidar_t", ScanType::planar_lidar},
                                          {"mbot_lcm_msgs.lidar_t", ScanType::lidar}};
constexpr Named<PoseType> kPoseTypes[] = {{"bot_core.pose_t", PoseType::bot_pose},
                                          {"mbot_lcm_msgs.pose2D_t", PoseType::pose2d}};

constexpr Named<JumpRule> kJumpRules[] = {{"none", JumpRule::none},
                                          {"keep", JumpRule::keep},
                                          {"forget", JumpRule::forget},
                                          {"clear", JumpRule::clear}};

void read_masks(const TomlTable &table, SensorConfig &config)
{
    config.sensor.masks = config.masks;
    if (!table.has("masks")) {
        return;
    }
    const std::vector<std::vector<double>> masks = table.number_lists("masks");
    if (masks.size() > kMasksMax) {
        table.fail("masks", "masks: more than " + std::to_string(kMasksMax));
    }
    for (const std::vector<double> &mask : masks) {
        if (mask.size() != 2 || !(std::fabs(mask[0]) <= 10.0 && std::fabs(mask[1]) <= 10.0)) {
            table.fail("masks", "masks: each must be [from, to], bearings in rad");
        }
        config.masks[config.sensor.n_masks++] = {static_cast<float>(mask[0]),
                                                 static_cast<float>(mask[1])};
    }
}

/// True if readings of a kind mean "no return". False: they are ignored.
bool is_no_return(const TomlTable &table, const char *key)
{
    const std::string meaning = table.has(key) ? table.word(key) : "ignore";
    if (meaning != "ignore" && meaning != "no_return") {
        table.fail(key, std::string(key) + ": \"" + meaning + "\" is not one of ignore, no_return");
    }
    return meaning == "no_return";
}

void read_sensor(const TomlTable &table, SensorConfig &config)
{
    table.refuse_keys_beyond({"channel", "type", "id", "mount", "range_min_m", "range_max_m",
                              "range_sd_m", "upside_down", "masks", "latency_s", "gap_max_s",
                              "no_return", "zero", "too_near"},
                             kRemove);
    config.type = choice_of(table, "type", kScanTypes);
    const bool is_own = config.type == ScanType::gpom_scan;
    read_channel(table, "channel", is_own ? "GPOM_SCAN" : "LIDAR", config.channel);
    if (table.has("id") && !is_own) {
        table.fail("id", "id: only gpom.scan_t carries one; remove it");
    }
    config.id = static_cast<std::uint16_t>(count_or(table, "id", 0, 0, UINT16_MAX));
    gpom_sensor_init(&config.sensor);
    if (table.has("mount")) {
        const std::vector<double> mount = tuple(table, "mount", 3);
        config.sensor.x_m = mount[0];
        config.sensor.y_m = mount[1];
        config.sensor.yaw_rad = mount[2];
    }
    const double range_min_m =
        number_or(table, "range_min_m", double{config.sensor.range_min_m}, {0.0, GPOM_REACH_M});
    const double range_max_m = number_in(table, "range_max_m", {1e-3, GPOM_REACH_M});
    if (!(range_max_m > range_min_m)) {
        table.fail("range_max_m", "range_max_m: must be over range_min_m");
    }
    config.sensor.range_min_m = static_cast<float>(range_min_m);
    config.sensor.range_max_m = static_cast<float>(range_max_m);
    const double range_sd_m = number_or(table, "range_sd_m", 0.0, {0.0, 1e3});
    config.sensor.range_var_m2 = static_cast<float>(range_sd_m * range_sd_m);
    config.sensor.upside_down = truth_or(table, "upside_down", false) ? 1 : 0;
    const std::string no_return = table.has("no_return") ? table.word("no_return") : "free";
    if (no_return != "free" && no_return != "ignore") {
        table.fail("no_return", "no_return: \"" + no_return + "\" is not one of free, ignore");
    }
    config.ignores_no_return = no_return == "ignore";
    const bool is_zero = is_no_return(table, "zero");
    const bool is_too_near = is_no_return(table, "too_near");
    config.sensor.zero_is_no_return = is_zero && !config.ignores_no_return ? 1 : 0;
    config.sensor.too_near_is_no_return = is_too_near && !config.ignores_no_return ? 1 : 0;
    config.latency_us = seconds_or(table, "latency_s", 0.0, {-10.0, 10.0});
    config.gap_max_us = seconds_or(table, "gap_max_s", 1.0, {1e-3, 3600.0});
    read_masks(table, config);
}

void read_pose(const TomlTable &root, PoseConfig &config)
{
    if (!root.has("pose")) {
        return;
    }
    const TomlTable table = root.table("pose");
    table.refuse_keys_beyond({"channel", "type", "sd", "gap_max_s", "wait_max_s", "hold_s"},
                             kRemove);
    config.type = table.has("type") ? choice_of(table, "type", kPoseTypes) : PoseType::bot_pose;
    read_channel(table, "channel", "POSE", config.channel);
    if (table.has("sd")) {
        const std::vector<double> sd = tuple(table, "sd", 3);
        for (std::size_t i = 0; i < 3; ++i) {
            if (!(sd[i] >= 0.0 && sd[i] <= 1e3)) {
                table.fail("sd", "sd: standard deviations of x, y [m], yaw [rad], 0 to 1000");
            }
            config.cov[4 * i] = static_cast<float>(sd[i] * sd[i]);
        }
    }
    config.gap_max_us = seconds_or(table, "gap_max_s", 0.5, {1e-3, 60.0});
    config.wait_max_us = seconds_or(table, "wait_max_s", 0.5, {0.0, 60.0});
    config.hold_max_us = seconds_or(table, "hold_s", 0.0, {0.0, 1e6});
}

void read_jump(const TomlTable &root, JumpConfig &jump)
{
    jump = {JumpRule::keep, 2.0, 40.0, 4.0, 6.0, 20.0};
    if (!root.has("jump")) {
        return;
    }
    const TomlTable table = root.table("jump");
    table.refuse_keys_beyond(
        {"rule", "distance_m", "speed_mps", "turn_rad", "turn_radps", "forget_m"}, kRemove);
    jump.rule = table.has("rule") ? choice_of(table, "rule", kJumpRules) : jump.rule;
    jump.distance_m = number_or(table, "distance_m", jump.distance_m, {1e-3, 1e6});
    jump.speed_mps = number_or(table, "speed_mps", jump.speed_mps, {0.0, 1e3});
    jump.turn_rad = number_or(table, "turn_rad", jump.turn_rad, {1e-3, 10.0});
    jump.turn_radps = number_or(table, "turn_radps", jump.turn_radps, {0.0, 1e3});
    jump.forget_m = number_or(table, "forget_m", jump.forget_m, {1e-3, GPOM_REACH_M});
}

/// Sensors on one channel must have different ids. Sensors without poses need a pose channel.
void check_sensor(const TomlTable &table, const Config &config)
{
    const SensorConfig &last = config.sensors[config.n_sensors - 1];
    if (last.type != ScanType::gpom_scan && config.pose.channel[0] == '\0') {
        table.fail("type", "type: scans of this type carry no pose; add a [pose] table");
    }
    if (std::strcmp(config.pose.channel, last.channel) == 0) {
        table.fail("channel", "channel: is also pose.channel; a channel has one type");
    }
    for (std::size_t i = 0; i + 1 < config.n_sensors; ++i) {
        const SensorConfig &other = config.sensors[i];
        if (std::strcmp(other.channel, last.channel) != 0) {
            continue;
        }
        if (other.type != last.type || last.type != ScanType::gpom_scan) {
            table.fail("channel", "channel: is also that of sensor[" + std::to_string(i) +
                                      "]; only gpom.scan_t may share one");
        }
        if (other.id == last.id) {
            table.fail("id",
                       "id: is also that of sensor[" + std::to_string(i) + "] on this channel");
        }
    }
}

void read_sensors(const TomlTable &root, Config &config)
{
    const std::vector<TomlTable> tables = root.tables("sensor");
    if (tables.size() > kSensorsMax) {
        root.fail("sensor", "sensor: more than " + std::to_string(kSensorsMax));
    }
    for (const TomlTable &table : tables) {
        read_sensor(table, config.sensors[config.n_sensors++]);
        check_sensor(table, config);
    }
}

void read_raster(const TomlTable &root, gpom_config_t &map)
{
    const TomlTable table = root.table("raster");
    table.refuse_keys_beyond({"cell_m", "nx", "ny", "corner", "reach_m", "unknown"}, kRemove);
    map.lowres_cell_m = number_in(table, "cell_m", {1e-3, 1e6});
    map.lowres_nx = static_cast<std::uint16_t>(table.whole("nx", 1, INT16_MAX));
    map.lowres_ny = static_cast<std::uint16_t>(table.whole("ny", 1, INT16_MAX));
    const std::uint32_t n_tiles_x = (map.lowres_nx + kTileNx - 1) / kTileNx;
    const std::uint32_t n_tiles_y = (map.lowres_ny + kTileNy - 1) / kTileNy;
    if (n_tiles_x * n_tiles_y > kTilesMax) {
        table.fail("nx", "nx: a raster of so many cells cannot be published; make cells larger");
    }
    map.lowres_rolling = table.has("corner") ? 0 : 1;
    if (table.has("corner")) {
        const std::vector<double> corner = tuple(table, "corner", 2);
        map.lowres_x0_m = corner[0];
        map.lowres_y0_m = corner[1];
    }
    map.lowres_reach_m = static_cast<float>(number_or(table, "reach_m", 0.0, {0.0, GPOM_REACH_M}));
    map.lowres_unknown = static_cast<float>(
        number_or(table, "unknown", static_cast<double>(map.lowres_unknown), {0.0, 1.0}));
}

void read_map(const TomlTable &root, Config &config)
{
    gpom_config_t &map = config.map;
    const TomlTable table = root.table("map");
    table.refuse_keys_beyond(
        {"beam_max", "keep_m", "clear_scans", "late_m", "far_m", "old_s", "rebase_m", "origin"},
        kRemove);
    map.beam_max = count_or(table, "beam_max", 20000, 1, GPOM_BEAM_MAX);
    map.keep_m = static_cast<float>(number_or(table, "keep_m", 0.1, {0.0, 1e3}));
    if (map.keep_m > 0.0f && map.keep_m < 1e-3f) {
        table.fail("keep_m", "keep_m: must be 0 or at least 0.001");
    }
    map.clear_scans = count_or(table, "clear_scans", map.keep_m > 0.0f ? 3 : 0, 0, 4);
    if (map.clear_scans == 1 || (map.clear_scans > 0 && !(map.keep_m > 0.0f))) {
        table.fail("clear_scans", "clear_scans: must be 0, or 2 to 4 with keep_m over 0");
    }
    config.late_m = static_cast<float>(number_or(table, "late_m", 0.0, {0.0, 1e3}));
    if (config.late_m > 0.0f && config.late_m < 1e-3f) {
        table.fail("late_m", "late_m: must be 0 or at least 0.001");
    }
    map.far_m = static_cast<float>(number_or(table, "far_m", 0.0, {0.0, 1e6}));
    map.old_s = static_cast<float>(number_or(table, "old_s", 0.0, {0.0, 1e9}));
    map.rebase_m = static_cast<float>(number_or(table, "rebase_m", 0.0, {0.0, GPOM_REACH_M / 2.0}));
    if (map.rebase_m > 0.0f && map.params.frame == GPOM_FRAME_MAP) {
        table.fail("rebase_m",
                   "rebase_m: parameters whose frame is \"map\" do not allow it; remove it");
    }
    if (table.has("origin")) {
        const std::vector<double> origin = tuple(table, "origin", 2);
        map.origin_x_m = origin[0];
        map.origin_y_m = origin[1];
    }
}

void read_intake(const TomlTable &root, Config &config)
{
    config.intake = {2048, 64, 1000000, 0};
    const gpom_params_t &params = config.map.params;
    config.step_ops = 16 * GPOM_LOWRES_BATCH_OPS(params.n_hits + params.n_free);
    if (root.has("intake")) {
        const TomlTable table = root.table("intake");
        table.refuse_keys_beyond(
            {"ranges_max", "queue_scans", "ahead_max_s", "age_max_s", "step_ops"}, kRemove);
        IntakeConfig &intake = config.intake;
        intake.ranges_max = count_or(table, "ranges_max", intake.ranges_max, 1, GPOM_RANGES_MAX);
        intake.queue_scans = count_or(table, "queue_scans", intake.queue_scans, 2, 4096);
        intake.ahead_max_us = seconds_or(table, "ahead_max_s", 1.0, {0.0, 1e6});
        intake.age_max_us = seconds_or(table, "age_max_s", 0.0, {0.0, 1e9});
        if (table.has("step_ops")) {
            const std::uint64_t least = GPOM_STEP_OPS_MIN(params.n_hits + params.n_free);
            config.step_ops = static_cast<std::uint64_t>(
                table.whole("step_ops", static_cast<std::int64_t>(least), INT64_C(1000000000000)));
        }
    }
}

/// Queries on a network that no datagram leaves need no CRC-32, unless the configuration asks for
/// it.
bool is_local(const char *url)
{
    Network network;
    return parse_network(url, network) && network.ttl == 0;
}

void read_publish(const TomlTable &root, Config &config)
{
    PublishConfig &publish = config.publish;
    static const toml::table kNone;
    const TomlTable table =
        root.has("publish") ? root.table("publish") : TomlTable("", kNone, "publish");
    table.refuse_keys_beyond({"map", "request", "status", "query", "answer", "grid", "pixels",
                              "distances", "distances_hz", "map_hz", "keyframe_s", "grid_s",
                              "status_s", "stale_s", "query_crc_optional"},
                             kRemove);
    read_channel(table, "map", "GPOM_MAP", publish.map);
    read_channel(table, "request", "GPOM_MAP_REQUEST", publish.request);
    read_channel(table, "status", "GPOM_STATUS", publish.status);
    read_channel(table, "query", "GPOM_QUERY", publish.query);
    read_channel(table, "answer", "GPOM_ANSWER", publish.answer);
    read_channel(table, "grid", "", publish.grid);
    read_channel(table, "pixels", "", publish.pixels);
    read_channel(table, "distances", "", publish.distances);
    publish.distances_period_us =
        std::llround(1e6 / number_or(table, "distances_hz", 5.0, {0.01, 1000.0}));
    if (publish.distances[0] != '\0' && distance_tile_count(config.map) > kTilesMax) {
        table.fail("distances", "distances: a raster of so many cells cannot be published; make "
                                "cells larger");
    }
    publish.is_query_crc_optional = truth_or(table, "query_crc_optional", is_local(config.lcm_url));
    publish.map_period_us = std::llround(1e6 / number_or(table, "map_hz", 20.0, {0.01, 1000.0}));
    publish.keyframe_period_us = seconds_or(table, "keyframe_s", 5.0, {0.05, 1e6});
    publish.grid_period_us = seconds_or(table, "grid_s", 1.0, {0.05, 1e6});
    publish.status_period_us = seconds_or(table, "status_s", 1.0, {0.05, 60.0});
    publish.stale_after_us = seconds_or(table, "stale_s", 1.0, {0.05, 1e6});
}

/// Refuse a fixed raster whose corner float32 cannot hold. MBot's maps would be shifted.
void check_grid(const TomlTable &root, const Config &config)
{
    const gpom_config_t &map = config.map;
    const bool is_fixed = map.lowres_rolling == 0;
    if (config.publish.grid[0] != '\0' && is_fixed &&
        (grid_margin(map.lowres_x0_m, map.lowres_cell_m) > kGridMarginMax ||
         grid_margin(map.lowres_y0_m, map.lowres_cell_m) > kGridMarginMax)) {
        root.table("raster").fail("corner", "corner: publish.grid is in float32, which cannot hold "
                                            "this corner; use whole metres");
    }
}

/// gpomd must not read what it sends, and must not send two types on one channel.
void check_channels(const TomlTable &root, const Config &config)
{
    struct Field {
        std::string name;
        const char *channel;
    };
    const PublishConfig &publish = config.publish;
    std::vector<Field> fields = {{"pose.channel", config.pose.channel}};
    for (std::size_t i = 0; i < config.n_sensors; ++i) {
        fields.push_back({"sensor[" + std::to_string(i) + "].channel", config.sensors[i].channel});
    }
    for (const Field &field :
         {Field{"request", publish.request}, Field{"query", publish.query},
          Field{"map", publish.map}, Field{"status", publish.status},
          Field{"answer", publish.answer}, Field{"grid", publish.grid},
          Field{"pixels", publish.pixels}, Field{"distances", publish.distances}}) {
        for (const Field &other : fields) {
            if (field.channel[0] == '\0' || std::strcmp(field.channel, other.channel) != 0) {
                continue;
            }
            const std::string text = ": is also " + other.name + "; a channel has one type";
            if (root.has("publish")) {
                root.table("publish").fail(field.name, field.name + text);
            }
            root.fail("publish", "publish." + field.name + text);
        }
        fields.push_back({"publish." + field.name, field.channel});
    }
}

std::string beside(const std::string &path, const std::string &name)
{
    const std::size_t slash = path.rfind('/');
    const bool is_whole = name.empty() || name[0] == '/' || slash == std::string::npos;
    return is_whole ? name : path.substr(0, slash + 1) + name;
}

void read_snapshot(const TomlTable &root, const std::string &path, Config &config)
{
    if (!root.has("snapshot")) {
        return;
    }
    const TomlTable table = root.table("snapshot");
    table.refuse_keys_beyond({"path", "period_s"}, kRemove);
    const std::string name = table.has("path") ? table.word("path") : "/var/lib/gpom/map";
    copy_word(table, "path", beside(path, name), config.snapshot_path);
    config.snapshot_period_us = seconds_or(table, "period_s", 10.0, {0.1, 1e6});
}

/// Refuse whatever else the library refuses.
void check_map(const TomlTable &root, const gpom_config_t &map)
{
    const char *problem = nullptr;
    if (gpom_config_check(&map, &problem) != GPOM_OK) {
        root.fail("map", "map: " + std::string(problem != nullptr ? problem : "out of range"));
    }
}

} // namespace

void read_config(const char *path, Config &config)
{
    const toml::table file = gpom_tools::parse_toml(path, "configuration");
    const TomlTable root(path, file);
    root.refuse_keys_beyond({"params", "lcm_url", "sensor", "pose", "jump", "map", "raster",
                             "intake", "publish", "snapshot", "can", "mavlink"},
                            kRemove);
    config = Config{};
    gpom_config_init(&config.map);
    const std::string params_path = beside(path, root.word("params"));
    try {
        config.map.params = gpom_tools::read_params(params_path);
    } catch (const gpom_tools::FileError &error) {
        if (error.line > 0) {
            throw;
        }
        root.fail("params", "params: " + std::string(error.what()));
    }
    read_word(root, "lcm_url", "udpm://239.255.76.67:7667?ttl=0", config.lcm_url);
    if (!is_multicast_url(config.lcm_url)) {
        root.fail("lcm_url", "lcm_url: must be udpm://ADDRESS:PORT?ttl=0");
    }
    if (const char *const problem = url_problem(config.lcm_url); problem != nullptr) {
        root.fail("lcm_url", std::string("lcm_url: ") + problem);
    }
    read_map(root, config);
    read_raster(root, config.map);
    check_map(root, config.map);
    read_pose(root, config.pose);
    read_jump(root, config.jump);
    read_sensors(root, config);
    read_intake(root, config);
    read_publish(root, config);
    check_channels(root, config);
    check_grid(root, config);
    read_snapshot(root, path, config);
    read_can(root, config.can);
    read_mavlink(root, config.mavlink);
}

} // namespace gpomd
