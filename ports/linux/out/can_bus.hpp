// A raw socket of SocketCAN: receives and sends frames, and survives the loss of its interface.
#ifndef GPOM_LINUX_CAN_BUS_HPP
#define GPOM_LINUX_CAN_BUS_HPP

#include "ports/linux/config/can_config.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A frame as received.
struct CanFrame {
    std::uint32_t id; ///< With CAN_EFF_FLAG. An error frame has CAN_ERR_FLAG and its class.
    std::size_t n_bytes;
    std::uint8_t bytes[GPOM_CAN_BYTES_MAX];
    std::int64_t stamp_us; ///< When the kernel received it, by the clock that stamps are of.
};

enum class CanRead : std::uint8_t {
    frame,
    none, ///< No frame is waiting.
    down, ///< The interface is down. The socket stays open.
    gone  ///< The interface was removed, or the socket failed. The socket is closed.
};

enum class CanWrite : std::uint8_t {
    sent,
    full, ///< The interface's queue is full. Wait before the next frame.
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

    /// Open a socket on the interface. It receives only the odometry's messages and error frames,
    /// and FD frames if configured. False: there is no such interface now, or the kernel has no
    /// CAN.
    bool open(const CanConfig &config);
    void close();
    bool is_open() const { return fd_ >= 0; }
    /// True if the interface can carry FD frames.
    bool has_fd() const { return has_fd_; }
    /// The descriptor to poll. -1: closed.
    int fd() const { return fd_; }

    /// Get the next frame. Does not wait.
    CanRead read(CanFrame &frame);
    /// Send n_bytes: up to 8 in a classic frame, more in an FD frame.
    CanWrite write(std::uint32_t id, const std::uint8_t *bytes, std::size_t n_bytes);

    /// Number of frames that the kernel dropped since the last call, because the socket's buffer
    /// was full.
    std::uint32_t take_overflow();

private:
    bool set_up(const CanConfig &config);

    int fd_ = -1;
    bool has_fd_ = false;
    std::uint32_t overflow_ = 0;       ///< The kernel's drop count of this socket, modulo 2^32.
    std::uint32_t overflow_taken_ = 0; ///< The part of overflow_ that take_overflow() has returned
                                       ///< so far.
};

} // namespace gpomd

#endif
