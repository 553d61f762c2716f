#include "ports/linux/base/notify.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace gpomd
{

bool is_managed()
{
    const char *const path = std::getenv("NOTIFY_SOCKET");
    return path != nullptr && path[0] != '\0';
}

bool notify(const char *state)
{
    const char *const path = std::getenv("NOTIFY_SOCKET");
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    const std::size_t n_path = path != nullptr ? std::strlen(path) : 0;
    if (n_path == 0 || n_path >= sizeof address.sun_path || (path[0] != '/' && path[0] != '@')) {
        return false;
    }
    std::memcpy(address.sun_path, path, n_path);
    if (path[0] == '@') { // an abstract name
        address.sun_path[0] = '\0';
    }
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) {
        return false;
    }
    const auto n_address = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + n_path);
    const std::size_t n_state = std::strlen(state);
    const ssize_t n_sent = sendto(fd, state, n_state, MSG_NOSIGNAL | MSG_DONTWAIT,
                                  reinterpret_cast<const sockaddr *>(&address), n_address);
    close(fd);
    return n_sent == static_cast<ssize_t>(n_state);
}

std::int64_t watchdog_us()
{
    const char *const period = std::getenv("WATCHDOG_USEC");
    const char *const pid = std::getenv("WATCHDOG_PID");
    const bool is_mine = pid == nullptr || std::strtol(pid, nullptr, 10) == getpid();
    const long long period_us = period != nullptr ? std::strtoll(period, nullptr, 10) : 0;
    return is_mine && period_us > 0 ? period_us : 0;
}

} // namespace gpomd
