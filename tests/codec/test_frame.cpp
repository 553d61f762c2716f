// Frames on a serial line: what is written is read, and nothing else is.
#include "ports/uart/frame.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

namespace
{

using Bytes = std::vector<std::uint8_t>;

std::uint32_t seed()
{
    const char *const text = std::getenv("GPOM_SEED");
    return text != nullptr ? static_cast<std::uint32_t>(std::atoi(text)) : 1;
}

Bytes frame_of(const Bytes &datagram, std::uint16_t number)
{
    static const std::uint8_t none = 0;
    Bytes out(GPOM_UART_FRAME_BYTES(datagram.size()));
    const gpom_uart_frame_t frame = {datagram.empty() ? &none : datagram.data(),
                                     static_cast<std::uint32_t>(datagram.size()), number};
    const std::size_t n = gpom_uart_frame_write(&frame, out.data(), out.size());
    REQUIRE(n > 0);
    out.resize(n);
    return out;
}

/// A reader with memory of exactly its size, so that a sanitizer sees every step beyond.
struct Reader {
    explicit Reader(std::size_t datagram_max) : body(datagram_max + GPOM_UART_BODY_BYTES)
    {
        gpom_uart_frame_reader_init(&reader, body.data(), static_cast<std::uint32_t>(body.size()));
    }

    /// Datagrams of the frames in these bytes.
    std::vector<Bytes> take(const Bytes &line)
    {
        std::vector<Bytes> datagrams;
        for (const std::uint8_t byte : line) {
            gpom_uart_frame_t frame;
            if (gpom_uart_frame_read(&reader, byte, &frame)) {
                datagrams.emplace_back(frame.datagram, frame.datagram + frame.n_bytes);
            }
        }
        return datagrams;
    }

    Bytes body;
    gpom_uart_frame_reader_t reader;
};

Bytes random_bytes(std::mt19937 &random, std::size_t n, unsigned values)
{
    Bytes bytes(n);
    for (std::uint8_t &byte : bytes) {
        byte = static_cast<std::uint8_t>(random() % values);
    }
    return bytes;
}

std::uint64_t dropped(const gpom_uart_frame_stats_t &s)
{
    return s.frames_short + s.frames_long + s.frames_corrupt + s.frames_repeated;
}

} // namespace

// Every length, and so every place of a piece's end, comes back as it was; zeros only delimit.
TEST_CASE("a frame of any length is read as it was written")
{
    std::mt19937 random(seed());
    for (const unsigned values : {1u, 2u, 256u}) {
        Reader reader(800);
        std::uint16_t number = 0;
        for (std::size_t n = 0; n <= 800; ++n) {
            Bytes datagram = random_bytes(random, n, values);
            if (values == 2) { // none is zero: pieces of 254
                for (std::uint8_t &byte : datagram) {
                    byte |= 2;
                }
            }
            const Bytes line = frame_of(datagram, number);
            number = gpom_uart_frame_next_number(number);
            REQUIRE(line.front() == 0);
            REQUIRE(line.back() == 0);
            for (std::size_t i = 1; i + 1 < line.size(); ++i) {
                REQUIRE(line[i] != 0);
            }
            const std::vector<Bytes> read = reader.take(line);
            REQUIRE(read.size() == 1);
            REQUIRE(read[0] == datagram);
        }
        CHECK(reader.reader.stats.frames_received == 801);
        CHECK(dropped(reader.reader.stats) == 0);
        CHECK(reader.reader.stats.frames_lost == 0);
    }
}

// A frame cut off anywhere is counted as short, and the next one is read.
TEST_CASE("a truncated frame is counted and costs no other")
{
    std::mt19937 random(seed());
    const Bytes line = frame_of(random_bytes(random, 300, 256), 0);
    for (std::size_t n = 2; n + 1 < line.size(); ++n) {
        Reader reader(300);
        CHECK(reader.take(Bytes(line.begin(), line.begin() + static_cast<long>(n))).empty());
        CHECK(reader.take(frame_of({1, 2, 3}, 1)).size() == 1);
        CHECK(reader.reader.stats.frames_short == 1);
        CHECK(dropped(reader.reader.stats) == 1);
    }
}

// One wrong bit anywhere in a frame is never taken, and the frame after it is.
TEST_CASE("a damaged bit is found")
{
    std::mt19937 random(seed());
    const Bytes line = frame_of(random_bytes(random, 300, 256), 0);
    for (std::size_t i = 1; i + 1 < line.size(); ++i) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            Bytes damaged = line;
            damaged[i] ^= static_cast<std::uint8_t>(1u << bit);
            Reader reader(300);
            CHECK(reader.take(damaged).empty());
            CHECK(dropped(reader.reader.stats) >= 1);
            CHECK(reader.take(frame_of({1}, 1)).size() == 1);
        }
    }
}

// Bytes of any kind are dropped without a step beyond the reader's memory.
TEST_CASE("noise is dropped and leaves the reader ready")
{
    std::mt19937 random(seed());
    for (const unsigned values : {2u, 4u, 256u}) {
        Reader reader(100);
        std::uint16_t number = 0;
        for (int i = 0; i < 200; ++i) {
            CHECK(reader.take(random_bytes(random, random() % 1000, values)).empty());
            CHECK(reader.take(frame_of(random_bytes(random, 100, 256), number)).size() == 1);
            number = gpom_uart_frame_next_number(number);
        }
    }
}

// Numbers tell of frames that came twice, that are missing, and of a sender that began anew.
TEST_CASE("repeated and lost frames are counted, a new sender is not")
{
    Reader reader(4);
    const auto n_taken = [&reader](std::uint16_t number) {
        return reader.take(frame_of({7}, number)).size();
    };
    CHECK(n_taken(0) == 1);
    CHECK(n_taken(1) == 1);
    CHECK(n_taken(1) == 0);
    CHECK(n_taken(5) == 1); // 2, 3, 4 are missing
    CHECK(n_taken(4) == 0);
    CHECK(reader.reader.stats.frames_lost == 3);
    CHECK(reader.reader.stats.frames_repeated == 2);
    CHECK(n_taken(0) == 1); // began anew
    CHECK(n_taken(1) == 1);
    CHECK(reader.reader.stats.frames_lost == 3);
    Reader far(4);
    CHECK(far.take(frame_of({7}, 65534)).size() == 1);
    CHECK(far.take(frame_of({7}, 65535)).size() == 1);
    CHECK(gpom_uart_frame_next_number(65535) == 1);
    CHECK(far.take(frame_of({7}, 1)).size() == 1);
    CHECK(far.take(frame_of({7}, 65535)).empty());
    CHECK(far.reader.stats.frames_lost == 0);
}

// Too little room, too long a datagram: nothing is written beyond, and 0 says so.
TEST_CASE("a frame that does not fit is refused")
{
    const Bytes datagram(300, 5);
    const gpom_uart_frame_t frame = {datagram.data(), 300, 9};
    const std::size_t n_whole = frame_of(datagram, 9).size();
    for (std::size_t n = 0; n < n_whole; ++n) {
        Bytes room(n + 1);
        CHECK(gpom_uart_frame_write(&frame, room.data(), n) == 0);
        CHECK(room[n] == 0);
    }
    Reader reader(299); // one byte short
    CHECK(reader.take(frame_of(datagram, 0)).empty());
    CHECK(reader.reader.stats.frames_long == 1);
    const gpom_uart_frame_t too_long = {datagram.data(), 65536, 0};
    Bytes room(70000);
    CHECK(gpom_uart_frame_write(&too_long, room.data(), room.size()) == 0);
}
