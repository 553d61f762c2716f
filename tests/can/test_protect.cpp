// CRCs, counters and signals against definitions written down here once more, the slow way.
#include "ports/can/messages.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace
{

constexpr gpom_can_crc8_t kJ1850 = {0xFF, 0xFF};

std::vector<std::uint8_t> digits() { return {'1', '2', '3', '4', '5', '6', '7', '8', '9'}; }

} // namespace

// The catalogues' check values, over "123456789": the data id is its first or last two digits.
TEST_CASE("CRCs have the check values of their catalogue entries")
{
    const std::vector<std::uint8_t> text = digits();
    CHECK(gpom_can_crc8(kJ1850, 0x3231, text.data() + 2, 7, 7) == 0x4B);
    CHECK(gpom_can_crc16(0x3938, text.data(), 7) == 0x29B1);
}

TEST_CASE("the byte of the CRC itself is left out of it wherever it stands")
{
    for (std::size_t i_crc = 0; i_crc < 7; ++i_crc) {
        std::vector<std::uint8_t> text = digits();
        text.insert(text.begin() + 2 + static_cast<std::ptrdiff_t>(i_crc), 0xA5);
        CHECK(gpom_can_crc8(kJ1850, 0x3231, text.data() + 2, 8, i_crc) == 0x4B);
    }
}

TEST_CASE("a counter that stands still is a fault, and what is missing is counted")
{
    gpom_can_protection_t protection = {};
    protection.has_counter = true;
    protection.counter = {8, 4, false, false, 1.0, 0.0};
    protection.counter_max = 14;
    gpom_can_stream_t stream = {};
    const auto check = [&](unsigned counter) {
        const std::uint8_t bytes[] = {0, static_cast<std::uint8_t>(counter)};
        return gpom_can_check(&protection, &stream, bytes, sizeof bytes);
    };
    CHECK(check(13) == GPOM_CAN_OK);
    for (unsigned before = 0; before <= 14; ++before) {
        for (unsigned now = 0; now <= 15; ++now) {
            stream = {true, before, 0};
            const bool is_good = now != before && now <= 14;
            CHECK(check(now) == (is_good ? GPOM_CAN_OK : GPOM_CAN_COUNTER));
            CHECK(stream.n_lost == (is_good ? (now + 15 - before) % 15 - 1 : 0));
            CHECK(stream.counter == (is_good ? now : before));
        }
    }
    const std::uint8_t one[] = {0};
    CHECK(gpom_can_check(&protection, &stream, one, sizeof one) == GPOM_CAN_LENGTH);
}

TEST_CASE("no change of one or two bits gets past a checked frame")
{
    gpom_can_protection_t protection = {};
    protection.has_crc = true;
    protection.i_crc_byte = 3;
    protection.data_id = 0x1234;
    protection.crc = {0, 0};
    gpom_can_stream_t stream = {};
    std::uint8_t bytes[8] = {1, 2, 3, 0, 5, 6, 7, 8};
    bytes[3] = gpom_can_crc8(protection.crc, protection.data_id, bytes, 8, 3);
    REQUIRE(gpom_can_check(&protection, &stream, bytes, 8) == GPOM_CAN_OK);
    for (unsigned a = 0; a < 64; ++a) {
        for (unsigned b = a; b < 64; ++b) {
            std::uint8_t bad[8];
            std::memcpy(bad, bytes, 8);
            bad[a / 8] = static_cast<std::uint8_t>(bad[a / 8] ^ (1u << a % 8));
            if (b != a) {
                bad[b / 8] = static_cast<std::uint8_t>(bad[b / 8] ^ (1u << b % 8));
            }
            CHECK(gpom_can_check(&protection, &stream, bad, 8) == GPOM_CAN_CRC);
        }
    }
    CHECK(gpom_can_check(&protection, &stream, bytes, 3) == GPOM_CAN_LENGTH);
    protection.data_id = 0x1235;
    CHECK(gpom_can_check(&protection, &stream, bytes, 8) == GPOM_CAN_CRC);
}

