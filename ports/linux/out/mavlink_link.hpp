// The UDP socket or serial port that MAVLink messages go to. No call waits.
#ifndef GPOM_LINUX_MAVLINK_LINK_HPP
#define GPOM_LINUX_MAVLINK_LINK_HPP

#include "ports/linux/config/mavlink_config.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

enum class MavlinkWrite : std::uint8_t {
    sent,    ///< The kernel has the message, or its beginning; flush() sends what is left.
    full,    ///< Older bytes are still waiting. Nothing of the message is sent.
    refused, ///< UDP: no program listens at the address.
    failed   ///< The network does not carry the message, or the port is closed.
};

/// Used by one thread.
class MavlinkLink {
public:
    ~MavlinkLink() { close(); }
    MavlinkLink() = default;
    MavlinkLink(const MavlinkLink &) = delete;
    MavlinkLink &operator=(const MavlinkLink &) = delete;

    /// False: `problem` says why not.
    bool open(const MavlinkConfig &config, const char *&problem);
    void close();
    bool is_open() const { return fd_ >= 0; }

    /// Send one message of at most GPOM_MAVLINK_BYTES. A serial port that failed is closed.
    MavlinkWrite write(const std::uint8_t *bytes, std::size_t n_bytes);
    /// Send what is left of the last message.
    void flush();
    /// Forget what came over the serial port, so that its buffer does not fill.
    void forget_input();

private:
    bool open_udp(const MavlinkConfig &config, const char *&problem);
    bool is_busy() const;
    MavlinkWrite fail(int error);

    int fd_ = -1;
    bool is_serial_ = false;
    std::uint8_t rest_[GPOM_MAVLINK_BYTES] = {}; ///< What is left of the last message.
    std::size_t n_rest_ = 0;
};

} // namespace gpomd

#endif
