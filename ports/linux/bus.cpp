#include "ports/linux/bus.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>

namespace gpomd
{

namespace
{

constexpr char kUdpMulticast[] = "udpm://";
constexpr std::size_t kPrefix = sizeof kUdpMulticast - 1;

/// Address and port of "udpm://A.B.C.D:PORT…"; liblcm's own where they are left out.
bool parse_group(const char *url, sockaddr_in &group)
{
    const char *const start = url + kPrefix;
    const std::size_t n = std::strcspn(start, ":?");
    char address[INET_ADDRSTRLEN] = "239.255.76.67";
    if (n >= sizeof address) {
        return false;
    }
    if (n > 0) {
        std::memcpy(address, start, n);
        address[n] = '\0';
    }
    long port = 7667;
    if (start[n] == ':') {
        port = std::strtol(start + n + 1, nullptr, 10);
    }
    group = {};
    group.sin_family = AF_INET;
    group.sin_port = htons(static_cast<std::uint16_t>(port));
    return port > 0 && port <= UINT16_MAX && inet_pton(AF_INET, address, &group.sin_addr) == 1;
}

/// What would make liblcm fail with a page of text, told in a sentence; NULL: nothing.
const char *group_problem(const char *url)
{
    sockaddr_in group;
    if (!parse_group(url, group)) {
        return "LCM's URL must be udpm://ADDRESS:PORT?ttl=0 with a multicast address";
    }
    if (!IN_MULTICAST(ntohl(group.sin_addr.s_addr))) {
        return "LCM's URL: the address is not one of multicast, 224.0.0.0 to 239.255.255.255";
    }
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int result =
        fd < 0 ? -1 : connect(fd, reinterpret_cast<const sockaddr *>(&group), sizeof group);
    const int error = errno;
    if (fd >= 0) {
        close(fd);
    }
    if (result != 0 && error == ENETUNREACH) {
        return "there is no route for multicast; for this machine alone, run as root: "
               "ip link set lo up && ip route add 224.0.0.0/4 dev lo";
    }
    return nullptr;
}

/// Bytes that the system lets a socket's receive buffer have, at most kBufferMax.
long granted_buffer()
{
    constexpr long kUsual = 212992; // where /proc does not show it: in other network namespaces
    constexpr long kBufferMax = 4 << 20;
    char text[32] = {};
    const int fd = ::open("/proc/sys/net/core/rmem_max", O_RDONLY | O_CLOEXEC);
    const ssize_t n = fd < 0 ? -1 : read(fd, text, sizeof text - 1);
    if (fd >= 0) {
        close(fd);
    }
    const long granted = n > 0 ? std::strtol(text, nullptr, 10) : kUsual;
    return granted > 0 && granted < kBufferMax ? granted : kBufferMax;
}

/// Have liblcm ask for the largest receive buffer that it can get, unless the URL says how large:
/// scans arrive among the daemon's own tiles, which come back to it, and while it waits for a
/// processor nobody else keeps them.
const char *with_buffer(const char *url, char *longer, std::size_t n_bytes)
{
    constexpr char kOption[] = "recv_buf_size=";
    const std::size_t n_url = std::strlen(url);
    if (std::strncmp(url, kUdpMulticast, kPrefix) != 0 || std::strstr(url, kOption) != nullptr ||
        n_url + sizeof kOption + 16 > n_bytes) {
        return url;
    }
    std::memcpy(longer, url, n_url);
    longer[n_url] = std::strchr(url, '?') != nullptr ? '&' : '?';
    std::memcpy(longer + n_url + 1, kOption, sizeof kOption - 1);
    char *const number = longer + n_url + sizeof kOption;
    *std::to_chars(number, longer + n_bytes - 1, granted_buffer()).ptr = '\0';
    return longer;
}

} // namespace

Bus::~Bus()
{
    if (lcm_ != nullptr) {
        lcm_destroy(lcm_);
    }
}

const char *Bus::open(const char *url)
{
    if (std::strncmp(url, kUdpMulticast, kPrefix) == 0) {
        const char *const problem = group_problem(url);
        if (problem != nullptr) {
            return problem;
        }
    }
    char longer[512];
    lcm_ = lcm_create(with_buffer(url, longer, sizeof longer));
    return lcm_ != nullptr ? nullptr : "liblcm refuses the URL; its reason is above";
}

bool Bus::subscribe(const char *channel, Receive receive, void *ctx)
{
    if (n_subscriptions_ == kSubscriptionsMax) {
        return false;
    }
    Subscription &subscription = subscriptions_[n_subscriptions_++];
    subscription = {receive, ctx, channel};
    lcm_subscription_t *const handle = lcm_subscribe(lcm_, channel, on_message, &subscription);
    return handle != nullptr && lcm_subscription_set_queue_capacity(handle, kQueueMessages) == 0;
}

/// Names are regular expressions to liblcm: "a.b" also matches "a_b", which is not meant.
void Bus::on_message(const lcm_recv_buf_t *buffer, const char *channel, void *subscription)
{
    const auto &to = *static_cast<const Subscription *>(subscription);
    if (std::strcmp(channel, to.channel) == 0) {
        to.receive(to.ctx, channel, static_cast<const std::uint8_t *>(buffer->data),
                   buffer->data_size);
    }
}

bool Bus::handle(int wait_ms) { return lcm_handle_timeout(lcm_, wait_ms) > 0; }

bool Bus::send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes)
{
    return lcm_publish(lcm_, channel, bytes, static_cast<unsigned int>(n_bytes)) == 0;
}

} // namespace gpomd
