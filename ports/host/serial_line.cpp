#include "ports/host/serial_line.hpp"

#include "ports/host/serial_port.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace gpom_tools
{

namespace
{

[[noreturn]] void fail_with(const std::string &name, const std::string &what)
{
    throw std::runtime_error(name + ": " + what);
}

bool begins_with(const std::string &text, const char *start) { return text.rfind(start, 0) == 0; }

int open_unix(const std::string &name)
{
    const std::string path = name.substr(std::strlen("unix:"));
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
        fail_with(name, "path is too long for a socket");
    }
    std::copy(path.begin(), path.end(), address.sun_path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0) {
        const int error = errno;
        if (fd >= 0) {
            close(fd);
        }
        fail_with(name, std::string(std::strerror(error)) +
                            "; start QEMU with -serial unix:PATH,server=on,wait=off");
    }
    return fd;
}

int open_tcp(const std::string &name)
{
    const std::string place = name.substr(std::strlen("tcp:"));
    const std::size_t colon = place.rfind(':');
    if (colon == std::string::npos || colon == 0) {
        fail_with(name, "must be tcp:HOST:PORT");
    }
    addrinfo wanted = {};
    wanted.ai_socktype = SOCK_STREAM;
    addrinfo *found = nullptr;
    const std::string host = place.substr(0, colon);
    const int result = getaddrinfo(host.c_str(), place.c_str() + colon + 1, &wanted, &found);
    if (result != 0) {
        fail_with(name, gai_strerror(result));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo *)> owner(found, freeaddrinfo);
    for (const addrinfo *at = found; at != nullptr; at = at->ai_next) {
        const int fd = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
        if (fd >= 0 && connect(fd, at->ai_addr, at->ai_addrlen) == 0) {
            return fd;
        }
        if (fd >= 0) {
            close(fd);
        }
    }
    fail_with(name, std::strerror(errno));
}

int open_port(const std::string &name, unsigned baud)
{
    if (!is_baud_rate(baud)) {
        fail_with(name, "--baud " + std::to_string(baud) + " is not one of " + baud_rates());
    }
    const char *problem = nullptr;
    const int fd = open_serial_port(name.c_str(), baud, problem);
    if (fd < 0) {
        fail_with(name, problem);
    }
    return fd;
}

} // namespace

SerialLine::SerialLine(const std::string &name, unsigned baud) : name_(name)
{
    fd_ = begins_with(name, "unix:")  ? open_unix(name)
          : begins_with(name, "tcp:") ? open_tcp(name)
                                      : open_port(name, baud);
    if (fcntl(fd_, F_SETFL, O_NONBLOCK) != 0) {
        fail("cannot be read without waiting");
    }
}

SerialLine::~SerialLine()
{
    if (fd_ >= 0) {
        close(fd_);
    }
}

std::size_t SerialLine::read(std::uint8_t *bytes, std::size_t n_max, int wait_ms)
{
    pollfd wait = {fd_, POLLIN, 0};
    if (poll(&wait, 1, wait_ms) <= 0) {
        return 0;
    }
    const ssize_t n = ::read(fd_, bytes, n_max);
    if (n > 0) {
        return static_cast<std::size_t>(n);
    }
    if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
        fail("the line ended: the device, or QEMU, is gone");
    }
    return 0;
}

bool SerialLine::write(const std::uint8_t *bytes, std::size_t n_bytes, int wait_ms)
{
    std::size_t n_sent = 0;
    while (n_sent < n_bytes) {
        pollfd wait = {fd_, POLLOUT, 0};
        if (poll(&wait, 1, wait_ms) == 0) {
            return false;
        }
        const ssize_t n = ::write(fd_, bytes + n_sent, n_bytes - n_sent);
        if (n >= 0) {
            n_sent += static_cast<std::size_t>(n);
        } else if (errno != EAGAIN && errno != EINTR) {
            fail("the line ended: the device, or QEMU, is gone");
        }
    }
    return true;
}

void SerialLine::fail(const char *what) const { fail_with(name_, what); }

} // namespace gpom_tools
