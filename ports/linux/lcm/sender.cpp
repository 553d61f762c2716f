#include "ports/linux/lcm/sender.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

namespace gpomd
{

namespace
{

/// Longest wait for room before Patience is asked again.
constexpr int kWait_ms = 20;

/// Number of datagrams sent in one go if the caller has patience, and the pause after them. The
/// pause is needed because the buffers of receivers are small.
constexpr std::uint32_t kBurst = 16;
constexpr timespec kBurstPause = {0, 1000000};

template <class Value> bool set_option(int fd, int level, int name, const Value &value)
{
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

/// Bind the socket to any port and return the port. 0: the system has none.
std::uint16_t bind_to_any_port(int fd)
{
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    auto *const any = reinterpret_cast<sockaddr *>(&address);
    socklen_t n_address = sizeof address;
    const bool is_bound = bind(fd, any, n_address) == 0 && getsockname(fd, any, &n_address) == 0;
    return is_bound ? ntohs(address.sin_port) : std::uint16_t{0};
}

} // namespace

Sender::~Sender()
{
    if (fd_ >= 0) {
        close(fd_);
    }
}

const char *Sender::open(const char *url, int buffer_bytes)
{
    if (const char *const problem = network_problem(url); problem != nullptr) {
        return problem;
    }
    Network network;
    parse_network(url, network);
    group_ = network.group;
    fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    port_ = bind_to_any_port(fd_);
    if (buffer_bytes > 0) {
        set_option(fd_, SOL_SOCKET, SO_SNDBUF, buffer_bytes);
    }
    // Without this the system does not report datagrams dropped by a full queue.
    set_option(fd_, IPPROTO_IP, IP_RECVERR, 1);
    const bool is_open = port_ != 0 && set_option(fd_, IPPROTO_IP, IP_MULTICAST_TTL, network.ttl);
    return is_open ? nullptr
                   : "cannot make a socket for LCM's network; are all files or ports in use?";
}

bool Sender::send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes,
                  const Patience &patience)
{
    const gpom_wire_outgoing_t message = {channel, bytes, static_cast<std::uint32_t>(n_bytes),
                                          sequence_++, sizeof datagram_};
    const bool is_sent = n_bytes <= UINT32_MAX && send_all(message, patience);
    if (!is_sent && counts_ != nullptr) {
        counts_->add(GPOM_WIRE_MESSAGES_NOT_SENT);
    }
    return is_sent;
}

bool Sender::send_all(const gpom_wire_outgoing_t &message, const Patience &patience)
{
    const std::size_t n_head =
        gpom_wire_datagram_begin(datagram_, sizeof datagram_, message.channel, message.sequence);
    if (n_head > 0 && message.payload_bytes <= sizeof datagram_ - n_head) {
        if (message.payload_bytes > 0) {
            std::memcpy(datagram_ + n_head, message.payload, message.payload_bytes);
        }
        return send_datagram(n_head + message.payload_bytes, patience);
    }
    const std::uint32_t n_fragments = gpom_wire_fragment_count(&message);
    for (std::uint32_t i = 0; i < n_fragments; ++i) {
        const std::size_t n = gpom_wire_fragment_write(&message, i, datagram_, sizeof datagram_);
        if (!send_datagram(n, patience)) {
            return false;
        }
    }
    return n_fragments > 0;
}

bool Sender::send_datagram(std::size_t n_bytes, const Patience &patience)
{
    const bool has_patience = patience.goes_on != nullptr;
    if (has_patience && n_in_burst_ == kBurst) {
        n_in_burst_ = 0;
        nanosleep(&kBurstPause, nullptr);
    }
    for (;;) {
        const ssize_t n_sent = sendto(fd_, datagram_, n_bytes, 0,
                                      reinterpret_cast<const sockaddr *>(&group_), sizeof group_);
        if (n_sent == static_cast<ssize_t>(n_bytes)) {
            ++n_in_burst_;
            return true;
        }
        if (errno != EAGAIN || !has_patience || !patience.goes_on(patience.ctx)) {
            return false;
        }
        wait_for_room();
    }
}

void Sender::wait_for_room() const
{
    pollfd room = {fd_, POLLOUT, 0};
    if (poll(&room, 1, kWait_ms) > 0 && (room.revents & POLLERR) != 0) {
        // The system may report an error of an earlier datagram here; the result is not needed.
        char news = 0;
        recv(fd_, &news, sizeof news, MSG_ERRQUEUE | MSG_DONTWAIT);
    }
}

} // namespace gpomd
