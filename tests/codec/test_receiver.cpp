// Fragments lost, repeated, reordered, interleaved, forged: a message is whole or not given.
#include "tests/codec/samples.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <optional>
#include <string>

namespace
{

constexpr std::uint32_t kSlots = 4;
constexpr std::uint32_t kMessageMax = 4000;
constexpr std::uint32_t kFragmentsMax = 200;
constexpr std::int64_t kTimeout = 1000;

struct Received {
    std::string channel;
    Bytes payload;
    std::uint32_t sequence;
};

/// A receiver and its clock.
class Bench {
public:
    explicit Bench(std::uint32_t n_slots = kSlots)
        : memory_(GPOM_WIRE_RECEIVER_BYTES(n_slots, kMessageMax, kFragmentsMax) / 8)
    {
        const gpom_wire_receiver_config_t config = {n_slots, kMessageMax, kFragmentsMax, kTimeout};
        REQUIRE(gpom_wire_receiver_init(&receiver_, &config, memory_.data(), memory_.size() * 8) ==
                GPOM_OK);
    }

    std::optional<Received> push(const Bytes &bytes, std::uint64_t sender = 1)
    {
        const gpom_wire_arrival_t arrival = {bytes.data(), bytes.size(), sender, now_us};
        gpom_wire_message_t message;
        if (!gpom_wire_receive(&receiver_, &arrival, &message)) {
            return {};
        }
        return Received{message.channel,
                        Bytes(message.payload, message.payload + message.payload_bytes),
                        message.sequence};
    }

    /// Pushes all; the messages that became complete.
    std::vector<Received> push_all(const std::vector<Bytes> &datagrams, std::uint64_t sender = 1)
    {
        std::vector<Received> complete;
        for (const Bytes &bytes : datagrams) {
            if (const auto message = push(bytes, sender)) {
                complete.push_back(*message);
            }
        }
        return complete;
    }

    void expire() { gpom_wire_receiver_expire(&receiver_, now_us); }
    const gpom_wire_receiver_stats_t &stats() const { return receiver_.stats; }

    /// Every datagram that did not complete a message, was not taken into one, is in one counter.
    std::uint64_t dropped() const
    {
        const gpom_wire_receiver_stats_t &s = stats();
        return s.datagrams_other + s.datagrams_malformed + s.fragments_overlong +
               s.fragments_inconsistent + s.fragments_repeated + s.fragments_late;
    }

    std::int64_t now_us = 0;

private:
    std::vector<std::uint64_t> memory_;
    gpom_wire_receiver_t receiver_ = {};
};

Bytes some_message(Random &random, std::size_t n)
{
    Bytes message(n);
    for (std::uint8_t &byte : message) {
        byte = static_cast<std::uint8_t>(random());
    }
    return message;
}

std::vector<Bytes> fragments_of(const Bytes &message, std::uint32_t sequence,
                                std::size_t datagram_bytes, const char *channel = "GPOM_SCAN")
{
    const gpom_wire_outgoing_t out = {channel, message.data(),
                                      static_cast<std::uint32_t>(message.size()), sequence,
                                      static_cast<std::uint32_t>(datagram_bytes)};
    std::vector<Bytes> fragments(gpom_wire_fragment_count(&out));
    for (std::uint32_t i = 0; i < fragments.size(); ++i) {
        fragments[i].resize(datagram_bytes);
        fragments[i].resize(
            gpom_wire_fragment_write(&out, i, fragments[i].data(), fragments[i].size()));
    }
    return fragments;
}

void set_u32(Bytes &bytes, std::size_t at, std::uint32_t value)
{
    for (std::size_t i = 0; i < 4; ++i) {
        bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * (3 - i)));
    }
}

} // namespace

TEST_CASE("a short message is passed on at once, without a slot")
{
    Bench bench(0);
    Bytes bytes(64);
    bytes.resize(gpom_wire_datagram_begin(bytes.data(), bytes.size(), "POSE", 77));
    bytes.insert(bytes.end(), {1, 2, 3});
    const auto message = bench.push(bytes);
    REQUIRE(message);
    CHECK(message->channel == "POSE");
    CHECK(message->payload == Bytes{1, 2, 3});
    CHECK(message->sequence == 77);
    CHECK(bench.stats().messages_short == 1);
    Random random = make_random();
    CHECK(bench.push_all(fragments_of(some_message(random, 100), 1, 64)).empty());
    CHECK(bench.stats().fragments_overlong == bench.dropped());
}

