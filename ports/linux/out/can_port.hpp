// CAN: odometry in, status, clearance and tiles out; a thread of its own.
#ifndef GPOM_LINUX_CAN_PORT_HPP
#define GPOM_LINUX_CAN_PORT_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/map/mapping.hpp"
#include "ports/linux/out/can_bus.hpp"
#include "ports/linux/out/can_picture.hpp"
#include "ports/linux/pose/odometry.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// What the thread works on; all of it outlives the thread.
struct CanLinks {
    MapThread *mapping;
    Odometry *odometry;
    Counts *counts;
};

class CanPort {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, const CanLinks &links);

    /// Take frames from now on, if the interface is there; `run` goes on looking for it.
    void open();
    /// Work until `stop`, then say that it ends; nothing if CAN is not configured.
    void run(const std::atomic<bool> &stop);

    bool is_used() const { return config_ != nullptr && config_->can.interface[0] != '\0'; }
    /// Grows as long as the thread lives.
    std::uint64_t pulse() const { return pulse_.load(std::memory_order_relaxed); }
    /// Something for the log, once; NULL: nothing new. Any one thread.
    const char *next_news();

private:
    /// What is told in the log, bit by bit.
    enum class News : std::uint8_t {
        open,
        absent,
        no_fd,
        down,
        up,
        gone,
        bus_off,
        restarted,
        silent,
        heard,
        count
    };
    /// A message that is sent every period; late turns are not made up for.
    struct Turn {
        std::int64_t next_us;
        std::uint8_t alive;
        std::uint8_t sequence;
    };
    /// The last value of a signal.
    struct Value {
        bool is_known;
        double value;
        std::int64_t stamp_us;
    };

    void tell(News news);
    void try_open(std::int64_t now_us);
    void wait(std::int64_t now_us);
    void receive();
    void note_down();
    void note_up(std::int64_t stamp_us);
    void take_error(const CanFrame &frame);
    void take_message(const CanFrame &frame);
    bool take_signals(std::size_t i_message, const CanFrame &frame);
    void note_motion(std::int64_t stamp_us);
    void note_silence(std::int64_t now_us);
    bool has_come(Turn &turn, std::int64_t period_us, std::int64_t now_us) const;
    void send_due(std::int64_t now_us);
    void send_stopping();
    void send_status();
    void send_clearance();
    void send_clearance_fd();
    void send_tiles();
    void send(const CanSendConfig &to, const std::uint8_t *bytes, std::size_t n_bytes);

    const Config *config_ = nullptr;
    CanLinks links_ = {};
    CanBus bus_;
    CanPicture picture_;
    Turn status_ = {}, clearance_ = {}, clearance_fd_ = {}, tile_ = {};
    gpom_can_stream_t streams_[kCanMessagesMax] = {};
    Value values_[kCanSignals] = {};
    std::int64_t open_next_us_ = 0;
    bool is_missed_ = false; ///< It was told that the interface is not there.
    bool is_bus_off_ = false;
    std::int64_t down_us_ = 0;       ///< When the interface went down, as stamps are; 0: it is up.
    bool is_silent_ = true;          ///< No odometry for its time-out.
    std::int64_t motion_us_ = 0;     ///< When odometry last came; monotonic.
    std::int64_t write_next_us_ = 0; ///< No frame before: the interface's queue was full.
    std::int64_t back_off_us_ = 0;   ///< The last pause.
    std::atomic<std::uint32_t> news_{0};
    std::atomic<std::uint64_t> pulse_{0};
};

} // namespace gpomd

#endif
