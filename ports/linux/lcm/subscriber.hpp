// Receives LCM messages by our own socket. liblcm is not used, because a forged fragment makes it
// write outside its buffer (lcm-proj/lcm, pull request 628). ports/codec/receiver.h reassembles the
// fragments.
#ifndef GPOM_LINUX_SUBSCRIBER_HPP
#define GPOM_LINUX_SUBSCRIBER_HPP

#include "ports/codec/receiver.h"
#include "ports/linux/base/counts.hpp"
#include "ports/linux/base/memory.hpp"

#include <netinet/in.h>
#include <sys/types.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// Used by one thread. Datagrams wait in the socket's buffer while this thread does not run.
class Subscriber {
public:
    using Receive = void (*)(void *ctx, const char *channel, const std::uint8_t *bytes,
                             std::size_t n_bytes);

    ~Subscriber();
    Subscriber() = default;
    Subscriber(const Subscriber &) = delete;
    Subscriber &operator=(const Subscriber &) = delete;

    static constexpr std::size_t kSubscriptionsMax = 16;

    /// ranges_max: ranges of the longest scan. There is room for its message and all other
    /// messages.
    static std::size_t need(std::uint32_t ranges_max);
    void init(std::uint32_t ranges_max, Memory &memory, Counts &counts);

    /// Pass all messages of a channel to `receive`, from inside handle(). May be called
    /// kSubscriptionsMax times. `channel` must stay valid.
    void subscribe(const char *channel, Receive receive, void *ctx);

    /// Pass every message of any channel to `receive`, before its subscribers get it.
    void hear_all(Receive receive, void *ctx) { all_ = {nullptr, receive, ctx}; }

    /// Sender of the message that is being passed on: address << 16 | port, in the byte order of
    /// the datagram.
    std::uint64_t sender() const { return sender_; }

    /// Join the network. Returns NULL, or one sentence that says what is wrong and what to do, in
    /// static storage.
    const char *open(const char *url);

    /// Wait for a datagram. If it completes a message, pass the message on. Drops are counted.
    void handle(int wait_ms);

    /// True if an interface carried the network when handle() last checked. Any thread may call
    /// this.
    bool has_link() const { return has_link_; }
    /// Number of interfaces joined so far. Any thread may call this, after has_link().
    std::uint32_t n_links() const { return n_links_; }

private:
    struct Subscription {
        const char *channel;
        Receive receive;
        void *ctx;
    };

    void renew_membership();
    ssize_t take_datagram();
    void deliver(const gpom_wire_message_t &message) const;
    void count_drops();

    Counts *counts_ = nullptr;
    gpom_wire_receiver_t receiver_ = {};
    std::uint8_t *datagram_ = nullptr;
    Subscription subscriptions_[kSubscriptionsMax] = {};
    std::size_t n_subscriptions_ = 0;
    Subscription all_ = {};
    std::uint64_t sender_ = 0;
    std::uint32_t n_lost_ = 0; ///< Datagrams lost, as the socket counts them: modulo 2^32.
    int fd_ = -1;
    in_addr group_ = {};
    std::int64_t renewed_us_ = 0; ///< Time of the last call of renew_membership(), monotonic.
    std::atomic<bool> has_link_{false};
    std::atomic<std::uint32_t> n_links_{0};
};

} // namespace gpomd

#endif
