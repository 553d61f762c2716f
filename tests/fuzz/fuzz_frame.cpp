// Any bytes on a serial line: nothing is touched outside the reader's memory, each stretch between
// zeros counts once, what is taken is a frame that can be written again, and the next frame of a
// sender is read whatever came before it.
#include "ports/uart/frame.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace
{

constexpr std::size_t kDatagramMax = 200;

void require(bool holds)
{
    if (!holds) {
        std::abort();
    }
}

std::uint64_t counted(const gpom_uart_frame_stats_t &s)
{
    return s.frames_received + s.frames_short + s.frames_long + s.frames_corrupt +
           s.frames_repeated;
}

/// Stretches of bytes between zeros, the last one not yet ended.
std::uint64_t stretches(const std::uint8_t *data, std::size_t size)
{
    std::uint64_t n = 0;
    for (std::size_t i = 0; i + 1 < size; ++i) {
        n += data[i] != 0 && data[i + 1] == 0;
    }
    return n;
}

void check_frame(const gpom_uart_frame_t &frame)
{
    require(frame.n_bytes <= kDatagramMax);
    std::vector<std::uint8_t> line(GPOM_UART_FRAME_BYTES(frame.n_bytes));
    std::vector<std::uint8_t> body(frame.n_bytes + GPOM_UART_BODY_BYTES);
    const std::size_t n = gpom_uart_frame_write(&frame, line.data(), line.size());
    require(n > 0);
    gpom_uart_frame_reader_t reader;
    gpom_uart_frame_reader_init(&reader, body.data(), static_cast<std::uint32_t>(body.size()));
    gpom_uart_frame_t again = {};
    bool is_read = false;
    for (std::size_t i = 0; i < n; ++i) {
        is_read = gpom_uart_frame_read(&reader, line[i], &again) || is_read;
    }
    require(is_read && again.number == frame.number && again.n_bytes == frame.n_bytes);
    require(std::memcmp(again.datagram, frame.datagram, frame.n_bytes) == 0);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
    std::vector<std::uint8_t> body(kDatagramMax + GPOM_UART_BODY_BYTES);
    gpom_uart_frame_reader_t reader;
    gpom_uart_frame_reader_init(&reader, body.data(), static_cast<std::uint32_t>(body.size()));
    gpom_uart_frame_t frame;
    for (std::size_t i = 0; i < size; ++i) {
        if (gpom_uart_frame_read(&reader, data[i], &frame)) {
            check_frame(frame);
        }
    }
    require(counted(reader.stats) == stretches(data, size));

    const gpom_uart_frame_t next = {data, static_cast<std::uint32_t>(size % 100), 0};
    std::uint8_t line[GPOM_UART_FRAME_BYTES(100)];
    const std::size_t n =
        next.datagram != nullptr ? gpom_uart_frame_write(&next, line, sizeof line) : 0;
    const std::uint64_t n_before = reader.stats.frames_received;
    for (std::size_t i = 0; i < n; ++i) {
        if (gpom_uart_frame_read(&reader, line[i], &frame)) {
            check_frame(frame);
        }
    }
    require(n == 0 || reader.stats.frames_received > n_before);
    return 0;
}
