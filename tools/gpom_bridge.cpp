// gpom-bridge: connects a device behind a serial line (ports/uart/) with LCM.
#include "ports/codec/codec.h"
#include "ports/host/command_line.hpp"
#include "ports/host/serial_line.hpp"
#include "ports/linux/lcm/sender.hpp"
#include "ports/linux/lcm/subscriber.hpp"
#include "ports/uart/frame.h"

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace gpom_tools;

namespace
{

constexpr int kWait_ms = 100;
/// A line that accepts no bytes for this time is stuck, and the frame is given up.
constexpr int kStuck_ms = 2000;

/// Ranges of the longest scan that is passed on.
constexpr std::uint32_t kRangesMax = 3000;

/// The longest message of the device in fragments. Its own messages are not longer.
constexpr std::uint32_t kMessageBytesMax = 65536;
constexpr std::uint32_t kFragmentsMax = 64;

struct Options {
    std::string line;
    unsigned baud = 1000000;
    std::string url = "udpm://239.255.76.67:7667?ttl=0";
    std::vector<std::string> to_device = {"GPOM_SCAN", "GPOM_MAP_REQUEST"};
    double report_s = 0.0;
};

void declare_options(CLI::App &app, Options &options)
{
    app.add_option("line", options.line,
                   "Serial port, or unix:PATH or tcp:HOST:PORT of QEMU's UART (-serial)")
        ->required()
        ->type_name("LINE");
    app.add_option("--baud", options.baud, "Rate of a serial port, with 8 bits and no parity")
        ->capture_default_str();
    app.add_option("--url", options.url, "LCM's network")->capture_default_str();
    app.add_option("--to-device", options.to_device,
                   "Channels whose messages go to the device; may be repeated, at most 16 in all. "
                   "The device names the channels of its own messages")
        ->expected(1, static_cast<int>(gpomd::Subscriber::kSubscriptionsMax))
        ->allow_extra_args(false)
        ->capture_default_str();
    app.add_option("--report", options.report_s, "Period of printing the counters [s]; 0: never")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
}

std::atomic<bool> is_stopped{false};

void stop(int) { is_stopped.store(true); }

/// Turns LCM messages of a sender into frames on the line.
class ToDevice {
public:
    explicit ToDevice(SerialLine &line) : line_(line), frame_(GPOM_UART_FRAME_BYTES(UINT16_MAX)) {}

    static void receive(void *ctx, const char *channel, const std::uint8_t *bytes,
                        std::size_t n_bytes)
    {
        static_cast<ToDevice *>(ctx)->send(channel, bytes, n_bytes);
    }
    long n_sent() const { return n_sent_; }
    long n_dropped() const { return n_dropped_; }

private:
    void send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes)
    {
        const std::uint32_t sequence = sequence_++;
        const std::size_t n_head =
            gpom_wire_datagram_begin(datagram_, sizeof datagram_, channel, sequence);
        bool is_sent = n_head > 0;
        if (is_sent && n_head + n_bytes <= sizeof datagram_) {
            std::copy_n(bytes, n_bytes, datagram_ + n_head);
            is_sent = send_datagram(n_head + n_bytes);
        } else if (is_sent) {
            is_sent = send_fragments({channel, bytes, static_cast<std::uint32_t>(n_bytes), sequence,
                                      GPOM_WIRE_DATAGRAM_BYTES});
        }
        ++(is_sent ? n_sent_ : n_dropped_);
    }

    bool send_fragments(const gpom_wire_outgoing_t &message)
    {
        const std::uint32_t n = gpom_wire_fragment_count(&message);
        bool is_sent = n > 0;
        for (std::uint32_t i = 0; i < n && is_sent; ++i) {
            is_sent =
                send_datagram(gpom_wire_fragment_write(&message, i, datagram_, sizeof datagram_));
        }
        return is_sent;
    }

    bool send_datagram(std::size_t n_bytes)
    {
        const gpom_uart_frame_t frame = {datagram_, static_cast<std::uint32_t>(n_bytes), number_};
        const std::size_t n_frame = gpom_uart_frame_write(&frame, frame_.data(), frame_.size());
        number_ = gpom_uart_frame_next_number(number_);
        return n_frame > 0 && line_.write(frame_.data(), n_frame, kStuck_ms);
    }

    SerialLine &line_;
    std::vector<std::uint8_t> frame_;
    std::uint8_t datagram_[GPOM_WIRE_DATAGRAM_BYTES] = {};
    std::uint32_t sequence_ = 0;
    std::uint16_t number_ = 0;
    long n_sent_ = 0, n_dropped_ = 0;
};

/// Publishes the frames of the device over LCM.
class FromDevice {
public:
    FromDevice(SerialLine &line, gpomd::Sender &sender)
        : line_(line), sender_(sender), body_(UINT16_MAX + GPOM_UART_BODY_BYTES),
          slot_(GPOM_WIRE_RECEIVER_BYTES(1, kMessageBytesMax, kFragmentsMax) / 8 + 1)
    {
        gpom_uart_frame_reader_init(&reader_, body_.data(),
                                    static_cast<std::uint32_t>(body_.size()));
        const gpom_wire_receiver_config_t config = {1, kMessageBytesMax, kFragmentsMax, 1000000};
        if (gpom_wire_receiver_init(&receiver_, &config, slot_.data(), 8 * slot_.size()) !=
            GPOM_OK) {
            throw std::logic_error("receiver of the device's messages");
        }
    }

