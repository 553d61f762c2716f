#include "ports/linux/lcm/scan_decoder.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gpomd
{

namespace
{

/// The largest difference of a beam's time from its scan's time. A larger one is a fault of the
/// sender.
constexpr std::int64_t kBeamTimeMax_us = 1000000;

/// No scan covers more than two turns. A larger angle is probably in degrees.
constexpr double kTurnMax_rad = 4.0 * M_PI + 1e-3;

/// Bearings and steps must be within the limits of the library.
bool is_angle(double angle_rad) { return std::fabs(angle_rad) <= 100.0; }
bool is_step(double angle_rad) { return std::fabs(angle_rad) <= 10.0; }

/// True if a sensor may have bearings from `from_rad` to `to_rad`.
bool is_good_fan(double from_rad, double to_rad, Problem &problem)
{
    problem.kind = GPOM_WIRE_PROBLEM_SCAN_ANGLES;
    problem.value = from_rad;
    problem.limit = to_rad;
    return is_angle(from_rad) && is_angle(to_rad) && std::fabs(to_rad - from_rad) <= kTurnMax_rad;
}

/// The same check for evenly spaced bearings.
bool is_good_fan(const ScanSlot &slot, Problem &problem)
{
    const double n_steps = slot.n_ranges > 0 ? slot.n_ranges - 1.0 : 0.0;
    const double to_rad = slot.angle_min_rad + n_steps * slot.angle_step_rad;
    return is_good_fan(slot.angle_min_rad, to_rad, problem) && is_step(slot.angle_step_rad);
}

/// True if each beam has a bearing, and a time near the scan's time.
bool has_good_beams(const ScanSlot &slot, Problem &problem)
{
    if (slot.n_ranges == 0) {
        return true;
    }
    float low_rad = slot.bearings_rad[0], high_rad = slot.bearings_rad[0];
    for (std::uint32_t i = 0; i < slot.n_ranges; ++i) {
        const float bearing_rad = slot.bearings_rad[i];
        if (!is_angle(static_cast<double>(bearing_rad))) {
            low_rad = high_rad = bearing_rad;
            break;
        }
        low_rad = std::min(low_rad, bearing_rad);
        high_rad = std::max(high_rad, bearing_rad);
    }
    if (!is_good_fan(static_cast<double>(low_rad), static_cast<double>(high_rad), problem)) {
        return false;
    }
    problem.kind = GPOM_WIRE_PROBLEM_SCAN_BEAM_TIMES;
    return std::all_of(slot.stamps_us, slot.stamps_us + slot.n_ranges, [&](std::int64_t stamp_us) {
        return stamp_us >= slot.stamp_us - kBeamTimeMax_us &&
               stamp_us <= slot.stamp_us + kBeamTimeMax_us;
    });
}

gpom_wire_fault_t decode_own(const Config &config, const char *channel, const Message &message,
                             DecodedScan &decoded)
{
    ScanSlot &slot = *decoded.slot;
    gpom_wire_scan_t scan = {};
    scan.ranges_m = {slot.ranges_m, config.intake.ranges_max, 0};
    const gpom_wire_fault_t fault = gpom_wire_scan_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.i_sensor = config.n_sensors;
    for (std::size_t i = 0; i < config.n_sensors; ++i) {
        const SensorConfig &sensor = config.sensors[i];
        if (sensor.id == scan.sensor_id && std::strcmp(sensor.channel, channel) == 0) {
            slot.i_sensor = i;
        }
    }
    if (slot.i_sensor == config.n_sensors) {
        decoded.problem.kind = GPOM_WIRE_PROBLEM_SCAN_SENSOR_ID;
        decoded.problem.value = scan.sensor_id;
        return GPOM_WIRE_VALUE;
    }
    decoded.problem.i_sensor = slot.i_sensor;
    decoded.sequence = scan.sequence;
    slot.stamp_us = scan.stamp_us;
    bool is_exact = true;
    for (std::size_t i = 0; i < 9; ++i) {
        slot.cov[i] = scan.pose_cov[i];
        is_exact = is_exact && scan.pose_cov[i] == 0.0f;
    }
    slot.pose = {scan.pose[0], scan.pose[1], scan.pose[2], is_exact ? nullptr : slot.cov};
    slot.angle_min_rad = scan.angle_min_rad;
    slot.angle_step_rad = scan.angle_step_rad;
    slot.n_ranges = scan.ranges_m.n;
    return is_good_fan(slot, decoded.problem) ? GPOM_WIRE_OK : GPOM_WIRE_VALUE;
}

gpom_wire_fault_t decode_planar_lidar(const Config &config, const Message &message,
                                      DecodedScan &decoded)
{
    ScanSlot &slot = *decoded.slot;
    gpom_wire_planar_lidar_t scan = {};
    scan.ranges_m = {slot.ranges_m, config.intake.ranges_max, 0};
    const gpom_wire_fault_t fault =
        gpom_wire_planar_lidar_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.stamp_us = scan.stamp_us;
    slot.angle_min_rad = static_cast<double>(scan.angle_min_rad);
    slot.angle_step_rad = static_cast<double>(scan.angle_step_rad);
    slot.n_ranges = scan.ranges_m.n;
    return is_good_fan(slot, decoded.problem) ? GPOM_WIRE_OK : GPOM_WIRE_VALUE;
}

gpom_wire_fault_t decode_lidar(const Config &config, const Message &message, DecodedScan &decoded)
{
    ScanSlot &slot = *decoded.slot;
    gpom_wire_lidar_t scan = {};
    scan.ranges_m = {slot.ranges_m, config.intake.ranges_max, 0};
    scan.bearings_rad = {slot.bearings_rad, config.intake.ranges_max, 0};
    scan.stamps_us = {slot.stamps_us, config.intake.ranges_max, 0};
    const gpom_wire_fault_t fault = gpom_wire_lidar_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.stamp_us = scan.stamp_us;
    slot.n_ranges = scan.ranges_m.n;
    slot.is_per_beam = true;
    const bool is_good = is_good_stamp(slot.stamp_us, message.wall_us, decoded.problem) &&
                         has_good_beams(slot, decoded.problem);
    return is_good ? GPOM_WIRE_OK : GPOM_WIRE_VALUE;
}

gpom_wire_fault_t decode_as_configured(const Config &config, const char *channel,
                                       const Message &message, DecodedScan &decoded)
{
    for (std::size_t i = 0; i < config.n_sensors; ++i) {
        if (std::strcmp(config.sensors[i].channel, channel) != 0) {
            continue;
        }
        decoded.problem.i_sensor = i;
        decoded.slot->i_sensor = i;
        decoded.slot->is_per_beam = false;
        decoded.slot->pose.cov = nullptr;
        switch (config.sensors[i].type) {
        case ScanType::gpom_scan:
            return decode_own(config, channel, message, decoded);
        case ScanType::planar_lidar:
            return decode_planar_lidar(config, message, decoded);
        case ScanType::lidar:
            return decode_lidar(config, message, decoded);
        }
    }
    return GPOM_WIRE_TYPE; // no handler is subscribed for this type
}

bool ends_in_zeros(const Message &message)
{
    constexpr std::size_t n_crc = 4;
    return message.n_bytes >= n_crc &&
           std::all_of(message.bytes + message.n_bytes - n_crc, message.bytes + message.n_bytes,
                       [](std::uint8_t byte) { return byte == 0; });
}

} // namespace

gpom_wire_fault_t decode_scan(const Config &config, const char *channel, const Message &message,
                              DecodedScan &decoded)
{
    decoded.sequence = 0;
    decoded.problem = Problem{GPOM_WIRE_PROBLEM_SCAN_LENGTH};
    gpom_wire_fault_t fault = decode_as_configured(config, channel, message, decoded);
    Problem &problem = decoded.problem;
    switch (fault) {
    case GPOM_WIRE_OK:
        fault = is_good_stamp(decoded.slot->stamp_us, message.wall_us, problem) ? GPOM_WIRE_OK
                                                                                : GPOM_WIRE_VALUE;
        break;
    case GPOM_WIRE_VALUE: // the decoder has said which value is wrong
        break;
    case GPOM_WIRE_TYPE:
        problem.kind = GPOM_WIRE_PROBLEM_SCAN_TYPE;
        problem.type = gpom_wire_fingerprint(message.bytes, message.n_bytes);
        break;
    case GPOM_WIRE_CRC:
        problem.kind = ends_in_zeros(message) ? GPOM_WIRE_PROBLEM_SCAN_CRC_ZERO
                                              : GPOM_WIRE_PROBLEM_SCAN_CORRUPT;
        break;
    case GPOM_WIRE_CAPACITY:
        problem.kind = GPOM_WIRE_PROBLEM_SCAN_RANGES;
        problem.limit = config.intake.ranges_max;
        break;
    default:
        problem.kind = GPOM_WIRE_PROBLEM_SCAN_LENGTH;
        problem.value = static_cast<double>(message.n_bytes);
        break;
    }
    return fault;
}

bool is_good_stamp(std::int64_t stamp_us, std::int64_t wall_us, Problem &problem)
{
    constexpr double kDay_us = 86400e6;
    constexpr double kTenYears_us = 3650.0 * kDay_us;
    problem.stamp_us = stamp_us;
    problem.kind = GPOM_WIRE_PROBLEM_STAMP_RANGE;
    if (stamp_us < 0 || stamp_us > kStampMax_us) {
        return false;
    }
    problem.kind = GPOM_WIRE_PROBLEM_STAMP_UNIT;
    const auto wall = static_cast<double>(wall_us);
    for (const double unit_us : {1e6, 1e3, 1e-3}) {
        problem.limit = unit_us;
        if (wall > kTenYears_us && // else the clock was never set, and good stamps are as small
            std::fabs(static_cast<double>(stamp_us) * unit_us - wall) < kDay_us) {
            return false;
        }
    }
    return true;
}

} // namespace gpomd
