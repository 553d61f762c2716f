// Sends LCM messages by a socket that never waits by itself. liblcm is not used to send, because it
// holds one lock for all threads until a slow network has taken the whole message.
#ifndef GPOM_LINUX_SENDER_HPP
#define GPOM_LINUX_SENDER_HPP

#include "ports/codec/datagram.h"
#include "ports/linux/base/counts.hpp"
#include "ports/linux/base/network.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// How long a message may wait for room in the network.
struct Patience {
    /// Called every 20 ms while the message waits. False gives the message up. NULL: the message is
    /// given up at once.
    bool (*goes_on)(void *ctx);
    void *ctx;
};

/// Used by one thread. Each thread has its own sender, so that no thread waits for another.
class Sender {
public:
    /// Messages that are given up, or refused by the system, are counted in `counts`, which must
    /// outlive the sender. NULL: they are not counted.
    explicit Sender(Counts *counts = nullptr) : counts_(counts) {}
    ~Sender();
    Sender(const Sender &) = delete;
    Sender &operator=(const Sender &) = delete;

    /// Make the socket. `buffer_bytes`: bytes that may wait in it, 0: the system's default. Returns
    /// NULL, or one sentence that says what is wrong and what to do, in static storage.
    const char *open(const char *url, int buffer_bytes = 0);

    /// Send a message, in fragments if it does not fit a datagram. False: not all of it was sent.
    bool send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes,
              const Patience &patience = {nullptr, nullptr});

    /// The port that the sender's datagrams come from.
    std::uint16_t port() const { return port_; }

private:
    bool send_all(const gpom_wire_outgoing_t &message, const Patience &patience);
    bool send_datagram(std::size_t n_bytes, const Patience &patience);
    void wait_for_room() const;

    Counts *counts_;
    sockaddr_in group_ = {};
    int fd_ = -1;
    std::uint16_t port_ = 0;
    std::uint32_t sequence_ = 0;
    std::uint32_t n_in_burst_ = 0; ///< Datagrams since the last pause.
    std::uint8_t datagram_[GPOM_WIRE_DATAGRAM_BYTES];
};

} // namespace gpomd

#endif
