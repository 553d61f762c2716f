// gpom-replay: sends the scans of a file, or the events of an LCM log, over LCM.
#include "ports/codec/codec.h"
#include "ports/host/command_line.hpp"
#include "ports/host/lcm_log.hpp"
#include "ports/host/scan_options.hpp"
#include "ports/linux/lcm/sender.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace gpom_tools;

namespace
{

struct Options {
    std::string in_path;
    std::string url = "udpm://239.255.76.67:7667?ttl=0";
    std::string family = "gpom";
    std::string scan_channel, pose_channel;
    std::vector<std::string> log_channels;
    double rate = 1.0;
    ReadOptions reading;
    std::uint16_t sensor_id = 0;
    std::uint32_t n_rounds = 1;
    bool is_now = false;
    bool is_extent = false;
    std::vector<const CLI::Option *> of_scans; ///< Options that do not apply to an LCM event log.
};

void declare_options(CLI::App &app, Options &options)
{
    // Send ranges as recorded: the receiver decides which are too near.
    options.reading.range_min_m = 0.0;
    app.add_option("in", options.in_path,
                   "Scans (CSV or CARMEN log, plain, gzip or bzip2) or an LCM event log")
        ->required()
        ->type_name("FILE");
    app.add_option("--url", options.url, "LCM's network")->capture_default_str();
    app.add_option("--rate", options.rate, "Speed, as a multiple of the recorded speed")
        ->check(CLI::Range(1e-3, 1e6))
        ->capture_default_str();
    app.add_option("--channel", options.log_channels,
                   "Send only this channel of an LCM log; may be repeated (default: all)");
    options.of_scans = {
        app.add_option("--family", options.family,
                       "Message types of the scans: gpom.scan_t; bot_core.planar_lidar_t and "
                       "pose_t; mbot_lcm_msgs.lidar_t and pose2D_t")
            ->check(CLI::IsMember({"gpom", "bot_core", "mbot"}))
            ->capture_default_str(),
        app.add_option("--scan-channel", options.scan_channel,
                       "Channel of scans; default GPOM_SCAN, other types LIDAR"),
        app.add_option("--pose-channel", options.pose_channel,
                       "Channel of poses; default POSE, mbot SLAM_POSE"),
        app.add_option("--sensor-id", options.sensor_id, "sensor_id of gpom.scan_t")
            ->capture_default_str(),
        app.add_option("--range-max", options.reading.range_max_m,
                       "Usable range of a CARMEN log's sensor [m]")
            ->capture_default_str(),
        app.add_flag("--extent", options.is_extent,
                     "Only print the area of the scans and how long they took: x0 y0 x1 y1 [m], "
                     "duration [s], number of scans"),
        app.add_flag("--now", options.is_now, "Stamp each scan with the time at which it is sent"),
        app.add_option("--repeat", options.n_rounds,
                       "Send all scans this many times; the time goes on")
            ->check(CLI::Range(1u, 1000000u))
            ->capture_default_str()};
    for (CLI::Option *const option : add_scan_options(app, options.reading)) {
        options.of_scans.push_back(option);
    }
}

/// Sends messages. A message waits until the network takes it. Throws if a message cannot be sent.
class Bus {
public:
    explicit Bus(const std::string &url)
    {
        if (const char *const problem = sender_.open(url.c_str()); problem != nullptr) {
            throw std::runtime_error(problem);
        }
    }

    void send(const std::string &channel, const void *bytes, std::size_t n_bytes)
    {
        const gpomd::Patience endless = {[](void *) { return true; }, nullptr};
        if (n_bytes == 0 || !sender_.send(channel.c_str(), static_cast<const std::uint8_t *>(bytes),
                                          n_bytes, endless)) {
            throw std::runtime_error("could not send on " + channel);
        }
        ++n_sent_;
    }
    long n_sent() const { return n_sent_; }

private:
    gpomd::Sender sender_;
    long n_sent_ = 0;
};

/// Waits until a time of the recording has come.
class Pace {
public:
    explicit Pace(double rate) : rate_(rate) {}

