// CAN: receives odometry, sends status, clearance and tiles. It has its own thread.
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

/// The parts that the thread works with. All of them outlive the thread.
struct CanLinks {
    MapThread *mapping;
    Odometry *odometry;
    Counts *counts;
};

class CanPort {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, const CanLinks &links);

    /// Receive frames from now on, if the interface is there. Otherwise `run` goes on looking for
    /// it.
    void open();
    /// Work until `stop`, then send a last status. Does nothing if CAN is not configured.
    void run(const std::atomic<bool> &stop);

    bool is_used() const { return config_ != nullptr && config_->can.interface[0] != '\0'; }
    /// Increases as long as the thread runs.
    std::uint64_t pulse() const { return pulse_.load(std::memory_order_relaxed); }
    /// The next line for the log, each once. NULL: nothing new. Any one thread may call this.
    const char *next_news();

private:
    /// Events that the log reports, one bit each.
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
    /// A message that is sent every period. Late turns are skipped.
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
    bool is_missed_ = false; ///< The log has reported that the interface is not there.
    bool is_bus_off_ = false;
    std::int64_t down_us_ = 0;       ///< When the interface went down, by the clock that stamps are
                                     ///< of. 0: it is up.
    bool is_silent_ = true;          ///< No odometry came within its time-out.
    std::int64_t motion_us_ = 0;     ///< When odometry last came, monotonic.
    std::int64_t write_next_us_ = 0; ///< No frame is sent before this time, because the interface's
                                     ///< queue was full.
    std::int64_t back_off_us_ = 0;   ///< Length of the last pause.
    std::atomic<std::uint32_t> news_{0};
    std::atomic<std::uint64_t> pulse_{0};
};

} // namespace gpomd

#endif
