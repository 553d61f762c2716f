#include "ports/linux/map/intake.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace gpomd
{

namespace
{

/// Poses nearer in time say little about the odometry's errors, because the poses have errors, too.
constexpr std::int64_t kLearn_us = 1000000;

/// Smaller latencies are not reported: a sender may stamp the begin, the middle or the end of a
/// sensor's turn.
constexpr double kLatencyTold_s = 0.04;

/// Poses are coming if the newest pose arrived within kPosesCome_us. They are of another clock than
/// a scan if their stamps differ by more than kTwoClocks_us.
constexpr std::int64_t kPosesCome_us = 2000000;
constexpr std::int64_t kTwoClocks_us = 10000000;

/// No sensor scans more often than once in kScanPeriodMin_us. kLostMax sequence numbers may be
/// missing at any time.
constexpr std::int64_t kScanPeriodMin_us = 100;
constexpr std::int64_t kLostMax = 1000;

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

/// Yaw of a unit quaternion w, x, y, z: the direction of the body's x axis in the plane.
double yaw_of(const double (&q)[4])
{
    return std::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
}

/// True if a quaternion has unit length up to rounding. False for numbers that are not finite.
bool is_rotation(const double (&q)[4])
{
    const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return std::fabs(norm2 - 1.0) <= 0.02;
}

} // namespace

std::size_t Intake::need(const Config &config)
{
    return Memory::need<std::uint32_t>(config.intake.queue_scans + 1) +
           Memory::need<Latency>(config.n_sensors);
}

void Intake::init(const Config &config, Memory &memory, ScanQueue &queue, Counts &counts,
                  Problems &problems)
{
    config_ = &config;
    queue_ = &queue;
    counts_ = &counts;
    problems_ = &problems;
    frame_.init(config.jump);
    latencies_ = memory.take<Latency>(config.n_sensors);
    for (std::size_t i = 0; i < config.n_sensors; ++i) {
        latencies_[i].init(config.sensors[i].sensor);
    }
    waiting_ = memory.take<std::uint32_t>(config.intake.queue_scans + 1);
    if (!queue_->free.pop(spare_, 0)) {
        std::abort(); // an error of this program: a queue has at least two slots
    }
}

void Intake::take_scan(const char *channel, const Message &message)
{
    counts_->add(GPOM_WIRE_SCANS_RECEIVED);
    ScanSlot &slot = queue_->slot(spare_);
    DecodedScan decoded = {&slot, 0, {}};
    const gpom_wire_fault_t fault = decode_scan(*config_, channel, message, decoded);
    if (fault != GPOM_WIRE_OK) {
        counts_->add(place_of(fault));
        problems_->note(decoded.problem);
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
    if (admit(slot, decoded.sequence, message.wall_us)) {
        learn_latency(slot);
        keep_spare();
    }
}

bool Intake::admit(const ScanSlot &slot, std::uint32_t sequence, std::int64_t wall_us)
{
    const IntakeConfig &limits = config_->intake;
    const bool is_own = config_->sensors[slot.i_sensor].type == ScanType::gpom_scan;
    Track &track = tracks_[slot.i_sensor];
    const std::int32_t ahead = is_own ? note_sequence(track, slot, sequence) : 1;
    if (slot.stamp_us > wall_us + limits.ahead_max_us) {
        counts_->add(GPOM_WIRE_SCANS_TOO_NEW);
        note(GPOM_WIRE_PROBLEM_SCAN_TOO_NEW, slot, wall_us);
        return false;
    }
    if (limits.age_max_us > 0 && slot.stamp_us < wall_us - limits.age_max_us) {
        counts_->add(GPOM_WIRE_SCANS_TOO_OLD);
        note(GPOM_WIRE_PROBLEM_SCAN_TOO_OLD, slot, wall_us);
        return false;
    }
    if (track.has_scan && !is_next(track, slot, ahead, sequence)) {
        return false;
    }
    const std::int64_t silence_us = slot.stamp_us - track.stamp_us;
    if (!is_own && track.has_scan && silence_us > config_->sensors[slot.i_sensor].gap_max_us) {
        counts_->add(GPOM_WIRE_TIME_GAPS);
        note(GPOM_WIRE_PROBLEM_SCAN_GAP, slot, track.stamp_us,
             1e-6 * static_cast<double>(silence_us));
    }
    track.has_scan = true;
    track.stamp_us = slot.stamp_us;
    track.order_us = slot.stamp_us <= wall_us ? slot.stamp_us : track.order_us;
    track.sequence = sequence;
    track.n_behind = 0;
    return true;
}

/// By how much a sequence number is ahead of the newest number seen. The numbers in between are
/// counted as lost, unless no sensor could send so many scans in that time. In that case the sender
/// has restarted its numbers.
std::int32_t Intake::note_sequence(Track &track, const ScanSlot &slot, std::uint32_t sequence)
{
    const auto ahead = static_cast<std::int32_t>(sequence - track.sequence);
    const std::int64_t since_us = slot.arrived_us - track.arrived_us;
    if (track.has_sequence && ahead <= 0) {
        return ahead;
    }
    const bool is_loss = track.has_sequence && ahead <= kLostMax + since_us / kScanPeriodMin_us;
    if (is_loss) {
        counts_->add(GPOM_WIRE_SCANS_LOST, ahead - 1);
    }
    if (is_loss && ahead > 1) {
        note(GPOM_WIRE_PROBLEM_SCAN_LOST, slot, 0, sequence, ahead - 1.0);
    }
    track.has_sequence = true;
    track.sequence = sequence;
    track.arrived_us = slot.arrived_us;
    return is_loss ? ahead : 1;
}

/// True if a scan comes after the last scan of its sensor. Scans that were ahead of the clock are
/// not compared, because such a scan would keep all others out until its time has come. A lower
/// number with a later stamp means that the sender was restarted.
bool Intake::is_next(Track &track, const ScanSlot &slot, std::int32_t ahead, std::uint32_t sequence)
{
    if (ahead == 0 || slot.stamp_us == track.stamp_us) {
        counts_->add(GPOM_WIRE_SCANS_REPEATED);
        note(GPOM_WIRE_PROBLEM_SCAN_REPEATED, slot, track.stamp_us, sequence);
        return false;
    }
    if (slot.stamp_us < track.order_us && !is_set_back(track, slot.stamp_us)) {
        counts_->add(ahead < 0 ? GPOM_WIRE_SCANS_REORDERED : GPOM_WIRE_SCANS_JUMPED_BACK);
        note(ahead < 0 ? GPOM_WIRE_PROBLEM_SCAN_REORDERED : GPOM_WIRE_PROBLEM_SCAN_BACK, slot,
             track.stamp_us, sequence);
        return false;
    }
    return true;
}

/// Note a problem of a scan.
void Intake::note(std::uint32_t kind, const ScanSlot &slot, std::int64_t other_us, double value,
                  double limit)
{
    Problem problem = {kind};
    problem.i_sensor = slot.i_sensor;
    problem.stamp_us = slot.stamp_us;
    problem.other_us = other_us;
    problem.value = value;
    problem.limit = limit;
    problems_->note(problem);
}

/// Count scans in a row that are before the newest scan, each newer than the one before. True: so
/// many came that the sender's clock must have been set back.
bool Intake::is_set_back(Track &track, std::int64_t stamp_us)
{
    track.n_behind =
        track.n_behind > 0 && stamp_us > track.behind_us ? track.n_behind + 1 : std::uint32_t{1};
    track.behind_us = stamp_us;
    return track.n_behind >= PoseRing::kSetBack;
}

/// Keep the scan in the spare slot, if there is another slot for the next scan.
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
        note_wild(slot.i_sensor, {slot.stamp_us, slot.pose.x_m, slot.pose.y_m, slot.pose.yaw_rad});
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

/// Estimate the latency of scans against poses. A constant latency turns the map, and no other
/// check finds it.
void Intake::learn_latency(const ScanSlot &slot)
{
    Latency &latency = latencies_[slot.i_sensor];
    const SensorConfig &sensor = config_->sensors[slot.i_sensor];
    if (sensor.type == ScanType::gpom_scan && std::isfinite(slot.pose.yaw_rad)) {
        latency.take_pose(slot.stamp_us, slot.pose.yaw_rad);
    }
    latency.take_scan(slot);
    double latency_s = 0.0;
    if (latency.find(latency_s) && std::fabs(latency_s) > kLatencyTold_s) {
        note(GPOM_WIRE_PROBLEM_LATENCY, slot, 0, latency_s,
             1e-6 * static_cast<double>(sensor.latency_us));
    }
}

/// Compare a pose with the last good pose of the map frame, of any channel. When the frame jumps,
/// the poses of the frame before are forgotten.
Continuity Intake::follow(const StampedPose &pose)
{
    if (config_->jump.rule == JumpRule::none) {
        return Continuity::follows;
    }
    const Continuity continuity = frame_.take(pose);
    if (continuity == Continuity::jumps) {
        ++n_jumps_;
        poses_.begin_frame();
        for (std::size_t i = 0; i < config_->n_sensors; ++i) {
            latencies_[i].begin_frame();
        }
    }
    return continuity;
}

/// True if a scan carries a stray pose. A pose that is not finite is refused later by the library.
bool Intake::is_stray(const ScanSlot &slot)
{
    const StampedPose pose = {slot.stamp_us, slot.pose.x_m, slot.pose.y_m, slot.pose.yaw_rad};
    return PoseRing::is_finite(pose) && follow(pose) == Continuity::strays;
}

/// Note a pose that the robot cannot have reached. It is of a sensor's scan, or of the pose
/// channel.
void Intake::note_wild(std::size_t i_sensor, const StampedPose &pose)
{
    const StampedPose &last = frame_.last();
    Problem problem = {GPOM_WIRE_PROBLEM_POSE_WILD};
    problem.i_sensor = i_sensor;
    problem.value = std::hypot(pose.x_m - last.x_m, pose.y_m - last.y_m);
    problem.limit = 1e-6 * std::fabs(static_cast<double>(pose.stamp_us - last.stamp_us));
    problems_->note(problem);
}

/// Decode a pose. False: the message is bad, and `problem` says why.
bool Intake::read_pose(const Message &message, StampedPose &pose, Problem &problem) const
{
    gpom_wire_fault_t fault = GPOM_WIRE_OK;
    if (config_->pose.type == PoseType::bot_pose) {
        gpom_wire_bot_pose_t read = {};
        fault = gpom_wire_bot_pose_decode(&read, message.bytes, message.n_bytes);
        const double(&q)[4] = read.orientation;
        if (fault == GPOM_WIRE_OK && !is_rotation(q)) {
            problem.kind = GPOM_WIRE_PROBLEM_POSE_QUATERNION;
            problem.value = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
            return false;
        }
        pose = {read.stamp_us, read.position_m[0], read.position_m[1], yaw_of(q)};
    } else {
        gpom_wire_pose2d_t read = {};
        fault = gpom_wire_pose2d_decode(&read, message.bytes, message.n_bytes);
        pose = {read.stamp_us, static_cast<double>(read.x_m), static_cast<double>(read.y_m),
                static_cast<double>(read.yaw_rad)};
    }
    const bool is_type = fault != GPOM_WIRE_TYPE;
    problem.kind = is_type ? GPOM_WIRE_PROBLEM_POSE_LENGTH : GPOM_WIRE_PROBLEM_POSE_TYPE;
    problem.type = gpom_wire_fingerprint(message.bytes, message.n_bytes);
    problem.value = static_cast<double>(message.n_bytes);
    return fault == GPOM_WIRE_OK && is_good_stamp(pose.stamp_us, message.wall_us, problem);
}

/// Add a pose to the ring. False: the pose is from the future, not finite, or not newer than the
/// newest pose.
bool Intake::is_order_kept(const StampedPose &pose, const Message &message, Problem &problem)
{
    StampedPose newest = {};
    problem.stamp_us = pose.stamp_us;
    problem.other_us = message.wall_us;
    problem.kind = GPOM_WIRE_PROBLEM_POSE_TOO_NEW;
    if (pose.stamp_us > message.wall_us + config_->intake.ahead_max_us) {
        return false;
    }
    problem.kind = PoseRing::is_finite(pose) ? GPOM_WIRE_PROBLEM_POSE_ORDER
                                             : GPOM_WIRE_PROBLEM_POSE_NOT_FINITE;
    problem.other_us = poses_.not_after(INT64_MAX, newest) ? newest.stamp_us : 0;
    const std::uint32_t n_gave_way = poses_.n_gave_way();
    const bool is_taken = poses_.push(pose, message.wall_us);
    counts_->add(GPOM_WIRE_POSES_REFUSED, poses_.n_gave_way() - n_gave_way);
    return is_taken;
}

void Intake::take_pose(const Message &message)
{
    counts_->add(GPOM_WIRE_POSES_RECEIVED);
    StampedPose pose = {};
    Problem problem = {GPOM_WIRE_PROBLEM_POSE_TYPE};
    if (!read_pose(message, pose, problem) || !is_order_kept(pose, message, problem)) {
        counts_->add(GPOM_WIRE_POSES_REFUSED);
        problems_->note(problem);
        return;
    }
    pose_arrived_us_ = message.arrived_us;
    switch (follow(pose)) {
    case Continuity::follows:
        for (std::size_t i = 0; i < config_->n_sensors; ++i) {
            latencies_[i].take_pose(pose.stamp_us, pose.yaw_rad);
        }
        break;
    case Continuity::strays:
        counts_->add(GPOM_WIRE_POSES_AT_JUMP);
        note_wild(kSensorsMax, pose);
        poses_.drop_newest();
        return;
    case Continuity::jumps:
        poses_.push(pose, message.wall_us); // the first pose of its frame
        break;
    }
    match_waiting();
}

/// Compare the odometry since an earlier pose with the newest pose.
void Intake::learn_odometry()
{
    StampedPose from = {}, to = {};
    if (odometry_ != nullptr && poses_.not_after(INT64_MAX, to) &&
        poses_.not_after(to.stamp_us - kLearn_us, from)) {
        // False: odometry has not come yet; the next call tries again.
        odometry_->learn(from, to, config_->pose.cov);
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

/// Act on the result of match(). True: the scan went on to the map or was dropped. False: it goes
/// on waiting.
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
        note_unmatched(GPOM_WIRE_PROBLEM_SCAN_BEFORE_POSES, queue_->slot(i_slot));
        drop(i_slot, GPOM_WIRE_SCANS_TOO_OLD);
        return true;
    case PoseMatch::gap:
        if (hold(queue_->slot(i_slot))) {
            hand_over(i_slot);
            return true;
        }
        note_unmatched(GPOM_WIRE_PROBLEM_SCAN_POSE_GAP, queue_->slot(i_slot));
        drop(i_slot, GPOM_WIRE_SCANS_NO_POSE);
        return true;
    case PoseMatch::not_yet:
        break;
    }
    return false;
}

/// The pose at a time and its covariance. It is carried on by odometry from the pose before, or
/// else interpolated between two poses. Waits for odometry that has not come yet.
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

/// Find the poses of a scan. If the pose of its latest beam has not come yet, the whole scan waits.
PoseMatch Intake::match(ScanSlot &slot) const
{
    StampedPose pose = {};
    float beam_cov[9]; // all beams share the covariance of the scan
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

/// Give a scan the last pose before it, if that pose may be held for so long.
bool Intake::hold(ScanSlot &slot) const
{
    StampedPose last = {};
    if (!poses_.not_after(slot.stamp_us, last) ||
        slot.latest_us - last.stamp_us > config_->pose.hold_max_us) {
        return false;
    }
    std::copy_n(config_->pose.cov, 9, slot.cov);
    const bool is_exact = slot.cov[0] == 0.0f && slot.cov[4] == 0.0f && slot.cov[8] == 0.0f;
    slot.pose = {last.x_m, last.y_m, last.yaw_rad, is_exact ? nullptr : slot.cov};
    if (slot.is_per_beam) {
        std::fill_n(slot.poses, slot.n_ranges, slot.pose);
    }
    return true;
}

/// Note that a scan gets no pose. If poses do come, but with quite different stamps, note that
/// their clock is another one.
void Intake::note_unmatched(std::uint32_t kind, const ScanSlot &slot)
{
    StampedPose newest = {};
    const bool has_pose = poses_.not_after(INT64_MAX, newest);
    const bool is_alive = has_pose && slot.arrived_us - pose_arrived_us_ < kPosesCome_us;
    const bool is_far = std::llabs(newest.stamp_us - slot.stamp_us) > kTwoClocks_us;
    kind = is_alive && is_far ? std::uint32_t{GPOM_WIRE_PROBLEM_TWO_CLOCKS} : kind;
    note(kind, slot, has_pose ? newest.stamp_us : 0);
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
        ScanSlot &slot = queue_->slot(i_slot);
        if (monotonic_us - slot.arrived_us <= config_->pose.wait_max_us) {
            waiting_[n_left++] = i_slot;
        } else if (hold(slot)) {
            hand_over(i_slot);
        } else {
            note_unmatched(GPOM_WIRE_PROBLEM_SCAN_NO_POSE, slot);
            drop(i_slot, GPOM_WIRE_SCANS_NO_POSE);
        }
    }
    n_waiting_ = n_left;
}

} // namespace gpomd
