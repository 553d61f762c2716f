#include "ports/linux/out/mavlink_port.hpp"

#include "ports/linux/base/clock.hpp"

#include <poll.h>

#include <algorithm>

namespace gpomd
{

namespace
{

/// Longest sleep. The thread checks the daemon's stop flag at least this often.
constexpr std::int64_t kWait_us = 20000;
constexpr std::int64_t kHeartbeatPeriod_us = 1000000;
constexpr std::int64_t kOpenPeriod_us = 500000;
/// After this many messages in a row that went out, the log says that all is well again. An address
/// where nobody listens refuses every second message.
constexpr std::uint32_t kFlowing = 50;

constexpr const char *kNews[] = {
    "is open: MAVLink messages are sent",
    "cannot be opened; gpomd tries again: ",
    "was removed, or failed; gpomd waits until it comes back",
    "refuses MAVLink messages: no program listens there; start it, or set mavlink.to",
    "is not reached by MAVLink messages; `ip route get ADDRESS` shows how the network carries them",
    "takes fewer MAVLink messages than are sent; lower mavlink.rate_hz or raise mavlink.baud",
    "takes MAVLink messages again"};

gpom_mavlink_state_t mavlink_state(gpom_wire_state_t state)
{
    switch (state) {
    case GPOM_WIRE_STATE_STARTING:
        return GPOM_MAVLINK_STARTING;
    case GPOM_WIRE_STATE_MAPPING:
        return GPOM_MAVLINK_MAPPING;
    case GPOM_WIRE_STATE_STOPPING:
        return GPOM_MAVLINK_STOPPING;
    default:
        return GPOM_MAVLINK_STALE;
    }
}

/// True if it is time for something with this period. Late turns are skipped.
bool has_come(std::int64_t &next_us, std::int64_t period_us, std::int64_t now_us)
{
    if (now_us < next_us) {
        return false;
    }
    next_us = std::max(next_us + period_us, now_us + period_us / 2);
    return true;
}

} // namespace

void MavlinkPort::init(const Config &config, const SurroundingsLinks &links, Counts &counts)
{
    static_assert(sizeof kNews / sizeof *kNews == static_cast<std::size_t>(News::count),
                  "a sentence for each");
    config_ = &config;
    counts_ = &counts;
    sender_ = {config.mavlink.system_id, config.mavlink.component_id, 0};
    surroundings_.init(config, links);
}

void MavlinkPort::tell(News news)
{
    news_.fetch_or(1u << static_cast<unsigned>(news), std::memory_order_relaxed);
}

bool MavlinkPort::next_news(MavlinkNews &news)
{
    const std::uint32_t bits = news_.load(std::memory_order_relaxed);
    for (unsigned i = 0; i < static_cast<unsigned>(News::count); ++i) {
        if ((bits >> i & 1u) != 0) {
            news_.fetch_and(~(1u << i), std::memory_order_relaxed);
            const char *const problem = problem_.load(std::memory_order_relaxed);
            const bool has_problem = i == static_cast<unsigned>(News::absent) && problem != nullptr;
            news = {kNews[i], has_problem ? problem : ""};
            return true;
        }
    }
    return false;
}

void MavlinkPort::run(const std::atomic<bool> &stop)
{
    if (!is_used()) {
        return;
    }
    while (!stop.load(std::memory_order_relaxed)) {
        pulse_.fetch_add(1, std::memory_order_relaxed);
        try_open(monotonic_us());
        link_.flush();
        link_.forget_input();
        send_due(monotonic_us());
        wait(monotonic_us());
    }
    send_obstacles(true);
    send_heartbeat();
}

void MavlinkPort::try_open(std::int64_t now_us)
{
    if (link_.is_open() || now_us < open_next_us_) {
        return;
    }
    open_next_us_ = now_us + kOpenPeriod_us;
    const char *problem = nullptr;
    if (link_.open(config_->mavlink, problem)) {
        tell(News::open);
    } else if (!is_missed_) {
        problem_.store(problem, std::memory_order_relaxed);
        tell(News::absent);
    }
    is_missed_ = !link_.is_open();
    told_ = MavlinkWrite::sent;
}

void MavlinkPort::wait(std::int64_t now_us) const
{
    const std::int64_t next_us = std::min(obstacles_next_us_, heartbeat_next_us_);
    const std::int64_t wait_us = std::clamp<std::int64_t>(next_us - now_us, 0, kWait_us);
    poll(nullptr, 0, static_cast<int>((wait_us + 999) / 1000));
}

void MavlinkPort::send_due(std::int64_t now_us)
{
    surroundings_.look(now_us);
    if (has_come(obstacles_next_us_, config_->mavlink.period_us, now_us)) {
        send_obstacles(false);
    }
    if (has_come(heartbeat_next_us_, kHeartbeatPeriod_us, now_us)) {
        send_heartbeat();
    }
}

/// If the map is stale or the robot's place is not known, no sector has a reading.
void MavlinkPort::send_obstacles(bool is_stopping)
{
    const MavlinkConfig &config = config_->mavlink;
    gpom_lowres_info_t info = {};
    bool is_known = false;
    for (int i = 0; i < Surroundings::kTries && !is_known; ++i) {
        surroundings_.take(is_stopping);
        is_known = surroundings_.look_about(
            {config.range_m, config.radius_m, sectors_, config.n_sectors}, info);
    }
    gpom_mavlink_obstacles_t message;
    gpom_mavlink_obstacles_init(&message, config.n_sectors, config.range_m);
    message.stamp_us = surroundings_.place().stamp_us;
    message.sensor = static_cast<std::uint8_t>(config.sensor);
    if (is_known) {
        gpom_mavlink_set_sectors(&message, sectors_);
    }
    std::uint8_t bytes[GPOM_MAVLINK_BYTES];
    send(bytes, gpom_mavlink_obstacle_distance(&sender_, &message, bytes));
}

void MavlinkPort::send_heartbeat()
{
    std::uint8_t bytes[GPOM_MAVLINK_BYTES];
    send(bytes, gpom_mavlink_heartbeat(&sender_, mavlink_state(surroundings_.state()), bytes));
}

void MavlinkPort::send(const std::uint8_t *bytes, std::size_t n_bytes)
{
    const bool was_open = link_.is_open();
    const MavlinkWrite result = link_.write(bytes, n_bytes);
    counts_->add(result == MavlinkWrite::sent ? GPOM_WIRE_MAVLINK_SENT
                                              : GPOM_WIRE_MAVLINK_NOT_SENT);
    if (was_open && !link_.is_open()) {
        tell(News::gone);
        is_missed_ = true; // the log reports this once
    } else if (was_open) {
        note(result);
    }
}

/// Report when messages stop to go out, and when they do again.
void MavlinkPort::note(MavlinkWrite result)
{
    n_flowing_ = result == MavlinkWrite::sent ? n_flowing_ + 1 : 0;
    if (result != MavlinkWrite::sent && result != told_) {
        told_ = result;
        tell(result == MavlinkWrite::refused ? News::refused
             : result == MavlinkWrite::full  ? News::full
                                             : News::failed);
    } else if (told_ != MavlinkWrite::sent && n_flowing_ >= kFlowing) {
        told_ = MavlinkWrite::sent;
        tell(News::flows);
    }
}

} // namespace gpomd
