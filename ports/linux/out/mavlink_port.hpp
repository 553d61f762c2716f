// MAVLink: sends the distances about the robot to an autopilot. It has its own thread.
#ifndef GPOM_LINUX_MAVLINK_PORT_HPP
#define GPOM_LINUX_MAVLINK_PORT_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/out/mavlink_link.hpp"
#include "ports/linux/out/surroundings.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A sentence for the log: where messages go, then `text`, then `reason`, in static storage.
struct MavlinkNews {
    const char *text;
    const char *reason; ///< Empty: there is none.
};

class MavlinkPort {
public:
    void init(const Config &config, const SurroundingsLinks &links, Counts &counts);

    /// Work until `stop`, then send a last OBSTACLE_DISTANCE without a reading and a last
    /// HEARTBEAT. Does nothing if MAVLink is not configured.
    void run(const std::atomic<bool> &stop);

    bool is_used() const { return config_ != nullptr && config_->mavlink.is_used; }
    /// Increases as long as the thread runs.
    std::uint64_t pulse() const { return pulse_.load(std::memory_order_relaxed); }
    /// Get the next news for the log, each once. False: there is none. Any one thread may call
    /// this.
    bool next_news(MavlinkNews &news);

private:
    /// Events that the log reports, one bit each.
    enum class News : std::uint8_t { open, absent, gone, refused, failed, full, flows, count };

    void tell(News news);
    void try_open(std::int64_t now_us);
    void wait(std::int64_t now_us) const;
    void send_due(std::int64_t now_us);
    void send_obstacles(bool is_stopping);
    void send_heartbeat();
    void send(const std::uint8_t *bytes, std::size_t n_bytes);
    void note(MavlinkWrite result);

    const Config *config_ = nullptr;
    Counts *counts_ = nullptr;
    Surroundings surroundings_;
    MavlinkLink link_;
    gpom_mavlink_sender_t sender_ = {};
    gpom_sector_t sectors_[GPOM_MAVLINK_SECTORS_MAX] = {};
    std::int64_t obstacles_next_us_ = 0, heartbeat_next_us_ = 0; ///< Monotonic.
    std::int64_t open_next_us_ = 0;
    bool is_missed_ = false;                     ///< The log has reported that it cannot be opened.
    MavlinkWrite told_ = MavlinkWrite::sent;     ///< What the log has reported about messages.
    std::uint32_t n_flowing_ = 0;                ///< Messages that went out in a row.
    std::atomic<const char *> problem_{nullptr}; ///< Why it cannot be opened.
    std::atomic<std::uint32_t> news_{0};
    std::atomic<std::uint64_t> pulse_{0};
};

} // namespace gpomd

#endif
