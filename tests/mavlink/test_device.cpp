// The sender of a device with a line that takes a few bytes at a time, or none.
#include "ports/mavlink/device.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace
{

constexpr std::size_t kHeaderBytes = 10, kCrcBytes = 2;

/// A line that takes at most n_most bytes at once.
struct Line {
    std::vector<std::uint8_t> bytes;
    std::size_t n_most = 1000;

    static std::size_t write(void *line, const std::uint8_t *bytes, std::size_t n_bytes)
    {
        Line &self = *static_cast<Line *>(line);
        const std::size_t n = std::min(n_bytes, self.n_most);
        self.bytes.insert(self.bytes.end(), bytes, bytes + n);
        return n;
    }

    /// Numbers of the messages in the bytes, which must hold whole messages and nothing else, but
    /// for the last one.
    std::vector<unsigned> numbers() const
    {
        std::vector<unsigned> found;
        for (std::size_t at = 0; at + kHeaderBytes <= bytes.size();) {
            REQUIRE(bytes[at] == 0xFD);
            found.push_back(bytes[at + 4]);
            at += kHeaderBytes + bytes[at + 1] + kCrcBytes;
        }
        return found;
    }
};

gpom_mavlink_device_config_t config_of(Line &line)
{
    gpom_mavlink_device_config_t config;
    gpom_mavlink_device_config_init(&config);
    config.ctx = &line;
    config.bytes_write = Line::write;
    return config;
}

/// A sender on a device without a scan.
struct Bench {
    Line line;
    std::unique_ptr<gpom_device_t> device = std::make_unique<gpom_device_t>();
    gpom_mavlink_device_t mavlink = {};
    std::int64_t time_us = 0;

    static std::int64_t now_us(void *bench) { return static_cast<Bench *>(bench)->time_us; }

    Bench()
    {
        device->port.ctx = this;
        device->port.now_us = now_us;
        const gpom_mavlink_device_config_t config = config_of(line);
        REQUIRE(gpom_mavlink_device_init(&mavlink, &config) == GPOM_OK);
    }
    bool tick(std::int64_t to_us)
    {
        time_us = to_us;
        return gpom_mavlink_device_tick(&mavlink, device.get());
    }
};

} // namespace

TEST_CASE("in ten seconds 100 OBSTACLE_DISTANCE and ten HEARTBEAT are sent, in unbroken numbers")
{
    Bench bench;
    for (std::int64_t now_us = 0; now_us < 10000000; now_us += 1000) {
        CHECK_FALSE(bench.tick(now_us));
    }
    CHECK(bench.mavlink.n_sent == 110);
    CHECK(bench.mavlink.n_not_sent == 0);
    const std::vector<unsigned> numbers = bench.line.numbers();
    REQUIRE(numbers.size() == 110);
    for (unsigned i = 0; i < 110; ++i) {
        CHECK(numbers[i] == i);
    }
}

TEST_CASE("the first message comes at once, however late the device begins")
{
    Bench bench;
    bench.tick(5000000000);
    bench.tick(5000000001);
    CHECK(bench.line.numbers().size() == 2);
    CHECK(bench.mavlink.n_not_sent == 0);
}

TEST_CASE("a line that takes three bytes at a time gets whole messages in order")
{
    Bench bench;
    bench.line.n_most = 3;
    for (std::int64_t now_us = 0; now_us < 3000000; now_us += 1000) {
        bench.tick(now_us);
    }
    CHECK(bench.mavlink.n_not_sent == 0);
    CHECK(bench.line.numbers().size() == bench.mavlink.n_sent);
}

TEST_CASE("what comes due while the line takes nothing is counted, and the old message stays whole")
{
    Bench bench;
    bench.line.n_most = 5;
    CHECK(bench.tick(0));
    bench.line.n_most = 0;
    for (std::int64_t now_us = 1000; now_us < 1000000; now_us += 1000) {
        CHECK(bench.tick(now_us));
    }
    CHECK(bench.mavlink.n_sent == 1);
    bench.line.n_most = 1000;
    for (std::int64_t now_us = 1000000; now_us < 1050000; now_us += 1000) {
        CHECK_FALSE(bench.tick(now_us));
    }
    CHECK(bench.mavlink.n_sent == 3); // the second heartbeat, and the eleventh distances
    CHECK(bench.mavlink.n_not_sent == 10);
    CHECK(bench.line.numbers() == std::vector<unsigned>{0, 1, 2});
}

TEST_CASE("a configuration out of range is refused")
{
    Line line;
    gpom_mavlink_device_t mavlink = {};
    const gpom_mavlink_device_config_t good = config_of(line);
    const auto status_of = [&](auto change) {
        gpom_mavlink_device_config_t config = good;
        change(config);
        return gpom_mavlink_device_init(&mavlink, &config);
    };
    using Config = gpom_mavlink_device_config_t;
    CHECK(status_of([](Config &) {}) == GPOM_OK);
    CHECK(gpom_mavlink_device_init(nullptr, &good) == GPOM_ERR_ARG);
    CHECK(gpom_mavlink_device_init(&mavlink, nullptr) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.bytes_write = nullptr; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.system_id = 0; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.component_id = 0; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.sensor = 5; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.n_sectors = 71; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.period_us = 0; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.range_m = 0.0f; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.range_m = 700.0f; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.range_m = __builtin_nanf(""); }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.radius_m = -1.0f; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.radius_m = c.range_m; }) == GPOM_ERR_ARG);
    CHECK(status_of([](Config &c) { c.radius_m = __builtin_nanf(""); }) == GPOM_ERR_ARG);
}