// In every size, in every order, each fragment also repeated: one message, and it is right.
TEST_CASE("a message in fragments comes out whole in any order, repetitions counted")
{
    Random random = make_random();
    for (int round = 0; round < 300; ++round) {
        Bench bench;
        const Bytes sent = some_message(random, 1 + random() % kMessageMax);
        const auto sequence = static_cast<std::uint32_t>(random());
        std::vector<Bytes> fragments = fragments_of(sent, sequence, 60 + random() % 1500);
        const std::size_t n = fragments.size();
        std::shuffle(fragments.begin(), fragments.end(), random);
        const std::vector<Bytes> again = fragments;
        fragments.insert(fragments.end(), again.begin(), again.end());
        const std::size_t n_before = random() % n; // some twice before the message is complete
        fragments.insert(fragments.begin() + static_cast<long>(n_before), again.begin(),
                         again.begin() + static_cast<long>(n_before));
        const std::vector<Received> received = bench.push_all(fragments);
        REQUIRE(received.size() == 1);
        CHECK(received[0].payload == sent);
        CHECK(received[0].channel == "GPOM_SCAN");
        CHECK(received[0].sequence == sequence);
        CHECK(bench.stats().messages_assembled == 1);
        CHECK(bench.stats().fragments_repeated == n + n_before);
        CHECK(bench.dropped() == n + n_before);
    }
}

TEST_CASE("fragments that overtook others are taken and counted")
{
    Random random = make_random();
    Bench bench;
    std::vector<Bytes> fragments = fragments_of(some_message(random, 1000), 1, 100);
    CHECK(bench.push_all(fragments).size() == 1);
    CHECK(bench.stats().fragments_reordered == 0);
    fragments = fragments_of(some_message(random, 1000), 2, 100);
    std::reverse(fragments.begin(), fragments.end());
    CHECK(bench.push_all(fragments).size() == 1);
    CHECK(bench.stats().fragments_reordered == fragments.size() - 1);
}

// Whichever it is, and whatever was in the memory before.
TEST_CASE("with one fragment lost the message is not given, and given up in time")
{
    Random random = make_random();
    const std::vector<Bytes> fragments = fragments_of(some_message(random, 1000), 3, 100);
    for (std::size_t i_lost = 0; i_lost < fragments.size(); ++i_lost) {
        Bench bench;
        std::vector<Bytes> rest = fragments;
        rest.erase(rest.begin() + static_cast<long>(i_lost));
        CHECK(bench.push_all(rest).empty());
        bench.now_us = kTimeout - 1;
        bench.expire();
        CHECK(bench.stats().messages_timed_out == 0);
        bench.now_us = kTimeout;
        bench.expire();
        CHECK(bench.stats().messages_timed_out == 1);
        CHECK(!bench.push(fragments[i_lost]));
        CHECK(bench.stats().fragments_late == 1);
        bench.now_us = 3 * kTimeout; // forgotten: the sequence number may come again
        CHECK(bench.push_all(fragments).size() == 1);
    }
}

// A sender's sequence numbers start anew when it does, and two senders use the same ones.
TEST_CASE("messages of two senders with equal sequence numbers do not mix")
{
    Random random = make_random();
    for (int round = 0; round < 100; ++round) {
        Bench bench;
        const Bytes sent[2] = {some_message(random, 2000), some_message(random, 2000)};
        const std::vector<Bytes> fragments[2] = {fragments_of(sent[0], 8, 200),
                                                 fragments_of(sent[1], 8, 200)};
        std::vector<std::size_t> senders;
        for (std::size_t i = 0; i < 2; ++i) {
            senders.insert(senders.end(), fragments[i].size(), i);
        }
        std::shuffle(senders.begin(), senders.end(), random);
        std::size_t next[2] = {0, 0};
        std::size_t n_complete = 0;
        for (const std::size_t sender : senders) {
            const auto message = bench.push(fragments[sender][next[sender]++], sender);
            if (message) {
                CHECK(message->payload == sent[sender]);
                ++n_complete;
            }
        }
        CHECK(n_complete == 2);
        CHECK(bench.dropped() == 0);
    }
}

TEST_CASE("when all slots are taken the message quiet for longest gives way")
{
    Random random = make_random();
    Bench bench;
    std::vector<std::vector<Bytes>> messages;
    for (std::uint32_t i = 0; i <= kSlots; ++i) {
        messages.push_back(fragments_of(some_message(random, 500), i, 100));
        bench.now_us = i;
        CHECK(!bench.push(messages[i][0]));
    }
    CHECK(bench.stats().messages_evicted == 1);
    for (std::uint32_t i = 1; i <= kSlots; ++i) {
        CHECK(bench.push_all({messages[i].begin() + 1, messages[i].end()}).size() == 1);
    }
    CHECK(bench.stats().messages_evicted == 1);
    CHECK(bench.push_all({messages[0].begin() + 1, messages[0].end()}).empty());
}

