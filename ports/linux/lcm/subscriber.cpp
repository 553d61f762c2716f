#include "ports/linux/lcm/subscriber.hpp"

#include "ports/linux/base/clock.hpp"
#include "ports/linux/base/network.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace gpomd
{

namespace
{

/// A datagram of UDP cannot be longer.
constexpr std::size_t kDatagramBytes = 65536;

/// Size requested for the socket's buffer. The system grants net.core.rmem_max at most.
constexpr int kBufferBytes = 4 << 20;

/// Period of the check whether the interface is still the one that was joined.
constexpr std::int64_t kRenewPeriod_us = 1000000;

struct NetworkCount {
    std::size_t place;
    std::uint64_t gpom_wire_receiver_stats_t::*count;
};

constexpr NetworkCount kDrops[] = {
    {GPOM_WIRE_DATAGRAMS_OTHER, &gpom_wire_receiver_stats_t::datagrams_other},
    {GPOM_WIRE_DATAGRAMS_MALFORMED, &gpom_wire_receiver_stats_t::datagrams_malformed},
    {GPOM_WIRE_FRAGMENTS_OVERLONG, &gpom_wire_receiver_stats_t::fragments_overlong},
    {GPOM_WIRE_FRAGMENTS_INCONSISTENT, &gpom_wire_receiver_stats_t::fragments_inconsistent},
    {GPOM_WIRE_FRAGMENTS_REPEATED, &gpom_wire_receiver_stats_t::fragments_repeated},
    {GPOM_WIRE_FRAGMENTS_LATE, &gpom_wire_receiver_stats_t::fragments_late},
    {GPOM_WIRE_MESSAGES_TIMED_OUT, &gpom_wire_receiver_stats_t::messages_timed_out},
    {GPOM_WIRE_MESSAGES_EVICTED, &gpom_wire_receiver_stats_t::messages_evicted}};

/// The longest message that gpomd reads is mbot's lidar_t, with 20 bytes a range. Messages without
/// ranges fit 4 KiB. No sender makes fragments smaller than the smallest datagram that every IPv4
/// host accepts, of 576 bytes.
gpom_wire_receiver_config_t receiver_config(std::uint32_t ranges_max)
{
    const std::uint32_t message_bytes = 4096 + 20 * ranges_max;
    return {16, message_bytes, message_bytes / 512 + 1, 1000000};
}

std::size_t receiver_bytes(const gpom_wire_receiver_config_t &config)
{
    return GPOM_WIRE_RECEIVER_BYTES(config.n_slots, config.message_bytes_max, config.fragments_max);
}

template <class Value> bool set_option(int fd, int level, int name, const Value &value)
{
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

/// Call with IP_ADD_MEMBERSHIP or IP_DROP_MEMBERSHIP. The interface is the one of the route to the
/// group.
bool set_membership(int fd, int name, const in_addr &group)
{
    return set_option(fd, IPPROTO_IP, name, ip_mreq{group, {INADDR_ANY}});
}

} // namespace

Subscriber::~Subscriber()
{
    if (fd_ >= 0) {
        close(fd_);
    }
}

std::size_t Subscriber::need(std::uint32_t ranges_max)
{
    return Memory::need<std::uint8_t>(kDatagramBytes) +
           Memory::need<std::uint8_t>(receiver_bytes(receiver_config(ranges_max)));
}

void Subscriber::init(std::uint32_t ranges_max, Memory &memory, Counts &counts)
{
    counts_ = &counts;
    datagram_ = memory.take<std::uint8_t>(kDatagramBytes);
    const gpom_wire_receiver_config_t receiver = receiver_config(ranges_max);
    const std::size_t n_bytes = receiver_bytes(receiver);
    if (gpom_wire_receiver_init(&receiver_, &receiver, memory.take<std::uint8_t>(n_bytes),
                                n_bytes) != GPOM_OK) {
        std::abort(); // an error of this program
    }
}

void Subscriber::subscribe(const char *channel, Receive receive, void *ctx)
{
    if (n_subscriptions_ == kSubscriptionsMax) {
        std::abort(); // an error of this program
    }
    subscriptions_[n_subscriptions_++] = {channel, receive, ctx};
}

const char *Subscriber::open(const char *url)
{
    if (const char *const problem = network_problem(url); problem != nullptr) {
        return problem;
    }
    Network network;
    parse_network(url, network);
    fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    // A smaller buffer, or losses that are not counted, do not prevent the start.
    set_option(fd_, SOL_SOCKET, SO_RCVBUF,
               network.buffer_bytes > 0 ? network.buffer_bytes : kBufferBytes);
    set_option(fd_, SOL_SOCKET, SO_RXQ_OVFL, 1);
    group_ = network.group.sin_addr;
    const bool is_joined =
        set_option(fd_, SOL_SOCKET, SO_REUSEADDR, 1) &&
        bind(fd_, reinterpret_cast<const sockaddr *>(&network.group), sizeof network.group) == 0 &&
        set_membership(fd_, IP_ADD_MEMBERSHIP, group_);
    has_link_ = is_joined;
    n_links_ = is_joined ? 1 : 0;
    return is_joined ? nullptr
                     : "cannot receive from LCM's network; does another program hold its port? "
                       "`ss -ulpn` lists the programs";
}

/// Join the multicast group again and again. A membership belongs to one interface and ends without
/// notice when the interface is removed. On the same interface a second join fails with an error,
/// changes nothing and sends nothing. If the join succeeds, the interface is a new one.
void Subscriber::renew_membership()
{
    const bool is_new = set_membership(fd_, IP_ADD_MEMBERSHIP, group_);
    const bool has_link = is_new || errno == EADDRINUSE;
    if (is_new) {
        // Leave both memberships and join once: the system does not say which one it leaves first,
        // and memberships that stay would pile up.
        set_membership(fd_, IP_DROP_MEMBERSHIP, group_);
        set_membership(fd_, IP_DROP_MEMBERSHIP, group_);
        set_membership(fd_, IP_ADD_MEMBERSHIP, group_);
        ++n_links_;
    }
    has_link_ = has_link; // set last: a thread that sees the link finds it counted
}

/// Size of the next datagram in bytes. Negative: there is none. The socket also reports how many
/// datagrams it had no room for.
ssize_t Subscriber::take_datagram()
{
    sockaddr_in from = {};
    iovec piece = {datagram_, kDatagramBytes};
    alignas(cmsghdr) std::uint8_t control[CMSG_SPACE(sizeof n_lost_)];
    msghdr header = {};
    header.msg_name = &from;
    header.msg_namelen = sizeof from;
    header.msg_iov = &piece;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
    const ssize_t n_bytes = recvmsg(fd_, &header, MSG_DONTWAIT);
    const cmsghdr *const note = n_bytes >= 0 ? CMSG_FIRSTHDR(&header) : nullptr;
    if (note != nullptr && note->cmsg_level == SOL_SOCKET && note->cmsg_type == SO_RXQ_OVFL) {
        const std::uint32_t n_lost_before = n_lost_;
        std::memcpy(&n_lost_, CMSG_DATA(note), sizeof n_lost_);
        counts_->add(GPOM_WIRE_DATAGRAMS_LOST, n_lost_ - n_lost_before);
    }
    sender_ = std::uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port;
    return n_bytes;
}

void Subscriber::handle(int wait_ms)
{
    pollfd ready = {fd_, POLLIN, 0};
    const ssize_t n_bytes = poll(&ready, 1, wait_ms) > 0 ? take_datagram() : -1;
    const std::int64_t now_us = monotonic_us();
    if (now_us - renewed_us_ >= kRenewPeriod_us) {
        renewed_us_ = now_us;
        renew_membership();
    }
    if (n_bytes < 0) {
        gpom_wire_receiver_expire(&receiver_, now_us);
    } else {
        const gpom_wire_arrival_t arrival = {datagram_, static_cast<std::size_t>(n_bytes), sender_,
                                             now_us};
        gpom_wire_message_t message = {};
        if (gpom_wire_receive(&receiver_, &arrival, &message)) {
            deliver(message);
        }
    }
    count_drops();
}

void Subscriber::deliver(const gpom_wire_message_t &message) const
{
    if (all_.receive != nullptr) {
        all_.receive(all_.ctx, message.channel, message.payload, message.payload_bytes);
    }
    for (std::size_t i = 0; i < n_subscriptions_; ++i) {
        const Subscription &to = subscriptions_[i];
        if (std::strcmp(to.channel, message.channel) == 0) {
            to.receive(to.ctx, message.channel, message.payload, message.payload_bytes);
        }
    }
}

void Subscriber::count_drops()
{
    for (const NetworkCount &drop : kDrops) {
        counts_->set(drop.place, static_cast<std::int64_t>(receiver_.stats.*drop.count));
    }
}

} // namespace gpomd
