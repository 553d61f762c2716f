// A raw socket of SocketCAN: frames in and out, whatever becomes of the interface.
#ifndef GPOM_LINUX_CAN_BUS_HPP
#define GPOM_LINUX_CAN_BUS_HPP

#include "ports/linux/config/can_config.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A frame as it came.
struct CanFrame {
    std::uint32_t id; ///< With CAN_EFF_FLAG; an error frame: CAN_ERR_FLAG and its class.
    std::size_t n_bytes;
    std::uint8_t bytes[GPOM_CAN_BYTES_MAX];
    std::int64_t stamp_us; ///< When the kernel received it, by the clock that stamps are of.
};

enum class CanRead : std::uint8_t {
    frame,
    none, ///< Nothing is waiting.
    down, ///< The interface is down; the socket stays.
    gone  ///< The interface was removed, or the socket failed: it is closed.
};

enum class CanWrite : std::uint8_t {
    sent,
    full, ///< The interface's queue is full: wait before the next.
    down, ///< The interface is down.
    failed
};

/// Used by one thread.
class CanBus {
public:
    ~CanBus() { close(); }
    CanBus() = default;
    CanBus(const CanBus &) = delete;
    CanBus &operator=(const CanBus &) = delete;

    /// Open a socket on the interface that takes the odometry's messages and error frames alone,
    /// FD frames too if configured. False: no such interface now, or no CAN in this kernel.
    bool open(const CanConfig &config);
    void close();
    bool is_open() const { return fd_ >= 0; }
    /// Can the interface carry FD frames?
    bool has_fd() const { return has_fd_; }
    /// To be polled; -1: closed.
    int fd() const { return fd_; }

    /// The next frame; does not wait.
    CanRead read(CanFrame &frame);
    /// Send n_bytes, 8 or fewer in a classic frame, else in an FD frame.
    CanWrite write(std::uint32_t id, const std::uint8_t *bytes, std::size_t n_bytes);

    /// Frames that the kernel dropped since the last call, the socket's buffer being full.
    std::uint32_t take_overflow();

private:
    bool set_up(const CanConfig &config);

    int fd_ = -1;
    bool has_fd_ = false;
    std::uint32_t overflow_ = 0;       ///< Of this socket, modulo 2^32.
    std::uint32_t overflow_taken_ = 0; ///< Told by take_overflow() so far.
};

} // namespace gpomd

#endif
