// Any datagrams, in any order, to a small receiver: nothing is touched outside its memory, every
// datagram is accounted for, and every byte of a message that it gives came in a datagram of it.
#include "tests/codec/types.hpp"

#include <cstdlib>

namespace
{

constexpr gpom_wire_receiver_config_t kConfig = {2, 300, 70, 1000};

struct Sent {
    std::uint64_t sender;
    Bytes bytes;
};

/// Takes numbers from the fuzzer's input; 0 when it is used up.
class Input {
public:
    Input(const std::uint8_t *data, std::size_t size) : data_(data), size_(size) {}
    bool is_empty() const { return at_ == size_; }
    std::uint8_t byte() { return at_ < size_ ? data_[at_++] : std::uint8_t{0}; }
    void append_to(Bytes &bytes, std::size_t n)
    {
        for (; n > 0 && at_ < size_; --n) {
            bytes.push_back(byte());
        }
    }

private:
    const std::uint8_t *data_;
    std::size_t size_;
    std::size_t at_ = 0;
};

/// Raw bytes, or a header in whose fields small numbers are likely, so that fragments meet.
Bytes next_datagram(Input &input)
{
    const std::uint8_t kind = input.byte() % 8;
    Bytes bytes;
    if (kind == 0) {
        input.append_to(bytes, input.byte());
        return bytes;
    }
    bytes = {'L', 'C', '0', static_cast<std::uint8_t>(kind == 1 ? '2' : '3')};
    append(bytes, input.byte() % 4, 4); // sequence
    if (kind != 1) {
        append(bytes, input.byte() * 2u, 4); // bytes of the message
        append(bytes, input.byte() * 2u, 4); // offset
        const std::uint8_t i_fragment = input.byte() % 80;
        append(bytes, i_fragment, 2);
        append(bytes, input.byte() % 80, 2); // number of fragments
        if (i_fragment == 0) {
            append(bytes, 'A' << 8, 2);
        }
    }
    input.append_to(bytes, input.byte());
    return bytes;
}

/// Bytes of the message that came with these values at these places from its sender.
void check_origin(const gpom_wire_message_t &message, std::uint64_t sender,
                  const std::vector<Sent> &sent)
{
    std::vector<bool> came(message.payload_bytes);
    for (const Sent &one : sent) {
        gpom_wire_datagram_t d;
        if (one.sender != sender ||
            gpom_wire_datagram_read(&d, one.bytes.data(), one.bytes.size()) != GPOM_WIRE_OK ||
            d.sequence != message.sequence || d.message_bytes != message.payload_bytes) {
            continue;
        }
        for (std::size_t i = 0; i < d.payload_bytes; ++i) {
            came[d.offset + i] =
                came[d.offset + i] || d.payload[i] == message.payload[d.offset + i];
        }
    }
    for (const bool one : came) {
        if (!one) {
            std::abort();
        }
    }
}

std::uint64_t datagrams_counted(const gpom_wire_receiver_stats_t &s)
{
    return s.messages_short + s.datagrams_other + s.datagrams_malformed + s.fragments_overlong +
           s.fragments_inconsistent + s.fragments_repeated + s.fragments_late;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
    std::vector<std::uint64_t> memory(GPOM_WIRE_RECEIVER_BYTES(2, 300, 70) / 8, ~0ull);
    gpom_wire_receiver_t receiver;
    if (gpom_wire_receiver_init(&receiver, &kConfig, memory.data(), memory.size() * 8) != GPOM_OK) {
        std::abort();
    }
    std::vector<Sent> sent;
    Input input(data, size);
    std::int64_t now_us = 0;
    std::uint64_t n_taken = 0;
    while (!input.is_empty()) {
        const std::uint8_t control = input.byte();
        now_us += (control >> 2) * 20;
        sent.push_back({control % 2u, next_datagram(input)});
        const Bytes &bytes = sent.back().bytes;
        const gpom_wire_arrival_t arrival = {bytes.data(), bytes.size(), sent.back().sender,
                                             now_us};
        const std::uint64_t before = datagrams_counted(receiver.stats);
        gpom_wire_message_t message;
        if (gpom_wire_receive(&receiver, &arrival, &message)) {
            check_origin(message, sent.back().sender, sent);
        }
        const std::uint64_t counted = datagrams_counted(receiver.stats) - before;
        if (counted > 1) {
            std::abort();
        }
        n_taken += counted == 0;
    }
    if (n_taken + datagrams_counted(receiver.stats) != sent.size()) {
        std::abort();
    }
    return 0;
}
