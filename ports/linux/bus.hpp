// liblcm as transport: bytes in, bytes out. Its types and decoders are not used.
#ifndef GPOM_LINUX_BUS_HPP
#define GPOM_LINUX_BUS_HPP

#include <lcm/lcm.h>

#include <cstddef>
#include <cstdint>

namespace gpomd
{

class Bus {
public:
    using Receive = void (*)(void *ctx, const char *channel, const std::uint8_t *bytes,
                             std::size_t n_bytes);

    ~Bus();
    Bus() = default;
    Bus(const Bus &) = delete;
    Bus &operator=(const Bus &) = delete;

    /// Join the network. NULL, or in one sentence what is wrong and what to do; static storage.
    const char *open(const char *url);

    /// Have all messages of a channel handed to `receive`, from inside handle(). False: refused.
    bool subscribe(const char *channel, Receive receive, void *ctx);

    /// Wait for a message and hand it over. False: nothing came in time.
    bool handle(int wait_ms);

    /// Send a message; any thread may. False: the system refused it.
    bool send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes);

private:
    static constexpr std::size_t kSubscriptionsMax = 16;
    /// Messages of one channel that liblcm keeps until they are handled: 5 s of 200 a second, if
    /// the receiving thread gets no processor. What comes beyond is lost, as on the way.
    static constexpr int kQueueMessages = 1024;
    struct Subscription {
        Receive receive;
        void *ctx;
        const char *channel;
    };

    static void on_message(const lcm_recv_buf_t *buffer, const char *channel, void *subscription);

    lcm_t *lcm_ = nullptr;
    Subscription subscriptions_[kSubscriptionsMax] = {};
    std::size_t n_subscriptions_ = 0;
};

} // namespace gpomd

#endif
