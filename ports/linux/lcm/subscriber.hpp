// LCM messages in, by a socket of our own: liblcm writes wherever a forged fragment says
// (lcm-proj/lcm, pull request 628). Fragments are put together by ports/codec/receiver.h.
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

/// Used by one thread. What comes while that gets no processor waits in the socket's buffer.
class Subscriber {
public:
    using Receive = void (*)(void *ctx, const char *channel, const std::uint8_t *bytes,
                             std::size_t n_bytes);

    ~Subscriber();
    Subscriber() = default;
    Subscriber(const Subscriber &) = delete;
    Subscriber &operator=(const Subscriber &) = delete;

    static constexpr std::size_t kSubscriptionsMax = 16;

    /// ranges_max: of the longest scan; its message and all others fit then.
    static std::size_t need(std::uint32_t ranges_max);
    void init(std::uint32_t ranges_max, Memory &memory, Counts &counts);

    /// Have all messages of a channel handed to `receive`, from inside handle(). At most
    /// kSubscriptionsMax times; `channel` stays the caller's.
    void subscribe(const char *channel, Receive receive, void *ctx);

    /// Have every message, of whatever channel, handed to `receive` before that.
    void hear_all(Receive receive, void *ctx) { all_ = {nullptr, receive, ctx}; }

    /// Of the message that is being handed over: address << 16 | port, both as in the datagram.
    std::uint64_t sender() const { return sender_; }

    /// Join the network. NULL, or in one sentence what is wrong and what to do; static storage.
    const char *open(const char *url);

    /// Wait for a datagram; hand over the message that it completes, if it does. What is dropped
    /// is counted.
    void handle(int wait_ms);

    /// Did an interface carry the network when handle() last looked? Any thread.
    bool has_link() const { return has_link_; }
    /// Interfaces joined so far; any thread, after has_link().
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
    std::uint32_t n_lost_ = 0; ///< Datagrams, as the socket counts them: modulo 2^32.
    int fd_ = -1;
    in_addr group_ = {};
    std::int64_t renewed_us_ = 0; ///< When renew_membership() was last called; monotonic.
    std::atomic<bool> has_link_{false};
    std::atomic<std::uint32_t> n_links_{0};
};

} // namespace gpomd

#endif
