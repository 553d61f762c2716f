#include "ports/linux/intake.hpp"

#include "ports/linux/clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace gpomd
{

namespace
{

/// A beam's time further from its scan's is a fault of the sender.
constexpr std::int64_t kBeamTimeMax_us = 1000000;

/// Poses nearer in time tell little of odometry's errors beside their own.
constexpr std::int64_t kLearn_us = 1000000;

/// No sensor scans more often; and so many numbers may be missing at once.
constexpr std::int64_t kScanPeriodMin_us = 100;
constexpr std::int64_t kLostMax = 1000;

/// Bearings and steps within what the library takes.
bool is_angle(double angle_rad) { return std::fabs(angle_rad) <= 100.0; }
bool is_step(double angle_rad) { return std::fabs(angle_rad) <= 10.0; }

std::size_t place_of(gpom_wire_fault_t fault)
{
    switch (fault) {
    case GPOM_WIRE_TYPE:
        return GPOM_WIRE_SCANS_OTHER_TYPE;
    case GPOM_WIRE_CRC:
        return GPOM_WIRE_SCANS_CORRUPT;
    default:
        return GPOM_WIRE_SCANS_MALFORMED;
    }
}

/// Yaw of a unit quaternion w, x, y, z: where the body's x axis points in the plane.
double yaw_of(const double (&q)[4])
{
    return std::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
}

/// Rounded, but of unit length; false for numbers that are not finite.
bool is_rotation(const double (&q)[4])
{
    const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return std::fabs(norm2 - 1.0) <= 0.02;
}

/// Each beam has a bearing, and a time near the scan's.
bool is_per_beam_sane(const ScanSlot &slot)
{
    for (std::uint32_t i = 0; i < slot.n_ranges; ++i) {
        const std::int64_t low_us = slot.stamp_us - kBeamTimeMax_us;
        const std::int64_t high_us = slot.stamp_us + kBeamTimeMax_us;
        if (!is_angle(static_cast<double>(slot.bearings_rad[i])) || slot.stamps_us[i] < low_us ||
            slot.stamps_us[i] > high_us) {
            return false;
        }
    }
    return true;
}

bool is_stamp(std::int64_t stamp_us) { return stamp_us >= 0 && stamp_us <= kStampMax_us; }

} // namespace

std::size_t Intake::need(const Config &config)
{
    return Memory::need<std::uint32_t>(config.intake.queue_scans + 1);
}

void Intake::init(const Config &config, Memory &memory, ScanQueue &queue, Counts &counts)
{
    config_ = &config;
    queue_ = &queue;
    counts_ = &counts;
    frame_.init(config.jump);
    waiting_ = memory.take<std::uint32_t>(config.intake.queue_scans + 1);
    if (!queue_->free.pop(spare_, 0)) {
        std::abort(); // a queue has two slots at least
    }
}

void Intake::take_scan(const char *channel, const Message &message)
{
    counts_->add(GPOM_WIRE_SCANS_RECEIVED);
    ScanSlot &slot = queue_->slot(spare_);
    std::uint32_t sequence = 0;
    gpom_wire_fault_t fault = decode_scan(channel, message, slot, sequence);
    if (fault == GPOM_WIRE_OK && !is_stamp(slot.stamp_us)) {
        fault = GPOM_WIRE_VALUE;
    }
    if (fault != GPOM_WIRE_OK) {
        counts_->add(place_of(fault));
        return;
    }
    const SensorConfig &sensor = config_->sensors[slot.i_sensor];
    slot.arrived_us = message.arrived_us;
    slot.stamp_us -= sensor.latency_us;
    slot.latest_us = slot.stamp_us;
    for (std::uint32_t i = 0; slot.is_per_beam && i < slot.n_ranges; ++i) {
        slot.stamps_us[i] -= sensor.latency_us;
        slot.latest_us = std::max(slot.latest_us, slot.stamps_us[i]);
    }
    for (std::uint32_t i = 0; sensor.ignores_no_return && i < slot.n_ranges; ++i) {
        if (slot.ranges_m[i] >= sensor.sensor.range_max_m) {
            slot.ranges_m[i] = std::numeric_limits<float>::quiet_NaN();
        }
    }
    if (admit(slot, sequence, message.wall_us)) {
        keep_spare();
    }
}

gpom_wire_fault_t Intake::decode_scan(const char *channel, const Message &message, ScanSlot &slot,
                                      std::uint32_t &sequence)
{
    for (std::size_t i = 0; i < config_->n_sensors; ++i) {
        if (std::strcmp(config_->sensors[i].channel, channel) != 0) {
            continue;
        }
        slot.i_sensor = i;
        slot.is_per_beam = false;
        slot.pose.cov = nullptr;
        switch (config_->sensors[i].type) {
        case ScanType::gpom_scan:
            return decode_own(channel, message, slot, sequence);
        case ScanType::planar_lidar:
            return decode_planar_lidar(message, slot);
        case ScanType::lidar:
            return decode_lidar(message, slot);
        }
    }
    return GPOM_WIRE_TYPE; // not subscribed
}

gpom_wire_fault_t Intake::decode_own(const char *channel, const Message &message, ScanSlot &slot,
                                     std::uint32_t &sequence)
{
    gpom_wire_scan_t scan = {};
    scan.ranges_m = {slot.ranges_m, config_->intake.ranges_max, 0};
    const gpom_wire_fault_t fault = gpom_wire_scan_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.i_sensor = config_->n_sensors;
    for (std::size_t i = 0; i < config_->n_sensors; ++i) {
        const SensorConfig &sensor = config_->sensors[i];
        if (sensor.id == scan.sensor_id && std::strcmp(sensor.channel, channel) == 0) {
            slot.i_sensor = i;
        }
    }
    if (slot.i_sensor == config_->n_sensors || !is_angle(scan.angle_min_rad) ||
        !is_step(scan.angle_step_rad)) {
        return GPOM_WIRE_VALUE;
    }
    sequence = scan.sequence;
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
    return GPOM_WIRE_OK;
}

gpom_wire_fault_t Intake::decode_planar_lidar(const Message &message, ScanSlot &slot)
{
    gpom_wire_planar_lidar_t scan = {};
    scan.ranges_m = {slot.ranges_m, config_->intake.ranges_max, 0};
    const gpom_wire_fault_t fault =
        gpom_wire_planar_lidar_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.stamp_us = scan.stamp_us;
    slot.angle_min_rad = static_cast<double>(scan.angle_min_rad);
    slot.angle_step_rad = static_cast<double>(scan.angle_step_rad);
    slot.n_ranges = scan.ranges_m.n;
    const bool is_sane = is_angle(slot.angle_min_rad) && is_step(slot.angle_step_rad);
    return is_sane ? GPOM_WIRE_OK : GPOM_WIRE_VALUE;
}

gpom_wire_fault_t Intake::decode_lidar(const Message &message, ScanSlot &slot)
{
    gpom_wire_lidar_t scan = {};
    scan.ranges_m = {slot.ranges_m, config_->intake.ranges_max, 0};
    scan.bearings_rad = {slot.bearings_rad, config_->intake.ranges_max, 0};
    scan.stamps_us = {slot.stamps_us, config_->intake.ranges_max, 0};
    const gpom_wire_fault_t fault = gpom_wire_lidar_decode(&scan, message.bytes, message.n_bytes);
    if (fault != GPOM_WIRE_OK) {
        return fault;
    }
    slot.stamp_us = scan.stamp_us;
    slot.n_ranges = scan.ranges_m.n;
    slot.is_per_beam = true;
    const bool is_sane = is_stamp(slot.stamp_us) && is_per_beam_sane(slot);
    return is_sane ? GPOM_WIRE_OK : GPOM_WIRE_VALUE;
}

bool Intake::admit(const ScanSlot &slot, std::uint32_t sequence, std::int64_t wall_us)
{
    const IntakeConfig &limits = config_->intake;
    const bool is_own = config_->sensors[slot.i_sensor].type == ScanType::gpom_scan;
    Track &track = tracks_[slot.i_sensor];
    const std::int32_t ahead = is_own ? note_sequence(track, sequence, slot.arrived_us) : 1;
    if (slot.stamp_us > wall_us + limits.ahead_max_us) {
        counts_->add(GPOM_WIRE_SCANS_TOO_NEW);
        return false;
    }
    if (limits.age_max_us > 0 && slot.stamp_us < wall_us - limits.age_max_us) {
        counts_->add(GPOM_WIRE_SCANS_TOO_OLD);
        return false;
    }
    if (track.has_scan && !is_next(track, slot, ahead)) {
        return false;
    }
    const std::int64_t silence_us = slot.stamp_us - track.stamp_us;
    if (!is_own && track.has_scan && silence_us > config_->sensors[slot.i_sensor].gap_max_us) {
        counts_->add(GPOM_WIRE_TIME_GAPS);
    }
    track.has_scan = true;
    track.stamp_us = slot.stamp_us;
    track.order_us = slot.stamp_us <= wall_us ? slot.stamp_us : track.order_us;
    track.sequence = sequence;
    track.n_behind = 0;
    return true;
}

/// How far a sequence number is ahead of the newest seen. What is missing between is lost, unless
/// no sensor sends so many in that time: then the sender began to count anew.
std::int32_t Intake::note_sequence(Track &track, std::uint32_t sequence, std::int64_t arrived_us)
{
    const auto ahead = static_cast<std::int32_t>(sequence - track.sequence);
    const std::int64_t since_us = arrived_us - track.arrived_us;
    if (track.has_sequence && ahead <= 0) {
        return ahead;
    }
    const bool is_loss = track.has_sequence && ahead <= kLostMax + since_us / kScanPeriodMin_us;
    if (is_loss) {
        counts_->add(GPOM_WIRE_SCANS_LOST, ahead - 1);
    }
    track.has_sequence = true;
    track.sequence = sequence;
    track.arrived_us = arrived_us;
    return is_loss ? ahead : 1;
}

/// Is a scan later than the last one of its sensor? One that was ahead of the clock does not count:
/// it would keep all others out until its time has come. A lower number with a later stamp is a
/// sender that was started again.
bool Intake::is_next(Track &track, const ScanSlot &slot, std::int32_t ahead)
{
    if (ahead == 0 || slot.stamp_us == track.stamp_us) {
        counts_->add(GPOM_WIRE_SCANS_REPEATED);
        return false;
    }
    if (slot.stamp_us < track.order_us && !is_set_back(track, slot.stamp_us)) {
        counts_->add(ahead < 0 ? GPOM_WIRE_SCANS_REORDERED : GPOM_WIRE_SCANS_JUMPED_BACK);
        return false;
    }
    return true;
}

/// A scan behind the newest: the last of so many in a row, in order, that the sender's clock must
/// have been set back?
bool Intake::is_set_back(Track &track, std::int64_t stamp_us)
{
    track.n_behind =
        track.n_behind > 0 && stamp_us > track.behind_us ? track.n_behind + 1 : std::uint32_t{1};
    track.behind_us = stamp_us;
    return track.n_behind >= PoseRing::kSetBack;
}

/// The scan in the spare slot goes its way, if there is another slot for the next one.
void Intake::keep_spare()
{
    const std::uint32_t i_slot = spare_;
    if (!queue_->free.pop(spare_, 0)) {
        counts_->add(GPOM_WIRE_SCANS_OVERRUN);
        return;
    }
    const ScanSlot &slot = queue_->slot(i_slot);
    if (config_->sensors[slot.i_sensor].type != ScanType::gpom_scan) {
        waiting_[n_waiting_++] = i_slot;
        match_waiting();
    } else if (is_stray(slot)) {
        drop(i_slot, GPOM_WIRE_SCANS_AT_JUMP);
    } else {
        hand_over(i_slot);
    }
}

void Intake::hand_over(std::uint32_t i_slot)
{
    queue_->slot(i_slot).n_jumps = n_jumps_;
    queue_->ready.push(i_slot);
}

/// How a pose continues the others of the map frame, whatever channel they are of. Once the frame
/// has jumped, poses of the one before are none any more.
Continuity Intake::follow(const StampedPose &pose)
{
    if (config_->jump.rule == JumpRule::none) {
        return Continuity::follows;
    }
    const Continuity continuity = frame_.take(pose);
    if (continuity == Continuity::jumps) {
        ++n_jumps_;
        poses_.begin_frame();
    }
    return continuity;
}

/// Of a scan that carries its pose. One that is not finite is the library's to refuse.
bool Intake::is_stray(const ScanSlot &slot)
{
    const StampedPose pose = {slot.stamp_us, slot.pose.x_m, slot.pose.y_m, slot.pose.yaw_rad};
    return PoseRing::is_finite(pose) && follow(pose) == Continuity::strays;
}

void Intake::take_pose(const Message &message)
{
    counts_->add(GPOM_WIRE_POSES_RECEIVED);
    StampedPose pose = {};
    gpom_wire_fault_t fault = GPOM_WIRE_OK;
    if (config_->pose.type == PoseType::bot_pose) {
        gpom_wire_bot_pose_t read = {};
        fault = gpom_wire_bot_pose_decode(&read, message.bytes, message.n_bytes);
        if (fault == GPOM_WIRE_OK && !is_rotation(read.orientation)) {
            fault = GPOM_WIRE_VALUE;
        }
        pose = {read.stamp_us, read.position_m[0], read.position_m[1], yaw_of(read.orientation)};
    } else {
        gpom_wire_pose2d_t read = {};
        fault = gpom_wire_pose2d_decode(&read, message.bytes, message.n_bytes);
        pose = {read.stamp_us, static_cast<double>(read.x_m), static_cast<double>(read.y_m),
                static_cast<double>(read.yaw_rad)};
    }
    const std::uint32_t n_gave_way = poses_.n_gave_way();
    const bool is_taken = fault == GPOM_WIRE_OK && is_stamp(pose.stamp_us) &&
                          pose.stamp_us <= message.wall_us + config_->intake.ahead_max_us &&
                          poses_.push(pose, message.wall_us);
    counts_->add(GPOM_WIRE_POSES_REFUSED, poses_.n_gave_way() - n_gave_way);
    if (!is_taken) {
        counts_->add(GPOM_WIRE_POSES_REFUSED);
        return;
    }
    switch (follow(pose)) {
    case Continuity::follows:
        break;
    case Continuity::strays:
        counts_->add(GPOM_WIRE_POSES_AT_JUMP);
        poses_.drop_newest();
        return;
    case Continuity::jumps:
        poses_.push(pose, message.wall_us); // the first of its frame
        break;
    }
    match_waiting();
}

/// The newest pose tells how good the odometry was since one a while before.
void Intake::learn_odometry()
{
    StampedPose from = {}, to = {};
    if (odometry_ != nullptr && poses_.not_after(INT64_MAX, to) &&
        poses_.not_after(to.stamp_us - kLearn_us, from)) {
        odometry_->learn(from, to, config_->pose.cov); // if it has not come yet: the next time
    }
}

void Intake::match_waiting()
{
    learn_odometry();
    std::size_t n_left = 0;
    for (std::size_t i = 0; i < n_waiting_; ++i) {
        const std::uint32_t i_slot = waiting_[i];
        if (!settle(i_slot, match(queue_->slot(i_slot)))) {
            waiting_[n_left++] = i_slot;
        }
    }
    n_waiting_ = n_left;
}

/// True: the scan is on its way or dropped; false: it goes on waiting.
bool Intake::settle(std::uint32_t i_slot, PoseMatch match)
{
    switch (match) {
    case PoseMatch::found:
        hand_over(i_slot);
        return true;
    case PoseMatch::jumped:
        drop(i_slot, GPOM_WIRE_SCANS_AT_JUMP);
        return true;
    case PoseMatch::too_old:
        drop(i_slot, GPOM_WIRE_SCANS_TOO_OLD);
        return true;
    case PoseMatch::gap:
        drop(i_slot, GPOM_WIRE_SCANS_NO_POSE);
        return true;
    case PoseMatch::not_yet:
        break;
    }
    return false;
}

/// The pose at a time and its covariance: carried on by odometry from the pose before, else
/// interpolated between two. Odometry that has not come yet is waited for.
PoseMatch Intake::pose_at(std::int64_t stamp_us, StampedPose &pose, float *cov) const
{
    const PoseConfig &config = config_->pose;
    StampedPose from = {};
    PoseMatch carried = PoseMatch::gap;
    std::copy_n(config.cov, 9, cov);
    if (odometry_ != nullptr && poses_.not_after(stamp_us, from)) {
        PoseCov carried_cov;
        std::copy_n(config.cov, 9, carried_cov);
        carried = odometry_->carry(from, stamp_us, pose, carried_cov);
        if (carried == PoseMatch::found) {
            std::transform(carried_cov, carried_cov + 9, cov,
                           [](double c) { return static_cast<float>(c); });
            return PoseMatch::found;
        }
    }
    const PoseMatch match = poses_.at(stamp_us, config.gap_max_us, pose);
    return match == PoseMatch::gap ? carried : match;
}

/// A scan is looked at whenever something comes; while its latest beam waits, all of it does.
PoseMatch Intake::match(ScanSlot &slot) const
{
    StampedPose pose = {};
    float beam_cov[9]; // beams share the scan's
    if (slot.is_per_beam && pose_at(slot.latest_us, pose, beam_cov) == PoseMatch::not_yet) {
        return PoseMatch::not_yet;
    }
    PoseMatch found = pose_at(slot.stamp_us, pose, slot.cov);
    const bool is_exact = slot.cov[0] == 0.0f && slot.cov[4] == 0.0f && slot.cov[8] == 0.0f;
    const float *const cov = is_exact ? nullptr : slot.cov;
    slot.pose = {pose.x_m, pose.y_m, pose.yaw_rad, cov};
    for (std::uint32_t i = 0; slot.is_per_beam && found == PoseMatch::found && i < slot.n_ranges;
         ++i) {
        found = pose_at(slot.stamps_us[i], pose, beam_cov);
        slot.poses[i] = {pose.x_m, pose.y_m, pose.yaw_rad, cov};
    }
    return found;
}

void Intake::drop(std::uint32_t i_slot, std::size_t place)
{
    counts_->add(place);
    queue_->free.push(i_slot);
}

void Intake::expire(std::int64_t monotonic_us)
{
    std::size_t n_left = 0;
    for (std::size_t i = 0; i < n_waiting_; ++i) {
        const std::uint32_t i_slot = waiting_[i];
        if (monotonic_us - queue_->slot(i_slot).arrived_us > config_->pose.wait_max_us) {
            drop(i_slot, GPOM_WIRE_SCANS_NO_POSE);
        } else {
            waiting_[n_left++] = i_slot;
        }
    }
    n_waiting_ = n_left;
}

} // namespace gpomd