// Complete ones make room first, so that steady traffic evicts nothing.
TEST_CASE("a thousand messages one after the other evict none")
{
    Random random = make_random();
    Bench bench;
    const std::vector<Bytes> unfinished = fragments_of(some_message(random, 500), 0, 100);
    CHECK(!bench.push(unfinished[0]));
    for (std::uint32_t i = 1; i <= 1000; ++i) {
        const Bytes sent = some_message(random, 500);
        const std::vector<Received> received = bench.push_all(fragments_of(sent, i, 100));
        REQUIRE(received.size() == 1);
        CHECK(received[0].payload == sent);
    }
    CHECK(bench.stats().messages_evicted == 0);
    CHECK(bench.stats().messages_assembled == 1000);
    CHECK(bench.push_all({unfinished.begin() + 1, unfinished.end()}).size() == 1);
}

TEST_CASE("a message or a number of fragments beyond the configuration is counted as overlong")
{
    Random random = make_random();
    Bench bench;
    CHECK(bench.push_all(fragments_of(some_message(random, kMessageMax), 1, 1472)).size() == 1);
    std::vector<Bytes> fragments = fragments_of(some_message(random, kMessageMax + 1), 2, 1472);
    CHECK(bench.push_all(fragments).empty());
    CHECK(bench.stats().fragments_overlong == fragments.size());
    fragments = fragments_of(some_message(random, 2 * (kFragmentsMax + 1)), 3, 22, "A");
    REQUIRE(fragments.size() > kFragmentsMax);
    CHECK(bench.push_all(fragments).empty());
    CHECK(bench.stats().fragments_overlong == bench.dropped());
}

// Forged while the real message is under way: refused, and the real one is still complete.
TEST_CASE("a fragment that contradicts others of its message is refused and harms nothing")
{
    Random random = make_random();
    const Bytes sent = some_message(random, 1000);
    const std::vector<Bytes> fragments = fragments_of(sent, 4, 100); // 13 of them
    const std::size_t n = fragments.size();
    const auto check = [&](std::size_t i_forged, std::size_t at, std::uint32_t value,
                           bool shorter) {
        Bench bench;
        Bytes forged = fragments[i_forged];
        set_u32(forged, at, value);
        if (shorter) {
            forged.pop_back();
        }
        const std::size_t n_before = i_forged == 2 ? 2 : 4;
        for (std::size_t i = 0; i < n_before; ++i) {
            CHECK(!bench.push(fragments[i]));
        }
        CHECK(!bench.push(forged));
        CHECK(bench.stats().fragments_inconsistent == 1);
        const std::vector<Received> received =
            bench.push_all({fragments.begin() + static_cast<long>(n_before), fragments.end()});
        REQUIRE(received.size() == 1);
        CHECK(received[0].payload == sent);
    };
    const std::uint32_t offset_5 = 80 * 5 - 10;
    check(5, 8, 999, false);            // another length of the message
    check(5, 12, offset_5 + 1, false);  // a byte further
    check(5, 12, offset_5 - 80, false); // over its neighbour
    check(5, 12, 0, false);             // over the first
    check(5, 12, offset_5, true);       // shorter than the others
    check(5, 16, 5u << 16 | static_cast<std::uint32_t>(n + 1), false); // more fragments in all
}

// Learnt from a forged first piece, the others do not fit: nothing made of parts of both is given.
TEST_CASE("a message begun by a forged fragment is never given")
{
    Random random = make_random();
    const Bytes sent = some_message(random, 1000);
    const std::vector<Bytes> fragments = fragments_of(sent, 4, 100);
    for (std::size_t i_forged = 1; i_forged + 1 < fragments.size(); ++i_forged) {
        Bench bench;
        Bytes forged = fragments[i_forged];
        forged.pop_back(); // one byte missing: a hole, were it believed
        CHECK(!bench.push(forged));
        CHECK(bench.push_all(fragments).empty());
        CHECK(bench.stats().messages_assembled == 0);
        CHECK(bench.stats().fragments_inconsistent > 0);
    }
}

// The last fragment's place is known only when first and middle are: a hole before it is seen then.
TEST_CASE("fragments that fit one by one but leave a hole are not given as a message")
{
    Random random = make_random();
    for (const std::size_t n_fragments : {2u, 3u, 5u}) {
        Bench bench;
        std::vector<Bytes> fragments =
            fragments_of(some_message(random, 80 * n_fragments - 20), 4, 100);
        REQUIRE(fragments.size() == n_fragments);
        Bytes &last = fragments.back(); // from one byte further on
        last.erase(last.begin() + 20);
        std::uint32_t offset = static_cast<std::uint32_t>(80 * (n_fragments - 1) - 10);
        set_u32(last, 12, offset + 1);
        CHECK(bench.push_all(fragments).empty());
        CHECK(bench.stats().messages_assembled == 0);
        CHECK(bench.stats().fragments_inconsistent == 1);
    }
}