    /// Read and publish what has come. Waits for a moment.
    void take()
    {
        std::uint8_t bytes[4096];
        const std::size_t n = line_.read(bytes, sizeof bytes, kWait_ms);
        const std::lock_guard<std::mutex> lock(mutex_);
        for (std::size_t i = 0; i < n; ++i) {
            gpom_uart_frame_t frame;
            if (gpom_uart_frame_read(&reader_, bytes[i], &frame)) {
                publish(frame);
            }
        }
    }
    /// Any thread may call this.
    long n_published() const { return n_published_; }
    gpom_uart_frame_stats_t frames() const
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        return reader_.stats;
    }

private:
    void publish(const gpom_uart_frame_t &frame)
    {
        using namespace std::chrono;
        const std::int64_t now_us =
            duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
        const gpom_wire_arrival_t arrival = {frame.datagram, frame.n_bytes, 0, now_us};
        gpom_wire_message_t message;
        if (gpom_wire_receive(&receiver_, &arrival, &message) &&
            sender_.send(message.channel, message.payload, message.payload_bytes)) {
            ++n_published_;
        }
    }

    SerialLine &line_;
    gpomd::Sender &sender_;
    std::vector<std::uint8_t> body_;
    std::vector<std::uint64_t> slot_;
    mutable std::mutex mutex_; ///< Guards reader_.
    gpom_uart_frame_reader_t reader_;
    gpom_wire_receiver_t receiver_;
    std::atomic<long> n_published_{0};
};

void report(const ToDevice &to, const FromDevice &from, const gpomd::Counts &counts)
{
    const gpom_uart_frame_stats_t frames = from.frames();
    std::printf(
        "gpom-bridge: %ld messages to the device, %ld given up, %lld datagrams lost; %ld "
        "from it, frames %llu short, %llu long, %llu corrupt, %llu repeated, %llu lost; %lld "
        "not sent on\n",
        to.n_sent(), to.n_dropped(), static_cast<long long>(counts[GPOM_WIRE_DATAGRAMS_LOST]),
        from.n_published(), static_cast<unsigned long long>(frames.frames_short),
        static_cast<unsigned long long>(frames.frames_long),
        static_cast<unsigned long long>(frames.frames_corrupt),
        static_cast<unsigned long long>(frames.frames_repeated),
        static_cast<unsigned long long>(frames.frames_lost),
        static_cast<long long>(counts[GPOM_WIRE_MESSAGES_NOT_SENT]));
    std::fflush(stdout);
}

/// The line is read by its own thread, so that neither direction waits for the other.
void run(const Options &options)
{
    SerialLine line(options.line, options.baud);
    gpomd::Counts counts;
    gpomd::Sender sender(&counts);
    if (const char *const problem = sender.open(options.url.c_str())) {
        throw std::runtime_error(problem);
    }
    gpomd::Memory memory;
    gpomd::Subscriber subscriber;
    if (!memory.reserve(gpomd::Subscriber::need(kRangesMax))) {
        throw std::runtime_error("no memory for the receiver");
    }
    subscriber.init(kRangesMax, memory, counts);
    if (const char *const problem = subscriber.open(options.url.c_str())) {
        throw std::runtime_error(problem);
    }
    ToDevice to(line);
    FromDevice from(line, sender);
    for (const std::string &channel : options.to_device) {
        subscriber.subscribe(channel.c_str(), ToDevice::receive, &to);
    }
    std::exception_ptr problem;
    std::thread reader([&] {
        try {
            while (!is_stopped.load()) {
                from.take();
            }
        } catch (...) {
            problem = std::current_exception();
            is_stopped.store(true);
        }
    });
    std::puts("gpom-bridge: ready");
    std::fflush(stdout);
    using Clock = std::chrono::steady_clock;
    const std::chrono::duration<double> period(options.report_s);
    Clock::time_point reported = Clock::now();
    try {
        while (!is_stopped.load()) {
            subscriber.handle(kWait_ms);
            if (options.report_s > 0.0 && Clock::now() - reported >= period) {
                reported = Clock::now();
                report(to, from, counts);
            }
        }
    } catch (...) { // the reader must end before its line is closed
        is_stopped.store(true);
        reader.join();
        throw;
    }
    reader.join();
    report(to, from, counts);
    if (problem) {
        std::rethrow_exception(problem);
    }
}

} // namespace

int main(int argc, char **argv)
{
    signal(SIGTERM, stop);
    signal(SIGINT, stop);
    CLI::App app("Connect a device behind a serial line with LCM: send it the messages of some "
                 "channels, and publish its messages.",
                 "gpom-bridge");
    Options options;
    declare_options(app, options);
    return run_tool(app, argc, argv, [&options] { run(options); });
}
