#include "ports/linux/map/mapping.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpomd
{

namespace
{

/// Longest sleep when there is no work.
constexpr std::int64_t kSleep_us = 100000;

std::size_t scratch_need(const Config &config)
{
    const gpom_params_t &params = config.map.params;
    return GPOM_SCRATCH_BYTES(params.n_hits + params.n_free, gpom_lanes());
}

gpom_jump_t rule_of(JumpRule rule)
{
    switch (rule) {
    case JumpRule::forget:
        return GPOM_JUMP_FORGET;
    case JumpRule::clear:
        return GPOM_JUMP_CLEAR;
    case JumpRule::none: // without jumps any rule will do
    case JumpRule::keep:
        break;
    }
    return GPOM_JUMP_KEEP;
}

/// Number of readings that give no information about the surroundings. All readings of a covered
/// sensor are of this kind.
std::uint64_t unusable(const gpom_stats_t &stats)
{
    return stats.beams_nan + stats.beams_not_positive + stats.beams_too_near + stats.beams_masked;
}

/// Stamp of the newest scan in a map. A snapshot may hold stamps of any program, so they are
/// clamped to the range that gpomd accepts.
std::int64_t newest_stamp_us(const gpom_lowres_info_t &info)
{
    const std::int64_t stamp0_us = std::clamp(info.stamp0_us, -kStampMax_us, kStampMax_us);
    const std::int64_t stamp_us = stamp0_us + std::int64_t{1000} * info.newest_ms;
    return std::clamp<std::int64_t>(stamp_us, 0, kStampMax_us);
}

} // namespace

std::size_t MapThread::need(const Config &config)
{
    return Memory::need<std::uint8_t>(gpom_map_bytes(&config.map)) +
           Memory::need<std::uint8_t>(scratch_need(config));
}

const char *MapThread::init(const Config &config, Memory &memory, const MapLinks &links)
{
    config_ = &config;
    links_ = links;
    const std::size_t map_bytes = gpom_map_bytes(&config.map);
    auto *const map_memory = memory.take<std::uint8_t>(map_bytes);
    gpom_status_t status = gpom_map_init(&map_, &config.map, map_memory, map_bytes);
    if (status == GPOM_OK) {
        status = gpom_map_begin_late(map_, config.late_m);
    }
    if (status != GPOM_OK) {
        return gpom_status_str(status);
    }
    std::fill_n(state_.pose, 3, std::numeric_limits<double>::quiet_NaN());
    scratch_ = {memory.take<std::uint8_t>(scratch_need(config)), scratch_need(config)};
    return scratch_.mem_bytes >= gpom_scratch_bytes(map_) ? nullptr : gpom_status_str(GPOM_ERR_MEM);
}

void MapThread::run(const std::atomic<bool> &stop)
{
    bool is_done = false; // no work is left for step()
    while (!stop.load(std::memory_order_relaxed)) {
        pulse_.fetch_add(1, std::memory_order_relaxed);
        std::uint32_t i_slot = 0;
        const bool is_saving = links_.snapshots->step(map_, monotonic_us());
        const bool is_busy = is_saving || !is_done || links_.queries->ready.size() > 0;
        const std::int64_t wait_us = std::min(kSleep_us, links_.snapshots->wait_us(monotonic_us()));
        if (links_.scans->ready.pop(i_slot, is_busy ? 0 : wait_us)) {
            insert(links_.scans->slot(i_slot));
            links_.scans->free.push(i_slot);
            is_done = !step();
        } else if (!is_done) {
            is_done = !step(); // there are no scans: do another slice
        }
        if (links_.queries->ready.pop(i_slot, 0)) {
            answer_one(i_slot);
            links_.queries->free.push(i_slot);
        }
    }
    for (std::uint32_t i_slot = 0; links_.scans->ready.pop(i_slot, 0);) {
        insert(links_.scans->slot(i_slot));
        links_.scans->free.push(i_slot);
    }
    links_.snapshots->finish(map_);
}

bool MapThread::restore(gpom_snapshot_report_t &report)
{
    gpom_lowres_info_t info = {};
    if (!links_.snapshots->is_used() || !links_.snapshots->restore(map_, report) ||
        gpom_lowres_info(map_, GPOM_LAYER_COARSE, &info) != GPOM_OK) {
        return false;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.has_map = report.n_beams > 0;
    state_.frame_epoch = info.frame_epoch;
    state_.stamp_us = newest_stamp_us(info);
    std::fill_n(state_.pose, 3, std::numeric_limits<double>::quiet_NaN());
    state_.n_beams = report.n_beams;
    return true;
}

/// Do one slice of the work that scans leave behind. While many scans wait, the slice is the
/// smallest that keeps all of the work moving. False: no work was left.
bool MapThread::step()
{
    const gpom_params_t &params = config_->map.params;
    const bool is_behind = links_.scans->ready.size() > links_.scans->n_slots() / 4;
    const std::uint64_t budget =
        is_behind ? GPOM_STEP_OPS_MIN(params.n_hits + params.n_free) : config_->step_ops;
    std::uint64_t n_used = 0;
    const gpom_status_t status = gpom_map_step(map_, budget, &scratch_, &n_used);
    return status == GPOM_OK && n_used > 0;
}

/// Start a new map frame with its first scan. The rule says whether the map is kept or forgotten.
/// The pose of the robot is unknown to others until a scan has been inserted.
void MapThread::begin_frame(const ScanSlot &slot, gpom_jump_t rule)
{
    const double forget_m = config_->jump.forget_m;
    const gpom_disc_t after = {slot.pose.x_m, slot.pose.y_m, forget_m};
    const gpom_disc_t before = {state_.pose[0], state_.pose[1], forget_m};
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        std::copy_n(state_.pose, 3, state_.jump_from);
        std::fill_n(state_.pose, 3, std::numeric_limits<double>::quiet_NaN());
        state_.jump_to[0] = slot.pose.x_m;
        state_.jump_to[1] = slot.pose.y_m;
        state_.jump_to[2] = slot.pose.yaw_rad;
    }
    n_jumps_ = slot.n_jumps;
    gpom_status_t status = gpom_map_jump(map_, rule, &after);
    if (status == GPOM_OK && rule == GPOM_JUMP_FORGET && std::isfinite(before.x_m)) {
        status = gpom_map_forget(map_, &before);
    }
    {
        const std::uint32_t epoch = frame_epoch();
        const std::lock_guard<std::mutex> lock(mutex_);
        state_.frame_epoch = epoch; // if this scan cannot be inserted, the state only has no pose
    }
    if (status == GPOM_OK) {
        // Counted last: a thread that sees the count finds the places.
        links_.counts->add(GPOM_WIRE_FRAME_JUMPS);
    }
}

/// Choose what happens to the map when the frame jumps to a pose: the configured rule if the pose
/// is within reach of the map's origin. Otherwise, if the origin follows the robot, the map is
/// cleared, because the old origin would keep every scan out. False: the pose is out of reach of a
/// fixed origin, or of any map.
bool MapThread::can_begin_frame(const gpom_pose_t &pose, gpom_jump_t &rule) const
{
    gpom_point_t origin = {};
    const bool has_origin = gpom_map_origin(map_, &origin) == GPOM_OK;
    const double far_m = std::hypot(pose.x_m - origin.x_m, pose.y_m - origin.y_m);
    if (has_origin && far_m <= GPOM_REACH_M) {
        rule = rule_of(config_->jump.rule);
        return true;
    }
    rule = GPOM_JUMP_CLEAR;
    return config_->map.rebase_m > 0.0f && std::fabs(pose.x_m) <= GPOM_PLACE_MAX_M &&
           std::fabs(pose.y_m) <= GPOM_PLACE_MAX_M;
}

void MapThread::insert(const ScanSlot &slot)
{
    gpom_jump_t rule = GPOM_JUMP_KEEP;
    if (slot.n_jumps != n_jumps_ && can_begin_frame(slot.pose, rule)) {
        begin_frame(slot, rule);
    }
    const gpom_sensor_t &sensor = config_->sensors[slot.i_sensor].sensor;
    const gpom_stats_t before = stats();
    gpom_status_t status = GPOM_OK;
    if (slot.is_per_beam) {
        const gpom_sweep_t sweep = {slot.stamp_us, slot.ranges_m, slot.bearings_rad, slot.poses,
                                    slot.n_ranges};
        status = gpom_sweep_insert(map_, &sweep, &sensor, &slot.pose);
    } else {
        const gpom_scan_t scan = {slot.stamp_us, slot.angle_min_rad, slot.angle_step_rad,
                                  slot.ranges_m, slot.n_ranges};
        status = gpom_scan_insert(map_, &scan, &sensor, &slot.pose);
    }
    if (status != GPOM_OK) {
        note_refused(slot, status);
        return;
    }
    const gpom_stats_t after = stats();
    const bool is_fresh = unusable(after) - unusable(before) < slot.n_ranges;
    if (!is_fresh) {
        note_unusable(slot, before, after);
    }
    note_inserted(slot, is_fresh);
}

void MapThread::note_refused(const ScanSlot &slot, gpom_status_t status)
{
    Problem problem = {GPOM_WIRE_PROBLEM_SCAN_BAD_POSE};
    problem.i_sensor = slot.i_sensor;
    problem.value = slot.pose.x_m;
    if (status == GPOM_ERR_REACH) {
        gpom_point_t origin = {};
        problem.kind = GPOM_WIRE_PROBLEM_SCAN_OUT_OF_REACH;
        problem.limit = GPOM_REACH_M;
        problem.value = gpom_map_origin(map_, &origin) == GPOM_OK
                            ? std::hypot(slot.pose.x_m - origin.x_m, slot.pose.y_m - origin.y_m)
                            : 0.0;
    }
    // the other fields were checked on arrival: the pose must be bad
    links_.counts->add(status == GPOM_ERR_REACH ? GPOM_WIRE_SCANS_OUT_OF_REACH
                                                : GPOM_WIRE_SCANS_BAD_POSE);
    links_.problems->note(problem);
}

/// Note that no reading of a scan is usable, with the most frequent cause.
void MapThread::note_unusable(const ScanSlot &slot, const gpom_stats_t &before,
                              const gpom_stats_t &after)
{
    const struct {
        const char *name;
        std::uint64_t n;
    } causes[] = {
        {"missing, there are none: does the driver send empty scans?",
         slot.n_ranges == 0 ? UINT64_MAX : 0},
        {"NaN: the sensor is covered, or its driver means \"no return\" by it",
         after.beams_nan - before.beams_nan},
        {"0 or negative: the sensor is covered; if 0 is \"no return\", set zero = \"no_return\"",
         after.beams_not_positive - before.beams_not_positive},
        {"below range_min_m: the sensor is covered, or that is too high",
         after.beams_too_near - before.beams_too_near},
        {"in the sensor's masks: do these leave a bearing?",
         after.beams_masked - before.beams_masked}};
    Problem problem = {GPOM_WIRE_PROBLEM_SCAN_UNUSABLE};
    problem.i_sensor = slot.i_sensor;
    std::uint64_t n_most = 0;
    for (const auto &cause : causes) {
        problem.text = cause.n > n_most ? cause.name : problem.text;
        n_most = std::max(n_most, cause.n);
    }
    links_.problems->note(problem);
}

/// Frame epoch of the map now. No other thread changes it.
std::uint32_t MapThread::frame_epoch() const
{
    gpom_lowres_info_t info = {};
    return gpom_lowres_info(map_, GPOM_LAYER_COARSE, &info) == GPOM_OK ? info.frame_epoch : 0;
}

gpom_stats_t MapThread::stats() const
{
    gpom_stats_t stats = {};
    return gpom_map_stats(map_, &stats) == GPOM_OK ? stats : gpom_stats_t{};
}

/// Record an inserted scan. Only a fresh scan, one with a usable reading, prevents the state STALE.
void MapThread::note_inserted(const ScanSlot &slot, bool is_fresh)
{
    const gpom_stats_t counted = stats();
    const std::uint32_t epoch = frame_epoch();
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.has_map = true;
    state_.stamp_us = slot.stamp_us;
    state_.fresh_us = is_fresh ? monotonic_us() : state_.fresh_us;
    state_.frame_epoch = epoch;
    state_.pose[0] = slot.pose.x_m;
    state_.pose[1] = slot.pose.y_m;
    state_.pose[2] = slot.pose.yaw_rad;
    state_.lag_us = wall_us() - slot.stamp_us;
    state_.lag_us_max = std::max(state_.lag_us_max, state_.lag_us);
    state_.n_beams = gpom_map_beam_count(map_);
    state_.stats = counted;
    // Counted last: a thread that sees the count finds the scan in the state.
    links_.counts->add(GPOM_WIRE_SCANS_INSERTED);
}

MapState MapThread::state(bool reset_lag_max)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    const MapState state = state_;
    if (reset_lag_max) {
        state_.lag_us_max = 0;
    }
    return state;
}

void MapThread::answer_one(std::uint32_t i_slot)
{
    const AnswerContext context = {map_, &scratch_, wall_us(), state_.stamp_us,
                                   static_cast<std::int32_t>(frame_epoch())};
    std::uint8_t bytes[GPOM_WIRE_ANSWER_BYTES(GPOM_WIRE_POINTS_MAX)];
    gpom_wire_answer_status_t status = GPOM_WIRE_ANSWER_OK;
    const std::size_t n_bytes = answer(links_.queries->slot(i_slot), context, bytes, status);
    const bool is_sent =
        n_bytes > 0 && links_.sender->send(config_->publish.answer, bytes, n_bytes);
    const bool is_answered =
        is_sent && (status == GPOM_WIRE_ANSWER_OK || status == GPOM_WIRE_ANSWER_OUT_OF_REACH);
    links_.counts->add(is_answered ? GPOM_WIRE_QUERIES_ANSWERED : GPOM_WIRE_QUERIES_REFUSED);
}

} // namespace gpomd
