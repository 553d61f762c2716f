#include "ports/linux/lcm/channels.hpp"

#include <algorithm>
#include <cstring>

namespace gpomd
{

namespace
{

/// A channel without a message for this time is silent. Another channel is suggested only if it had
/// a message within this time.
constexpr std::int64_t kSilent_us = 4000000;

/// Period of the check for silent channels.
constexpr std::int64_t kCheckPeriod_us = 500000;

bool is_scan(std::uint64_t type)
{
    return type == GPOM_WIRE_SCAN_FINGERPRINT || type == GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT ||
           type == GPOM_WIRE_LIDAR_FINGERPRINT;
}

bool is_pose(std::uint64_t type)
{
    return type == GPOM_WIRE_BOT_POSE_FINGERPRINT || type == GPOM_WIRE_POSE2D_FINGERPRINT;
}

} // namespace

void Channels::listen(const char *channel, std::size_t i_sensor, std::int64_t now_us)
{
    for (std::size_t i = 0; i < n_listened_; ++i) {
        if (std::strcmp(listened_[i].channel, channel) == 0) {
            return; // sensors may share one channel
        }
    }
    listened_[n_listened_++] = {channel, i_sensor, now_us};
}

void Channels::init(const Config &config, Problems &problems, std::int64_t now_us)
{
    config_ = &config;
    problems_ = &problems;
    for (std::size_t i = 0; i < config.n_sensors; ++i) {
        listen(config.sensors[i].channel, i, now_us);
    }
    // With hold_max_us the channel may be silent.
    if (config.pose.channel[0] != '\0' && config.pose.hold_max_us == 0) {
        listen(config.pose.channel, kSensorsMax, now_us);
    }
}

void Channels::take(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes,
                    std::int64_t now_us)
{
    for (std::size_t i = 0; i < n_listened_; ++i) {
        if (std::strcmp(listened_[i].channel, channel) == 0) {
            listened_[i].heard_us = now_us;
            return;
        }
    }
    const std::uint64_t type = gpom_wire_fingerprint(bytes, n_bytes);
    if ((!is_scan(type) && !is_pose(type)) || std::strcmp(channel, config_->pose.channel) == 0) {
        return;
    }
    // The entry of the same channel, else the entry that has been silent the longest.
    Other *place = &others_[0];
    for (Other &other : others_) {
        if (std::strcmp(other.channel, channel) == 0) {
            place = &other;
            break;
        }
        place = other.heard_us < place->heard_us ? &other : place;
    }
    // LCM limits names to the size of ChannelName.
    std::memcpy(place->channel, channel, std::strlen(channel) + 1);
    place->type = type;
    place->heard_us = now_us;
}

/// The channel with the latest message among those that carry poses, or scans. NULL: there is none.
const Channels::Other *Channels::like(bool is_poses, std::int64_t now_us) const
{
    const Other *found = nullptr;
    for (const Other &other : others_) {
        const bool is_like = is_poses ? is_pose(other.type) : is_scan(other.type);
        if (is_like && now_us - other.heard_us < kSilent_us &&
            (found == nullptr || other.heard_us > found->heard_us)) {
            found = &other;
        }
    }
    return found;
}

void Channels::check(std::int64_t now_us)
{
    if (now_us - checked_us_ < kCheckPeriod_us) {
        return;
    }
    checked_us_ = now_us;
    for (std::size_t i = 0; i < n_listened_; ++i) {
        const Listened &listened = listened_[i];
        if (now_us - listened.heard_us < kSilent_us) {
            continue;
        }
        const Other *const other = like(listened.i_sensor == kSensorsMax, now_us);
        Problem problem = {GPOM_WIRE_PROBLEM_SILENT};
        problem.i_sensor = listened.i_sensor;
        problem.value = 1e-6 * static_cast<double>(now_us - listened.heard_us);
        if (other != nullptr) {
            problem.kind = GPOM_WIRE_PROBLEM_OTHER_CHANNEL;
            problem.type = other->type;
            std::memcpy(problem.channel, other->channel, sizeof problem.channel);
        }
        problems_->note(problem);
    }
}

} // namespace gpomd