// Every place, length and order that fits a classic frame, bit by bit from DBC's definition.
TEST_CASE("bits put into a frame are read again and no others are touched")
{
    std::mt19937 random(1);
    for (unsigned start = 0; start < 64; ++start) {
        for (unsigned n = 1; n <= 64; ++n) {
            for (const bool is_motorola : {false, true}) {
                const gpom_can_signal_t signal = {static_cast<std::uint16_t>(start),
                                                  static_cast<std::uint8_t>(n),
                                                  is_motorola,
                                                  false,
                                                  1.0,
                                                  0.0};
                // Motorola, counted from the frame's first bit on the wire
                const unsigned first = is_motorola ? 8 * (start / 8) + 7 - start % 8 : start;
                const std::size_t n_bytes = (first + n + 7) / 8;
                REQUIRE(gpom_can_signal_bytes(&signal) == n_bytes);
                if (n_bytes > 8) {
                    continue;
                }
                const std::uint64_t ones =
                    n == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1;
                const std::uint64_t value =
                    ((std::uint64_t{random()} << 32) | std::uint64_t{random()}) & ones;
                std::uint8_t frame[8];
                std::memset(frame, 0x5A, sizeof frame);
                REQUIRE(gpom_can_signal_put(&signal, value, frame, n_bytes));
                std::uint64_t read = 0;
                REQUIRE(gpom_can_signal_bits(&signal, frame, n_bytes, &read));
                CHECK(read == value);
                CHECK_FALSE(gpom_can_signal_bits(&signal, frame, n_bytes - 1, &read));
                REQUIRE(gpom_can_signal_put(&signal, 0, frame, 8));
                std::uint8_t expected[8];
                std::memset(expected, 0x5A, sizeof expected);
                for (unsigned i = first; i < first + n; ++i) {
                    const unsigned bit = is_motorola ? 7 - i % 8 : i % 8;
                    expected[i / 8] = static_cast<std::uint8_t>(expected[i / 8] & ~(1u << bit));
                }
                CHECK(std::memcmp(frame, expected, 8) == 0);
            }
        }
    }
}

TEST_CASE("a signal that fits no frame is refused")
{
    gpom_can_signal_t signal = {511, 2, false, false, 1.0, 0.0};
    CHECK(gpom_can_signal_bytes(&signal) == 0);
    signal.n_bits = 1;
    CHECK(gpom_can_signal_bytes(&signal) == 64);
    signal.n_bits = 0;
    CHECK(gpom_can_signal_bytes(&signal) == 0);
    signal.n_bits = 65;
    CHECK(gpom_can_signal_bytes(&signal) == 0);
    CHECK(gpom_can_signal_bytes(nullptr) == 0);
}

TEST_CASE("no distance is promised that is longer than the one that is free")
{
    const float infinity = std::numeric_limits<float>::infinity();
    CHECK(gpom_can_distance_code(NAN) == GPOM_CAN_DISTANCE_UNKNOWN);
    CHECK(gpom_can_distance_code(-infinity) == 0);
    CHECK(gpom_can_distance_code(infinity) == GPOM_CAN_DISTANCE_MAX);
    for (float d = 0.0f; d < 25.35f; d = std::nextafter(d + 1e-4f, infinity)) {
        const std::uint8_t code = gpom_can_distance_code(d);
        CHECK(code / 10.0 <= static_cast<double>(d));
        CHECK((code + 1) / 10.0 > static_cast<double>(d));
    }
    for (unsigned code = 0; code <= GPOM_CAN_DISTANCE_MAX; ++code) { // and back
        const float d = gpom_can_distance_m(static_cast<std::uint8_t>(code), 20.0f);
        const unsigned again = gpom_can_distance_code(d);
        CHECK((again == code || again + 1 == code)); // 0.3f is a little over 0.3, 0.7f under 0.7
    }
    CHECK(gpom_can_distance_m(GPOM_CAN_DISTANCE_CLEAR, 20.0f) == 20.0f);
    CHECK(gpom_can_distance_m(GPOM_CAN_DISTANCE_UNKNOWN, 20.0f) == 0.0f);
}

