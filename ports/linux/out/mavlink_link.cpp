#include "ports/linux/out/mavlink_link.hpp"

#include "ports/host/serial_port.hpp"

#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace gpomd
{

bool MavlinkLink::open(const MavlinkConfig &config, const char *&problem)
{
    close();
    is_serial_ = config.is_serial;
    if (!is_serial_) {
        return open_udp(config, problem);
    }
    fd_ = gpom_tools::open_serial_port(config.to, config.baud, problem);
    return is_open();
}

/// A connected socket, so that the kernel reports that nobody listens.
bool MavlinkLink::open_udp(const MavlinkConfig &config, const char *&problem)
{
    fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0 ||
        connect(fd_, reinterpret_cast<const sockaddr *>(&config.udp), sizeof config.udp) != 0) {
        problem = std::strerror(errno);
        close();
    }
    return is_open();
}

void MavlinkLink::close()
{
    if (fd_ >= 0) {
        ::close(fd_);
    }
    fd_ = -1;
    n_rest_ = 0;
}

/// True if more than one message is still waiting in the serial port. Newer messages would come
/// late.
bool MavlinkLink::is_busy() const
{
    int n_waiting = 0;
    return is_serial_ && ioctl(fd_, TIOCOUTQ, &n_waiting) == 0 &&
           n_waiting > static_cast<int>(GPOM_MAVLINK_BYTES);
}

MavlinkWrite MavlinkLink::fail(int error)
{
    if (error == EAGAIN || error == EWOULDBLOCK || error == EINTR || error == ENOBUFS) {
        return MavlinkWrite::full;
    }
    if (is_serial_) {
        close();
    }
    return error == ECONNREFUSED ? MavlinkWrite::refused : MavlinkWrite::failed;
}

MavlinkWrite MavlinkLink::write(const std::uint8_t *bytes, std::size_t n_bytes)
{
    flush();
    if (!is_open() || n_bytes > sizeof rest_) {
        return MavlinkWrite::failed;
    }
    if (n_rest_ > 0 || is_busy()) {
        return MavlinkWrite::full;
    }
    const ssize_t n = ::write(fd_, bytes, n_bytes);
    if (n < 0) {
        return fail(errno);
    }
    n_rest_ = n_bytes - static_cast<std::size_t>(n);
    std::memcpy(rest_, bytes + n, n_rest_);
    return MavlinkWrite::sent;
}

void MavlinkLink::flush()
{
    const ssize_t n = n_rest_ > 0 ? ::write(fd_, rest_, n_rest_) : 0;
    if (n < 0) {
        fail(errno);
    } else {
        n_rest_ -= static_cast<std::size_t>(n);
        std::memmove(rest_, rest_ + n, n_rest_);
    }
}

void MavlinkLink::forget_input()
{
    if (is_serial_ && is_open()) {
        tcflush(fd_, TCIFLUSH);
    }
}

} // namespace gpomd
