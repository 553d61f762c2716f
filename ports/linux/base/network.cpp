#include "ports/linux/base/network.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace gpomd
{

namespace
{

constexpr char kMulticast[] = "udpm://";
constexpr std::size_t kPrefix = sizeof kMulticast - 1;

constexpr long kTtlMax = 255;

/// The number that an option is set to. 0: the option is absent.
long option(const char *options, const char *name)
{
    const std::size_t n_name = std::strlen(name);
    for (const char *at = options; *at != '\0'; at += std::strcspn(at, "&")) {
        ++at; // skip ? or &
        if (std::strncmp(at, name, n_name) == 0 && at[n_name] == '=') {
            return std::strtol(at + n_name + 1, nullptr, 0);
        }
    }
    return 0;
}

/// True if every option is known and has a number in its range.
bool has_good_options(const char *options)
{
    constexpr struct {
        const char *name;
        long most;
    } kOptions[] = {{"ttl=", kTtlMax}, {"recv_buf_size=", INT_MAX}};
    for (const char *at = options; *at != '\0'; at += std::strcspn(at, "&")) {
        ++at; // skip ? or &
        bool is_good = false;
        for (const auto &known : kOptions) {
            const char *const digits = at + std::strlen(known.name);
            if (std::strncmp(at, known.name, std::strlen(known.name)) == 0) {
                char *end = nullptr;
                const long value = std::strtol(digits, &end, 0);
                is_good = end != digits && (*end == '&' || *end == '\0') && value >= 0 &&
                          value <= known.most;
            }
        }
        if (!is_good) {
            return false;
        }
    }
    return true;
}

} // namespace

bool is_multicast_url(const char *url) { return std::strncmp(url, kMulticast, kPrefix) == 0; }

bool parse_network(const char *url, Network &network)
{
    if (!is_multicast_url(url)) {
        return false;
    }
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
    const long port = start[n] == ':' ? std::strtol(start + n + 1, nullptr, 0) : 7667;
    network = {};
    network.group.sin_family = AF_INET;
    network.group.sin_port = htons(static_cast<std::uint16_t>(port));
    const long buffer_bytes = option(start + std::strcspn(start, "?"), "recv_buf_size");
    network.buffer_bytes = static_cast<int>(std::clamp<long>(buffer_bytes, 0, INT_MAX));
    const long ttl = option(start + std::strcspn(start, "?"), "ttl");
    network.ttl = static_cast<int>(std::clamp<long>(ttl, 0, kTtlMax));
    return port > 0 && port <= UINT16_MAX &&
           inet_pton(AF_INET, address, &network.group.sin_addr) == 1;
}

const char *url_problem(const char *url)
{
    Network network;
    if (!parse_network(url, network)) {
        return "LCM's URL must be udpm://ADDRESS:PORT?ttl=0 with a multicast address";
    }
    if (!IN_MULTICAST(ntohl(network.group.sin_addr.s_addr))) {
        return "LCM's URL: the address is not a multicast address (224.0.0.0 to 239.255.255.255)";
    }
    if (!has_good_options(url + std::strcspn(url, "?"))) {
        return "LCM's URL: options are ttl=0 to 255 and recv_buf_size=BYTES; write ? before the "
               "first option and & between options";
    }
    return nullptr;
}

const char *network_problem(const char *url)
{
    if (const char *const problem = url_problem(url); problem != nullptr) {
        return problem;
    }
    Network network;
    parse_network(url, network);
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int result = fd < 0 ? -1
                              : connect(fd, reinterpret_cast<const sockaddr *>(&network.group),
                                        sizeof network.group);
    const int error = errno;
    if (fd >= 0) {
        close(fd);
    }
    if (result != 0 && error == ENETUNREACH) {
        return "there is no route for multicast; to use LCM on this machine only, run as root: "
               "ip link set lo up && ip route add 224.0.0.0/4 dev lo";
    }
    return nullptr;
}

} // namespace gpomd