TEST_CASE("probabilities and deviations are rounded up, in order, to known levels")
{
    unsigned before = 0;
    for (unsigned p = 0; p <= 65535; ++p) {
        const unsigned code = gpom_can_probability_code(static_cast<std::uint16_t>(p));
        CHECK(code == static_cast<unsigned>(std::ceil(14.0 * p / 65535.0)));
        CHECK(code >= before);
        CHECK(code <= GPOM_CAN_LEVEL_MAX);
        before = code;
    }
    for (unsigned v = 0; v <= 255; ++v) {
        for (const unsigned n_max : {GPOM_CAN_LEVEL_MAX, GPOM_CAN_TILE_DEVIATION_MAX}) {
            const double exact = n_max * std::sqrt(v / 255.0);
            CHECK(gpom_can_deviation_code(static_cast<std::uint8_t>(v),
                                          static_cast<std::uint8_t>(n_max)) ==
                  static_cast<unsigned>(std::ceil(exact - 1e-9)));
        }
    }
}

TEST_CASE("ages are rounded up and bearings to the nearest")
{
    CHECK(gpom_can_age_code(NAN) == GPOM_CAN_AGE_UNKNOWN);
    CHECK(gpom_can_age_code(-1.0f) == 0);
    CHECK(gpom_can_age_code(1e9f) == GPOM_CAN_AGE_MAX);
    for (float age = 0.0f; age < 2.5f; age += 0.0007f) {
        CHECK(gpom_can_age_code(age) == std::ceil(100.0 * static_cast<double>(age)));
    }
    CHECK(gpom_can_bearing_code(NAN) == GPOM_CAN_BEARING_UNKNOWN);
    CHECK(gpom_can_bearing_code(INFINITY) == GPOM_CAN_BEARING_UNKNOWN);
    for (int degree = -900; degree <= 900; ++degree) {
        const double turn = std::remainder(degree / 2.0, 180.0) * 2.0; // -180 .. 180
        const int code = gpom_can_bearing_code(static_cast<float>(degree * M_PI / 180.0));
        const double off = std::remainder(2.0 * code - turn, 360.0);
        CHECK(std::fabs(off) <= 1.001);
        CHECK(std::abs(code) <= 90);
    }
}

// Exactly so many bytes on the heap, for AddressSanitizer: none behind them is read.
TEST_CASE("any bytes of any length, and any signal, are read or refused")
{
    std::mt19937 random(7);
    for (int i = 0; i < 20000; ++i) {
        const std::size_t n = random() % 72;
        std::vector<std::uint8_t> bytes(n);
        for (std::uint8_t &byte : bytes) {
            byte = static_cast<std::uint8_t>(random());
        }
        gpom_can_status_t status;
        gpom_can_clearance_t clearance;
        gpom_can_clearance_fd_t clearance_fd;
        gpom_can_tile_t tile;
        const bool is_classic = n == GPOM_CAN_CLASSIC_BYTES, is_fd = n == GPOM_CAN_FD_BYTES;
        CHECK((gpom_can_status_unpack(&status, bytes.data(), n) == GPOM_CAN_LENGTH) != is_classic);
        CHECK((gpom_can_clearance_unpack(&clearance, bytes.data(), n) == GPOM_CAN_LENGTH) !=
              is_classic);
        CHECK((gpom_can_clearance_fd_unpack(&clearance_fd, bytes.data(), n) == GPOM_CAN_LENGTH) !=
              is_fd);
        CHECK((gpom_can_tile_unpack(&tile, bytes.data(), n) == GPOM_CAN_LENGTH) != is_fd);
        const gpom_can_signal_t signal = {static_cast<std::uint16_t>(random() % 600),
                                          static_cast<std::uint8_t>(random() % 70),
                                          random() % 2 == 0,
                                          random() % 2 == 0,
                                          1.0,
                                          0.0};
        double value = 0.0;
        const std::size_t needed = gpom_can_signal_bytes(&signal);
        CHECK(gpom_can_signal_value(&signal, bytes.data(), n, &value) ==
              (needed != 0 && n >= needed));
        gpom_can_protection_t protection = {};
        gpom_can_stream_t stream = {};
        protection.has_crc = random() % 2 == 0;
        protection.i_crc_byte = static_cast<std::uint8_t>(random() % 80);
        protection.has_counter = true;
        protection.counter = signal;
        protection.counter_max = static_cast<std::uint32_t>(1 + random() % 1000);
        CHECK(gpom_can_check(&protection, &stream, bytes.data(), n) < GPOM_CAN_FAULTS);
    }
}
