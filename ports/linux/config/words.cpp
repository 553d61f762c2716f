#include "ports/linux/config/words.hpp"

#include "ports/linux/base/clock.hpp"

#include <arpa/inet.h>

#include <cinttypes>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace gpomd
{

namespace
{

constexpr const char *kCanRemedy = "`candump` shows the frames; compare [can.odometry] with them";
constexpr const char *kCanBusRemedy =
    "`ip -details -statistics link show` says more; docs/counters.md lists causes";
constexpr const char *kForeignRemedy =
    "another program sends other data to LCM's address and port; give LCM another port";
constexpr const char *kFragmentRemedy =
    "the network loses datagrams, or several senders have one address and port";

struct TypeName {
    std::uint64_t fingerprint;
    const char *name;
};

constexpr TypeName kTypes[] = {
    {GPOM_WIRE_SCAN_FINGERPRINT, "gpom.scan_t"},
    {GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT, "bot_core.planar_lidar_t"},
    {GPOM_WIRE_LIDAR_FINGERPRINT, "mbot_lcm_msgs.lidar_t"},
    {GPOM_WIRE_BOT_POSE_FINGERPRINT, "bot_core.pose_t"},
    {GPOM_WIRE_POSE2D_FINGERPRINT, "mbot_lcm_msgs.pose2D_t"},
    {GPOM_WIRE_MAP_FINGERPRINT, "gpom.map_t"},
    {GPOM_WIRE_STATUS_FINGERPRINT, "gpom.status_t"},
    {GPOM_WIRE_QUERY_FINGERPRINT, "gpom.query_t"},
    {GPOM_WIRE_ANSWER_FINGERPRINT, "gpom.answer_t"},
    {GPOM_WIRE_OCCUPANCY_GRID_FINGERPRINT, "mbot_lcm_msgs.occupancy_grid_t"},
    {GPOM_WIRE_PIXEL_MAP_FINGERPRINT, "occ_map.pixel_map_t"}};

[[gnu::format(printf, 1, 2)]] std::string text(const char *format, ...)
{
    char line[600];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    return line;
}

double seconds(std::int64_t time_us) { return 1e-6 * static_cast<double>(time_us); }

std::string type_name(std::uint64_t fingerprint)
{
    for (const TypeName &type : kTypes) {
        if (type.fingerprint == fingerprint) {
            return type.name;
        }
    }
    return text("a type that gpomd does not know (fingerprint 0x%016" PRIx64 ")", fingerprint);
}

bool is_type_of(std::uint64_t fingerprint, bool of_poses)
{
    return of_poses ? fingerprint == GPOM_WIRE_BOT_POSE_FINGERPRINT ||
                          fingerprint == GPOM_WIRE_POSE2D_FINGERPRINT
                    : fingerprint == GPOM_WIRE_SCAN_FINGERPRINT ||
                          fingerprint == GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT ||
                          fingerprint == GPOM_WIRE_LIDAR_FINGERPRINT;
}

/// What a problem is about, in the words of the configuration.
struct About {
    std::string channel; ///< For example LIDAR.
    std::string table;   ///< For example sensor[0] or pose.
    std::string type;    ///< The configured type.
    const Config &config;

    About(const Problem &problem, const Config &configured) : config(configured)
    {
        const bool is_sensor = problem.i_sensor < config.n_sensors;
        channel = is_sensor ? config.sensors[problem.i_sensor].channel : config.pose.channel;
        table = is_sensor ? "sensor[" + std::to_string(problem.i_sensor) + "]" : "pose";
        const bool is_2d = config.pose.type == PoseType::pose2d;
        type = is_2d ? "mbot_lcm_msgs.pose2D_t" : "bot_core.pose_t";
        if (is_sensor) {
            const ScanType scan = config.sensors[problem.i_sensor].type;
            type = scan == ScanType::gpom_scan      ? "gpom.scan_t"
                   : scan == ScanType::planar_lidar ? "bot_core.planar_lidar_t"
                                                    : "mbot_lcm_msgs.lidar_t";
        }
    }
};

/// Name of the clock that a stamp is near to, compared with the clocks now.
const char *clock_of(std::int64_t stamp_us)
{
    constexpr double kNear_s = 60.0;
    if (std::fabs(seconds(stamp_us) - seconds(wall_us())) < kNear_s) {
        return ", the time of day,";
    }
    if (std::fabs(seconds(stamp_us) - seconds(monotonic_us())) < kNear_s) {
        return ", the time since this machine started,";
    }
    return "";
}

std::string type_sentence(const Problem &p, const About &about)
{
    const bool of_poses = about.table == "pose";
    const std::string came = about.channel + " carries " + type_name(p.type) + ", but " +
                             about.table + ".type is " + about.type + ": ";
    if (is_type_of(p.type, of_poses)) {
        return came + "set " + about.table + ".type = \"" + type_name(p.type) + "\"";
    }
    return came + "set " + about.table + ".channel to that of the " +
           (of_poses ? "poses" : "scans") + "; `gpom-watch --channels` lists what there is";
}

std::string unit_sentence(const Problem &p, const About &about)
{
    const char *const unit = p.limit > 1e3   ? "seconds: multiply it by 1000000"
                             : p.limit > 1.0 ? "milliseconds: multiply it by 1000"
                                             : "nanoseconds: divide it by 1000";
    return text("%s on %s: utime %" PRId64 " is the time of day in %s; utime must be in "
                "microseconds since 1970",
                about.type.c_str(), about.channel.c_str(), p.stamp_us, unit);
}

/// Sentences about malformed messages of a sensor.
std::string malformed_sentence(const Problem &p, const About &about)
{
    const std::string head = about.type + " on " + about.channel + ": ";
    switch (p.kind) {
    case GPOM_WIRE_PROBLEM_SCAN_CRC_ZERO:
        return head +
               "crc32 is 0, so the sender has not computed it: crc32 must be the CRC-32 of all "
               "bytes before it, once the message is encoded (lcmtypes/README.md)";
    case GPOM_WIRE_PROBLEM_SCAN_CORRUPT:
        return head + "crc32 does not fit the bytes: the message was damaged, or the sender does "
                      "not compute it as lcmtypes/README.md says";
    case GPOM_WIRE_PROBLEM_SCAN_LENGTH:
        return head + text("%.0f bytes do not match the message's counts: does the sender "
                           "use another .lcm file?",
                           p.value);
    case GPOM_WIRE_PROBLEM_SCAN_RANGES:
        return head + text("more ranges than intake.ranges_max = %.0f: raise that", p.limit);
    case GPOM_WIRE_PROBLEM_SCAN_SENSOR_ID:
        return head + text("sensor_id is %.0f, and no [[sensor]] of this channel has that id: set "
                           "%s.id = %.0f, or add a [[sensor]]",
                           p.value, about.table.c_str(), p.value);
    case GPOM_WIRE_PROBLEM_SCAN_ANGLES:
        return head + text("its bearings go from %g to %g rad, which is %.1f turns%s", p.value,
                           p.limit, std::fabs(p.limit - p.value) / (2.0 * M_PI),
                           std::isfinite(p.value) && std::isfinite(p.limit)
                               ? ": are they degrees? Multiply them by pi / 180"
                               : ": they must be finite");
    default:
        return head + "a beam's time is over 1 s from its scan's: are `times` in microseconds?";
    }
}

/// Sentences about scans with a bad time or in a bad order.
std::string order_sentence(const Problem &p, const About &about)
{
    const std::string head = about.type + " on " + about.channel + ": ";
    const double late_s = seconds(p.other_us) - seconds(p.stamp_us);
    switch (p.kind) {
    case GPOM_WIRE_PROBLEM_STAMP_RANGE:
        return head + text("utime %" PRId64 " is no time: it must be in microseconds since 1970",
                           p.stamp_us);
    case GPOM_WIRE_PROBLEM_SCAN_TOO_OLD:
        return head + text("stamped %.3f s ago, more than intake.age_max_s: set the sender's clock "
                           "(chrony, ntpd), or raise that",
                           late_s);
    case GPOM_WIRE_PROBLEM_SCAN_TOO_NEW:
    case GPOM_WIRE_PROBLEM_POSE_TOO_NEW:
        return head + text("stamped %.3f s ahead of this machine's clock: set the clocks of both "
                           "(chrony, ntpd), or raise intake.ahead_max_s",
                           -late_s);
    case GPOM_WIRE_PROBLEM_SCAN_LOST:
        return head + text("%.0f numbers are missing before number %.0f: the network or this "
                           "machine loses scans; does datagrams_lost rise, too?",
                           p.limit, p.value);
    case GPOM_WIRE_PROBLEM_SCAN_REPEATED:
        return head + text("number %.0f or utime %" PRId64 " came before: two senders share the "
                           "channel, or utime does not change from scan to scan",
                           p.value, p.stamp_us);
    case GPOM_WIRE_PROBLEM_SCAN_REORDERED:
        return head + text("number %.0f came after a later one, %.3f s late: two senders share the "
                           "channel, or the network reorders",
                           p.value, late_s);
    case GPOM_WIRE_PROBLEM_SCAN_BACK:
        return head + text("stamped %.3f s before the one that came before: the sender's clock is "
                           "being set, or two senders share the channel",
                           late_s);
    default:
        return head + text("nothing came for %.3f s, more than %s.gap_max_s", p.value,
                           about.table.c_str());
    }
}

std::string no_pose_sentence(const Problem &p, const About &about)
{
    const char *const poses = about.config.pose.channel;
    if (p.other_us == 0) {
        return about.channel + ": scans wait for a pose, and none came on " + poses +
               " so far: is the localiser running, is pose.channel right?";
    }
    return about.channel + text(": a scan of %.3f s had no pose after pose.wait_max_s; the newest "
                                "on %s is %.3f s older: raise pose.wait_max_s, set %s.latency_s, "
                                "or pose.hold_s if the localiser is silent while the robot stands",
                                seconds(p.stamp_us), poses, seconds(p.stamp_us - p.other_us),
                                about.table.c_str());
}

std::string latency_sentence(const Problem &p, const About &about)
{
    if (about.type == "gpom.scan_t") {
        return about.channel + text(": the poses in its scans are %.3f s %s than the ranges, by "
                                    "how the robot turns in both: the sender must take the pose of "
                                    "when the ranges were measured",
                                    std::fabs(p.value), p.value > 0.0 ? "newer" : "older");
    }
    return about.channel + text(": its stamps are %.3f s %s than those of the poses, by how the "
                                "robot turns in both: set %s.latency_s = %.2f (it is %.2f)",
                                std::fabs(p.value), p.value > 0.0 ? "later" : "earlier",
                                about.table.c_str(), p.limit + p.value, p.limit);
}

std::string two_clocks_sentence(const Problem &p, const About &about)
{
    return "two clocks: " + about.channel +
           text(" is stamped %.3f s%s while %s is stamped %.3f s%s at the same time: give both the "
                "same clock",
                seconds(p.stamp_us), clock_of(p.stamp_us), about.config.pose.channel,
                seconds(p.other_us), clock_of(p.other_us));
}

/// Sentences about scans and the poses that they wait for.
std::string pose_sentence(const Problem &p, const About &about)
{
    const char *const poses = about.config.pose.channel;
    switch (p.kind) {
    case GPOM_WIRE_PROBLEM_SCAN_POSE_GAP:
        return about.channel + ": the poses on " + poses +
               " about a scan are over pose.gap_max_s apart: raise that, or send more poses";
    case GPOM_WIRE_PROBLEM_SCAN_BEFORE_POSES:
        return about.channel + text(": a scan is older than all poses on %s; the newest is %.3f s "
                                    "later: scans come too late, or were sent before the poses",
                                    poses, seconds(p.other_us) - seconds(p.stamp_us));
    case GPOM_WIRE_PROBLEM_SCAN_BAD_POSE:
        return about.channel + text(": the pose of a scan is refused: x, y or yaw is not finite, "
                                    "x or y is beyond 1e8 m, or pose_cov is no covariance; x is "
                                    "%g m",
                                    p.value);
    case GPOM_WIRE_PROBLEM_SCAN_OUT_OF_REACH:
        return about.channel + text(": a scan was taken %.0f m from map.origin, more than %.0f m: "
                                    "set map.origin near the robot, or map.rebase_m",
                                    p.value, p.limit);
    default:
        return about.channel + ": all readings of a scan are " + p.text;
    }
}

/// Sentences about refused poses.
std::string refused_pose_sentence(const Problem &p, const About &about)
{
    const std::string head = about.type + " on " + about.channel + ": ";
    switch (p.kind) {
    case GPOM_WIRE_PROBLEM_POSE_LENGTH:
        return head + text("%.0f bytes, which is not its length: does the sender use another .lcm "
                           "file?",
                           p.value);
    case GPOM_WIRE_PROBLEM_POSE_QUATERNION:
        return head + text("orientation has length %g instead of 1%s", p.value,
                           p.value == 0.0 ? ": the sender leaves it at 0; without a turn it is "
                                            "(1, 0, 0, 0)"
                                          : ": it must be (w, x, y, z) of a unit quaternion");
    case GPOM_WIRE_PROBLEM_POSE_NOT_FINITE:
        return head + "a coordinate is NaN or infinite: the localiser is lost";
    case GPOM_WIRE_PROBLEM_POSE_ORDER:
        return head + text("utime %" PRId64
                           " is not later than that of the pose before, by %.3f s: "
                           "two localisers share the channel, or utime does not change",
                           p.stamp_us, seconds(p.other_us) - seconds(p.stamp_us));
    default:
        return head + text("a pose is %.1f m and %.3f s from the one before, more than [jump] "
                           "allows: a wild pose, two localisers, or jump.speed_mps is too low",
                           p.value, p.limit);
    }
}

std::string channel_sentence(const Problem &p, const About &about)
{
    switch (p.kind) {
    case GPOM_WIRE_PROBLEM_SILENT:
        return text("nothing came on %s for %.0f s: is its sender running, on this network? "
                    "`gpom-watch --channels` lists what there is",
                    about.channel.c_str(), p.value);
    case GPOM_WIRE_PROBLEM_OTHER_CHANNEL:
        return text("nothing came on %s for %.0f s, but %s comes on %s: set %s.channel = \"%s\"",
                    about.channel.c_str(), p.value, type_name(p.type).c_str(), p.channel,
                    about.table.c_str(), p.channel) +
               (type_name(p.type) != about.type
                    ? " and " + about.table + ".type = \"" + type_name(p.type) + "\""
                    : std::string());
    default: {
        const in_addr address = {static_cast<in_addr_t>(p.sender >> 16)};
        return text("another program, at %s port %u, sends %s, too: a second gpomd, or a log that "
                    "is played; subscribers mix both maps: stop one, or give it other channels "
                    "([publish])",
                    inet_ntoa(address), ntohs(static_cast<std::uint16_t>(p.sender & 0xffff)),
                    p.channel);
    }
    }
}

std::string query_sentence(const Problem &p, const About &about)
{
    return std::string("gpom.query_t on ") + about.config.publish.query + ": " + p.text;
}

std::string drop_sentence(const Problem &p, const About &)
{
    const Drop &drop = kDrops[p.i_drop];
    return text("%.0f %s: ", p.value, drop.name) + drop.remedy;
}

/// Which function writes the sentence for a kind of problem.
struct Writer {
    std::uint32_t kind;
    std::string (*write)(const Problem &problem, const About &about);
};

constexpr Writer kWriters[] = {{GPOM_WIRE_PROBLEM_SCAN_TYPE, type_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_TYPE, type_sentence},
                               {GPOM_WIRE_PROBLEM_STAMP_UNIT, unit_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_CRC_ZERO, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_CORRUPT, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_LENGTH, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_RANGES, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_SENSOR_ID, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_ANGLES, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_BEAM_TIMES, malformed_sentence},
                               {GPOM_WIRE_PROBLEM_STAMP_RANGE, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_TOO_OLD, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_TOO_NEW, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_LOST, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_REPEATED, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_REORDERED, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_BACK, order_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_GAP, order_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_TOO_NEW, order_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_LENGTH, refused_pose_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_QUATERNION, refused_pose_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_NOT_FINITE, refused_pose_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_ORDER, refused_pose_sentence},
                               {GPOM_WIRE_PROBLEM_POSE_WILD, refused_pose_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_NO_POSE, no_pose_sentence},
                               {GPOM_WIRE_PROBLEM_TWO_CLOCKS, two_clocks_sentence},
                               {GPOM_WIRE_PROBLEM_LATENCY, latency_sentence},
                               {GPOM_WIRE_PROBLEM_SILENT, channel_sentence},
                               {GPOM_WIRE_PROBLEM_OTHER_CHANNEL, channel_sentence},
                               {GPOM_WIRE_PROBLEM_TWO_MAPPERS, channel_sentence},
                               {GPOM_WIRE_PROBLEM_QUERY_REFUSED, query_sentence},
                               {GPOM_WIRE_PROBLEM_SCAN_OVERRUN, drop_sentence},
                               {GPOM_WIRE_PROBLEM_SNAPSHOT_FAILED, drop_sentence},
                               {GPOM_WIRE_PROBLEM_NOT_SENT, drop_sentence},
                               {GPOM_WIRE_PROBLEM_DATAGRAMS_LOST, drop_sentence},
                               {GPOM_WIRE_PROBLEM_DATAGRAMS_BAD, drop_sentence},
                               {GPOM_WIRE_PROBLEM_MESSAGES_INCOMPLETE, drop_sentence},
                               {GPOM_WIRE_PROBLEM_CAN_FRAMES, drop_sentence},
                               {GPOM_WIRE_PROBLEM_CAN_BUS, drop_sentence},
                               {GPOM_WIRE_PROBLEM_MAVLINK, drop_sentence}};

} // namespace

const Drop kDrops[kDropCount] = {
    {GPOM_WIRE_SCANS_BAD_POSE, "with a bad pose", -1, nullptr},
    {GPOM_WIRE_SCANS_OUT_OF_REACH, "out of reach", -1, nullptr},
    {GPOM_WIRE_SCANS_OTHER_TYPE, "of another type", -1, nullptr},
    {GPOM_WIRE_SCANS_CORRUPT, "corrupt", -1, nullptr},
    {GPOM_WIRE_SCANS_MALFORMED, "malformed", -1, nullptr},
    {GPOM_WIRE_SCANS_LOST, "lost", -1, nullptr},
    {GPOM_WIRE_SCANS_REPEATED, "repeated", -1, nullptr},
    {GPOM_WIRE_SCANS_REORDERED, "reordered", -1, nullptr},
    {GPOM_WIRE_SCANS_TOO_OLD, "too old", -1, nullptr},
    {GPOM_WIRE_SCANS_TOO_NEW, "ahead of the clock", -1, nullptr},
    {GPOM_WIRE_SCANS_JUMPED_BACK, "back in time", -1, nullptr},
    {GPOM_WIRE_SCANS_NO_POSE, "without pose", -1, nullptr},
    {GPOM_WIRE_SCANS_OVERRUN, "too many at once", GPOM_WIRE_PROBLEM_SCAN_OVERRUN,
     "more scans come than the map takes: lower intake.step_ops or send fewer; if they wait for "
     "poses, raise intake.queue_scans"},
    {GPOM_WIRE_TIME_GAPS, "gaps in time", -1, nullptr},
    {GPOM_WIRE_POSES_REFUSED, "poses refused", -1, nullptr},
    {GPOM_WIRE_SCANS_AT_JUMP, "at a jump", -1, nullptr},
    {GPOM_WIRE_POSES_AT_JUMP, "poses at a jump", -1, nullptr},
    {GPOM_WIRE_QUERIES_REFUSED, "queries refused", -1, nullptr},
    {GPOM_WIRE_SNAPSHOTS_FAILED, "snapshots not written", GPOM_WIRE_PROBLEM_SNAPSHOT_FAILED,
     "is the disk full, the folder of snapshot.path gone or read-only?"},
    {GPOM_WIRE_GRIDS_NOT_SENT, "grids whose corner float32 cannot hold", -1, nullptr},
    {GPOM_WIRE_CAN_BAD_LENGTH, "CAN frames of wrong length", GPOM_WIRE_PROBLEM_CAN_FRAMES,
     kCanRemedy},
    {GPOM_WIRE_CAN_BAD_CRC, "CAN frames with a wrong CRC", GPOM_WIRE_PROBLEM_CAN_FRAMES,
     kCanRemedy},
    {GPOM_WIRE_CAN_BAD_COUNTER, "CAN frames with a frozen counter", GPOM_WIRE_PROBLEM_CAN_FRAMES,
     kCanRemedy},
    {GPOM_WIRE_CAN_BAD_VALUE, "CAN values absent or out of range", GPOM_WIRE_PROBLEM_CAN_FRAMES,
     kCanRemedy},
    {GPOM_WIRE_CAN_LOST, "CAN frames missing", GPOM_WIRE_PROBLEM_CAN_BUS, kCanBusRemedy},
    {GPOM_WIRE_CAN_REORDERED, "CAN frames back in time", GPOM_WIRE_PROBLEM_CAN_BUS, kCanBusRemedy},
    {GPOM_WIRE_CAN_ERRORS, "CAN error frames", GPOM_WIRE_PROBLEM_CAN_BUS, kCanBusRemedy},
    {GPOM_WIRE_CAN_OVERFLOWS, "CAN frames by the kernel", GPOM_WIRE_PROBLEM_CAN_BUS,
     "raise can.receive_bytes"},
    {GPOM_WIRE_CAN_NOT_SENT, "CAN frames not sent", GPOM_WIRE_PROBLEM_CAN_BUS, kCanBusRemedy},
    {GPOM_WIRE_MAVLINK_NOT_SENT, "MAVLink messages not sent", GPOM_WIRE_PROBLEM_MAVLINK,
     "the line about mavlink.to says why; docs/counters.md lists causes"},
    {GPOM_WIRE_DATAGRAMS_LOST, "datagrams lost", GPOM_WIRE_PROBLEM_DATAGRAMS_LOST,
     "gpomd got no processor for too long: `sysctl -w net.core.rmem_max=4194304`, then start it "
     "again"},
    {GPOM_WIRE_DATAGRAMS_OTHER, "datagrams not of LCM", GPOM_WIRE_PROBLEM_DATAGRAMS_BAD,
     kForeignRemedy},
    {GPOM_WIRE_DATAGRAMS_MALFORMED, "datagrams malformed", GPOM_WIRE_PROBLEM_DATAGRAMS_BAD,
     kForeignRemedy},
    {GPOM_WIRE_FRAGMENTS_INCONSISTENT, "fragments inconsistent", GPOM_WIRE_PROBLEM_DATAGRAMS_BAD,
     kFragmentRemedy},
    {GPOM_WIRE_FRAGMENTS_REPEATED, "fragments repeated", GPOM_WIRE_PROBLEM_DATAGRAMS_BAD,
     kFragmentRemedy},
    {GPOM_WIRE_FRAGMENTS_LATE, "fragments late", GPOM_WIRE_PROBLEM_MESSAGES_INCOMPLETE,
     kFragmentRemedy},
    {GPOM_WIRE_MESSAGES_TIMED_OUT, "messages incomplete", GPOM_WIRE_PROBLEM_MESSAGES_INCOMPLETE,
     kFragmentRemedy},
    {GPOM_WIRE_MESSAGES_EVICTED, "messages in too many fragments",
     GPOM_WIRE_PROBLEM_MESSAGES_INCOMPLETE, kFragmentRemedy},
    {GPOM_WIRE_MESSAGES_NOT_SENT, "messages not sent", GPOM_WIRE_PROBLEM_NOT_SENT,
     "the network takes less than is sent: lower publish.map_hz or raise publish.keyframe_s; or "
     "there is no route for multicast any more: `ip route get 239.255.76.67`"}};

std::string sentence(const Problem &problem, const Config &config)
{
    const About about(problem, config);
    for (const Writer &writer : kWriters) {
        if (writer.kind == problem.kind) {
            return writer.write(problem, about);
        }
    }
    return pose_sentence(problem, about);
}

} // namespace gpomd
