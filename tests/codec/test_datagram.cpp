// LCM's datagrams, as its protocol description has them.
#include "tests/codec/samples.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <string>

namespace
{

gpom_wire_fault_t read(gpom_wire_datagram_t &datagram, const Bytes &bytes)
{
    return gpom_wire_datagram_read(&datagram, bytes.data(), bytes.size());
}

struct FragmentHeader {
    std::uint32_t sequence, message_bytes, offset;
    std::uint16_t i_fragment, n_fragments;
};

/// Written by hand from the protocol's description.
Bytes fragment(const FragmentHeader &header, const std::string &channel, const Bytes &payload)
{
    Bytes bytes = {'L', 'C', '0', '3'};
    append(bytes, header.sequence, 4);
    append(bytes, header.message_bytes, 4);
    append(bytes, header.offset, 4);
    append(bytes, header.i_fragment, 2);
    append(bytes, header.n_fragments, 2);
    if (header.i_fragment == 0) {
        bytes.insert(bytes.end(), channel.begin(), channel.end());
        bytes.push_back(0);
    }
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    return bytes;
}

} // namespace

TEST_CASE("a short datagram is magic, sequence number, channel, NUL, message")
{
    Bytes bytes(64);
    const std::size_t n = gpom_wire_datagram_begin(bytes.data(), bytes.size(), "POSE", 0x01020304);
    bytes.resize(n);
    CHECK(bytes == Bytes{'L', 'C', '0', '2', 1, 2, 3, 4, 'P', 'O', 'S', 'E', 0});
    bytes.insert(bytes.end(), {7, 8, 9});
    gpom_wire_datagram_t d;
    REQUIRE(read(d, bytes) == GPOM_WIRE_OK);
    CHECK(std::string(d.channel) == "POSE");
    CHECK(d.sequence == 0x01020304);
    CHECK(d.n_fragments == 0);
    CHECK(d.message_bytes == 3);
    CHECK(d.payload_bytes == 3);
    CHECK(d.payload == bytes.data() + n);
}

TEST_CASE("a short datagram cut before its channel's end is refused")
{
    const Bytes whole = {'L', 'C', '0', '2', 1, 2, 3, 4, 'P', 'O', 'S', 'E', 0};
    gpom_wire_datagram_t d;
    for (std::size_t n = 0; n < whole.size(); ++n) {
        const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[n == 0 ? 1 : n]);
        std::copy(whole.begin(), whole.begin() + static_cast<long>(n), exact.get());
        CHECK(gpom_wire_datagram_read(&d, exact.get(), n) == GPOM_WIRE_SHORT);
    }
    REQUIRE(read(d, whole) == GPOM_WIRE_OK);
    CHECK(d.payload_bytes == 0);
}

TEST_CASE("a channel may have 63 characters, no more")
{
    const std::string longest(GPOM_WIRE_CHANNEL_MAX, 'x');
    const std::string longer(GPOM_WIRE_CHANNEL_MAX + 1, 'x');
    Bytes bytes(128);
    CHECK(gpom_wire_datagram_begin(bytes.data(), bytes.size(), longer.c_str(), 0) == 0);
    CHECK(gpom_wire_datagram_begin(bytes.data(), 8 + 63, longest.c_str(), 0) == 0);
    CHECK(gpom_wire_datagram_begin(bytes.data(), 8 + 64, longest.c_str(), 0) == 8 + 64);
    CHECK(gpom_wire_datagram_begin(bytes.data(), bytes.size(), nullptr, 0) == 0);
    gpom_wire_datagram_t d;
    REQUIRE(read(d, bytes) == GPOM_WIRE_OK);
    CHECK(d.channel == longest);
    bytes[8 + 63] = 'x'; // no NUL where the last one may be
    CHECK(read(d, bytes) == GPOM_WIRE_VALUE);
}

TEST_CASE("what is not LCM's is told apart")
{
    gpom_wire_datagram_t d;
    CHECK(read(d, {'L', 'C', '0', '1', 0, 0, 0, 0, 'A', 0}) == GPOM_WIRE_TYPE);
    CHECK(read(d, {'G', 'E', 'T', ' ', '/', ' ', 'H', 'T', 'T', 'P'}) == GPOM_WIRE_TYPE);
    CHECK(read(d, Bytes(65536)) == GPOM_WIRE_LONG);
    CHECK(gpom_wire_datagram_read(&d, nullptr, 0) == GPOM_WIRE_ARG);
}

TEST_CASE("a fragment is read as the protocol describes it")
{
    gpom_wire_datagram_t d;
    const Bytes first = fragment({5, 7, 0, 0, 2}, "MAP", {1, 2, 3, 4});
    REQUIRE(read(d, first) == GPOM_WIRE_OK);
    CHECK(std::string(d.channel) == "MAP");
    CHECK(d.sequence == 5);
    CHECK(d.message_bytes == 7);
    CHECK(d.offset == 0);
    CHECK(d.i_fragment == 0);
    CHECK(d.n_fragments == 2);
    CHECK(d.payload_bytes == 4);
    const Bytes second = fragment({5, 7, 4, 1, 2}, "", {5, 6, 7});
    REQUIRE(read(d, second) == GPOM_WIRE_OK);
    CHECK(d.channel == nullptr);
    CHECK(d.offset == 4);
    CHECK(d.payload[0] == 5);
    for (std::size_t n = 1; n < 20; ++n) {
        CHECK(read(d, Bytes(second.begin(), second.begin() + static_cast<long>(n))) ==
              GPOM_WIRE_SHORT);
    }
}