    void wait_for(double t_s)
    {
        if (!has_start_) {
            has_start_ = true;
            start_ = Clock::now();
            t0_s_ = t_s;
        }
        const std::chrono::duration<double> due((t_s - t0_s_) / rate_);
        std::this_thread::sleep_until(start_ + std::chrono::duration_cast<Clock::duration>(due));
    }

private:
    using Clock = std::chrono::steady_clock;
    double rate_;
    bool has_start_ = false;
    Clock::time_point start_;
    double t0_s_ = 0.0;
};

/// Sends scans as messages of one family.
class ScanSender {
public:
    ScanSender(const Options &options, Bus &bus) : options_(options), bus_(bus)
    {
        const bool is_own = options.family == "gpom";
        scan_channel_ = options.scan_channel;
        if (scan_channel_.empty()) {
            scan_channel_ = is_own ? "GPOM_SCAN" : "LIDAR";
        }
        pose_channel_ = options.pose_channel;
        if (pose_channel_.empty()) {
            pose_channel_ = options.family == "mbot" ? "SLAM_POSE" : "POSE";
        }
        bytes_.resize(256 + 32 * static_cast<std::size_t>(kScanBeamsMax));
    }

    void send(const Scan &scan, std::int64_t stamp_us)
    {
        ranges_m_ = scan.ranges_m;
        if (options_.family == "gpom") {
            send_own(scan, stamp_us);
        } else if (options_.family == "bot_core") {
            send_bot_core(scan, stamp_us);
        } else {
            send_mbot(scan, stamp_us);
        }
    }

private:
    gpom_wire_floats_t floats(std::vector<float> &values) const
    {
        const auto n = static_cast<std::uint32_t>(values.size());
        return {values.data(), n, n};
    }

    void send_own(const Scan &scan, std::int64_t stamp_us)
    {
        gpom_wire_scan_t message = {};
        message.stamp_us = stamp_us;
        message.sequence = sequence_++;
        message.sensor_id = options_.sensor_id;
        message.pose[0] = scan.x_m;
        message.pose[1] = scan.y_m;
        message.pose[2] = scan.theta_rad;
        message.angle_min_rad = scan.angle_min_rad;
        message.angle_step_rad = scan.angle_step_rad;
        message.ranges_m = floats(ranges_m_);
        bus_.send(scan_channel_, bytes_.data(),
                  gpom_wire_scan_encode(&message, bytes_.data(), bytes_.size()));
    }

    void send_bot_core(const Scan &scan, std::int64_t stamp_us)
    {
        gpom_wire_bot_pose_t pose = {};
        pose.stamp_us = stamp_us;
        pose.position_m[0] = scan.x_m;
        pose.position_m[1] = scan.y_m;
        pose.orientation[0] = std::cos(0.5 * scan.theta_rad);
        pose.orientation[3] = std::sin(0.5 * scan.theta_rad);
        bus_.send(pose_channel_, bytes_.data(),
                  gpom_wire_bot_pose_encode(&pose, bytes_.data(), bytes_.size()));
        gpom_wire_planar_lidar_t message = {};
        message.stamp_us = stamp_us;
        message.ranges_m = floats(ranges_m_);
        message.angle_min_rad = static_cast<float>(scan.angle_min_rad);
        message.angle_step_rad = static_cast<float>(scan.angle_step_rad);
        bus_.send(scan_channel_, bytes_.data(),
                  gpom_wire_planar_lidar_encode(&message, bytes_.data(), bytes_.size()));
    }

    /// All beams have the time of the scan, because the files have no times of beams.
    void send_mbot(const Scan &scan, std::int64_t stamp_us)
    {
        const gpom_wire_pose2d_t pose = {stamp_us, static_cast<float>(scan.x_m),
                                         static_cast<float>(scan.y_m),
                                         static_cast<float>(scan.theta_rad)};
        bus_.send(pose_channel_, bytes_.data(),
                  gpom_wire_pose2d_encode(&pose, bytes_.data(), bytes_.size()));
        const std::size_t n = ranges_m_.size();
        std::vector<float> bearings_rad(n);
        std::vector<float> intensities(n);
        std::vector<std::int64_t> stamps_us(n, stamp_us);
        for (std::size_t i = 0; i < n; ++i) {
            bearings_rad[i] = static_cast<float>(scan.angle_min_rad +
                                                 static_cast<double>(i) * scan.angle_step_rad);
        }
        gpom_wire_lidar_t message = {};
        message.stamp_us = stamp_us;
        message.ranges_m = floats(ranges_m_);
        message.bearings_rad = floats(bearings_rad);
        message.stamps_us = {stamps_us.data(), static_cast<std::uint32_t>(n),
                             static_cast<std::uint32_t>(n)};
        message.intensities = floats(intensities);
        bus_.send(scan_channel_, bytes_.data(),
                  gpom_wire_lidar_encode(&message, bytes_.data(), bytes_.size()));
    }