TEST_CASE("datagrams that are not LCM's, or damaged, are counted and dropped")
{
    Bench bench;
    CHECK(!bench.push({1, 2, 3}));
    CHECK(!bench.push({}));
    CHECK(!bench.push({'L', 'C', '0', '2', 0, 0, 0, 0, 'A'}));
    CHECK(bench.stats().datagrams_malformed == 3);
    CHECK(!bench.push({'L', 'C', '9', '9', 0, 0, 0, 0, 'A', 0}));
    CHECK(bench.stats().datagrams_other == 1);
}

// Whatever comes, a datagram is taken into a message, completes one, or is in exactly one counter.
TEST_CASE("random damage to random traffic never yields a message that was not sent")
{
    Random random = make_random();
    Bench bench;
    std::vector<Bytes> sent;
    std::vector<Bytes> traffic;
    for (std::uint32_t i = 0; i < 300; ++i) {
        sent.push_back(some_message(random, 1 + random() % 1000));
        for (const Bytes &fragment : fragments_of(sent.back(), i, 100 + random() % 200)) {
            const std::uint64_t fate = random() % 20;
            if (fate == 0) {
                continue; // lost
            }
            traffic.push_back(fragment);
            if (fate == 1) {
                traffic.push_back(fragment);
            } else if (fate == 2) { // header damaged
                traffic.back()[random() % 20] ^= static_cast<std::uint8_t>(1 + random() % 255);
                if (traffic.back()[3] == '2') { // LCM could not tell it from a whole message
                    traffic.back()[3] = '9';
                }
            } else if (fate == 3) { // cut
                traffic.back().resize(random() % fragment.size());
            } else if (fate == 4 && traffic.size() > 1) {
                std::swap(traffic.back(), traffic[traffic.size() - 2]);
            }
        }
    }
    std::uint64_t n_complete = 0;
    for (const Bytes &bytes : traffic) {
        bench.now_us += 10;
        const std::uint64_t dropped_before = bench.dropped();
        if (const auto message = bench.push(bytes)) {
            ++n_complete;
            CHECK(std::find(sent.begin(), sent.end(), message->payload) != sent.end());
            CHECK(bench.dropped() == dropped_before);
        } else {
            CHECK(bench.dropped() <= dropped_before + 1);
        }
    }
    CHECK(n_complete == bench.stats().messages_assembled);
    CHECK(n_complete > 50);
    CHECK(bench.stats().messages_evicted + bench.stats().messages_timed_out > 10);
}

TEST_CASE("a receiver is refused memory too small or misaligned, at every size below the need")
{
    const gpom_wire_receiver_config_t config = {2, 1000, 10, kTimeout};
    std::vector<std::uint64_t> memory(GPOM_WIRE_RECEIVER_BYTES(2, 1000, 10) / 8 + 1);
    gpom_wire_receiver_t receiver;
    const std::size_t need = GPOM_WIRE_RECEIVER_BYTES(2, 1000, 10);
    for (std::size_t n = 0; n < need; ++n) {
        CHECK(gpom_wire_receiver_init(&receiver, &config, memory.data(), n) == GPOM_ERR_MEM);
    }
    CHECK(gpom_wire_receiver_init(&receiver, &config, memory.data(), need) == GPOM_OK);
    std::uint8_t *const odd = reinterpret_cast<std::uint8_t *>(memory.data()) + 4;
    CHECK(gpom_wire_receiver_init(&receiver, &config, odd, need) == GPOM_ERR_MEM);
    CHECK(gpom_wire_receiver_init(&receiver, &config, nullptr, need) == GPOM_ERR_MEM);
    CHECK(gpom_wire_receiver_init(nullptr, &config, memory.data(), need) == GPOM_ERR_ARG);
    for (const gpom_wire_receiver_config_t &bad :
         {gpom_wire_receiver_config_t{2, 1000, 0, kTimeout},
          gpom_wire_receiver_config_t{2, 1000, 65536, kTimeout},
          gpom_wire_receiver_config_t{2, 0x80000000, 10, kTimeout},
          gpom_wire_receiver_config_t{2, 1000, 10, 0}}) {
        CHECK(gpom_wire_receiver_init(&receiver, &bad, memory.data(), need) == GPOM_ERR_ARG);
    }
}