// Each would make a naive receiver write outside its buffer or wait for ever.
TEST_CASE("a fragment that contradicts itself is refused")
{
    gpom_wire_datagram_t d;
    const Bytes data = {1, 2, 3, 4};
    CHECK(read(d, fragment({0, 8, 0, 0, 0}, "A", data)) == GPOM_WIRE_COUNT); // none of none
    CHECK(read(d, fragment({0, 8, 4, 2, 2}, "A", data)) == GPOM_WIRE_COUNT); // third of two
    CHECK(read(d, fragment({0, 8, 5, 1, 2}, "A", data)) == GPOM_WIRE_COUNT); // beyond its end
    CHECK(read(d, fragment({0, 8, 3, 1, 2}, "A", data)) == GPOM_WIRE_COUNT); // last, not at its end
    CHECK(read(d, fragment({0, 8, 4, 0, 2}, "A", data)) == GPOM_WIRE_COUNT); // first, not at 0
    CHECK(read(d, fragment({0, 3, 0, 0, 2}, "A", data)) == GPOM_WIRE_COUNT); // larger than all
    CHECK(read(d, fragment({0, 8, 0, 0, 1}, "A", data)) == GPOM_WIRE_COUNT); // only, not all
    CHECK(read(d, fragment({0, 2, 0xfffffffe, 1, 3}, "A", data)) == GPOM_WIRE_COUNT); // wraps
    CHECK(read(d, fragment({0, 0xffffffff, 0xfffffffe, 1, 3}, "A", data)) == GPOM_WIRE_COUNT);
    CHECK(read(d, fragment({0, 4, 0, 0, 1}, "A", data)) == GPOM_WIRE_OK);
}

// At every size of message around the borders, and of datagram.
TEST_CASE("a message cut into fragments is whole when laid side by side")
{
    Random random = make_random();
    Bytes message(3000);
    for (std::uint8_t &byte : message) {
        byte = static_cast<std::uint8_t>(random());
    }
    for (const std::uint32_t datagram_bytes : {25u, 26u, 50u, 576u, 1472u, 65507u}) {
        for (std::uint32_t n = 1; n < message.size(); n += 1 + n / 100) {
            const gpom_wire_outgoing_t out = {"MAP", message.data(), n, 9, datagram_bytes};
            const std::uint32_t n_fragments = gpom_wire_fragment_count(&out);
            REQUIRE(n_fragments == (n + 4 + datagram_bytes - 21) / (datagram_bytes - 20));
            Bytes together;
            for (std::uint32_t i = 0; i < n_fragments; ++i) {
                Bytes bytes(datagram_bytes);
                bytes.resize(gpom_wire_fragment_write(&out, i, bytes.data(), bytes.size()));
                REQUIRE((i + 1 == n_fragments || bytes.size() == datagram_bytes));
                gpom_wire_datagram_t d;
                REQUIRE(read(d, bytes) == GPOM_WIRE_OK);
                REQUIRE(d.offset == together.size());
                REQUIRE(d.message_bytes == n);
                REQUIRE(d.n_fragments == n_fragments);
                together.insert(together.end(), d.payload, d.payload + d.payload_bytes);
            }
            REQUIRE(together == Bytes(message.begin(), message.begin() + n));
        }
    }
}

TEST_CASE("a message that cannot be sent in fragments is refused")
{
    const std::uint8_t byte = 0;
    const auto count = [&](const char *channel, std::uint32_t n, std::uint32_t datagram_bytes) {
        const gpom_wire_outgoing_t out = {channel, &byte, n, 0, datagram_bytes};
        return gpom_wire_fragment_count(&out);
    };
    CHECK(count("A", 1, 22) == 2); // the channel alone fills the first
    CHECK(count("A", 1, 21) == 0); // not even the channel fits
    CHECK(count("A", 1, 20) == 0);
    CHECK(count("A", 1, 65536) == 0); // more than UDP carries
    CHECK(count("A", 0, 1472) == 0);
    CHECK(count(nullptr, 1, 1472) == 0);
    CHECK(count("A", 65533 * 2, 22) == 65534);
    CHECK(count("A", 65534 * 2, 22) == 65535);
    CHECK(count("A", 65534 * 2 + 1, 22) == 0);
    CHECK(count("A", (1u << 28) + 1, 65507) == 0);
    CHECK(gpom_wire_fragment_count(nullptr) == 0);
    Bytes bytes(22);
    const gpom_wire_outgoing_t out = {"A", &byte, 1, 0, 22};
    CHECK(gpom_wire_fragment_write(&out, 0, bytes.data(), 21) == 0);
    CHECK(gpom_wire_fragment_write(&out, 0, bytes.data(), 22) == 22);
    CHECK(gpom_wire_fragment_write(&out, 1, bytes.data(), 22) == 21);
    CHECK(gpom_wire_fragment_write(&out, 2, bytes.data(), 22) == 0);
    CHECK(gpom_wire_fragment_write(&out, 0, nullptr, 22) == 0);
}