    const Options &options_;
    Bus &bus_;
    std::string scan_channel_, pose_channel_;
    std::vector<std::uint8_t> bytes_;
    std::vector<float> ranges_m_;
    std::uint32_t sequence_ = 0;
};

std::vector<Scan> scans_of(const Options &options)
{
    return read_scans(options.in_path, options.reading);
}

void print_extent(const std::vector<Scan> &scans)
{
    const auto by_x = [](const Scan &a, const Scan &b) { return a.x_m < b.x_m; };
    const auto by_y = [](const Scan &a, const Scan &b) { return a.y_m < b.y_m; };
    const auto x = std::minmax_element(scans.begin(), scans.end(), by_x);
    const auto y = std::minmax_element(scans.begin(), scans.end(), by_y);
    std::printf("%.3f %.3f %.3f %.3f %.3f %zu\n", x.first->x_m, y.first->y_m, x.second->x_m,
                y.second->y_m, scans.back().t_s - scans.front().t_s, scans.size());
}

std::int64_t microseconds(double t_s) { return std::llround(1e6 * t_s); }

void replay_scans(const Options &options, Bus &bus)
{
    const std::vector<Scan> scans = scans_of(options);
    const double t0_s = scans.front().t_s;
    const double span_s = scans.back().t_s - t0_s;
    const double round_s =
        span_s + (scans.size() > 1 ? span_s / static_cast<double>(scans.size() - 1) : 1.0);
    const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::system_clock::now().time_since_epoch())
                            .count();
    ScanSender scan_sender(options, bus);
    Pace pace(options.rate);
    for (std::uint32_t i = 0; i < options.n_rounds; ++i) {
        for (const Scan &scan : scans) {
            const double t_s = scan.t_s + i * round_s;
            pace.wait_for(t_s);
            scan_sender.send(scan, options.is_now
                                       ? now_us + microseconds((t_s - t0_s) / options.rate)
                                       : microseconds(t_s));
        }
    }
}

void replay_log(const Options &options, Bus &bus)
{
    LcmLog log(options.in_path);
    const std::vector<std::string> &wanted = options.log_channels;
    Pace pace(options.rate);
    for (LcmEvent event; log.next(event);) {
        if (!event.bytes.empty() && (wanted.empty() || std::find(wanted.begin(), wanted.end(),
                                                                 event.channel) != wanted.end())) {
            pace.wait_for(1e-6 * static_cast<double>(event.stamp_us));
            bus.send(event.channel, event.bytes.data(), event.bytes.size());
        }
    }
    if (log.is_cut()) {
        throw FileError(options.in_path, 0,
                        "cut or damaged after its first " + std::to_string(log.n_bytes()) +
                            " bytes; " + std::to_string(bus.n_sent()) + " messages sent");
    }
    if (bus.n_sent() == 0) {
        throw FileError(options.in_path, 0,
                        "has no event to send on these channels; give others with --channel");
    }
}

void replay(const Options &options)
{
    const bool is_log = is_lcm_log(options.in_path);
    if (!is_log && !options.log_channels.empty()) {
        throw std::runtime_error("--channel: only for an LCM event log");
    }
    for (const CLI::Option *const option : options.of_scans) {
        if (is_log && option->count() > 0) {
            throw std::runtime_error(option->get_name() + ": not for an LCM event log");
        }
    }
    if (options.is_extent) {
        print_extent(scans_of(options));
        return;
    }
    Bus bus(options.url);
    if (is_log) {
        replay_log(options, bus);
    } else {
        replay_scans(options, bus);
    }
    std::printf("gpom-replay: %ld messages sent\n", bus.n_sent());
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Send recorded scans, or an LCM event log, over LCM.", "gpom-replay");
    Options options;
    declare_options(app, options);
    return run_tool(app, argc, argv, [&options] { replay(options); });
}
