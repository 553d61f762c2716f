// gpomd: receives scans over LCM and sends maps over LCM, CAN and MAVLink.
#include "ports/host/command_line.hpp"
#include "ports/host/snapshot_file.hpp"
#include "ports/linux/base/clock.hpp"
#include "ports/linux/base/log.hpp"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/base/notify.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/config/words.hpp"
#include "ports/linux/lcm/channels.hpp"
#include "ports/linux/lcm/sender.hpp"
#include "ports/linux/lcm/subscriber.hpp"
#include "ports/linux/map/answers.hpp"
#include "ports/linux/map/intake.hpp"
#include "ports/linux/map/mapping.hpp"
#include "ports/linux/map/snapshots.hpp"
#include "ports/linux/out/can_port.hpp"
#include "ports/linux/out/mavlink_port.hpp"
#include "ports/linux/out/publisher.hpp"
#include "ports/linux/out/status.hpp"

#include <pthread.h>
#include <unistd.h>

#include <csignal>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

namespace gpomd
{

namespace
{

/// The receiving thread waits for a message for this time at most.
constexpr int kWait_ms = 50;

/// Number of tries to tell the service manager that gpomd stops. Its queue may be full.
constexpr int kStoppingTries = 250;
constexpr timespec kTurn = {0, 20000000}; // between tries, and between turns of watch()

/// Period of the log line about dropped data, if data were dropped.
constexpr std::int64_t kLogPeriod_us = 10000000;

/// Longest period of messages to systemd's watchdog.
constexpr std::int64_t kPulseMax_us = 500000;

/// Socket buffer for the map. It is small, because on a slow network newer tiles are better than
/// more old ones.
constexpr int kMapBufferBytes = 32768;

/// Start a thread. `top -H` and debuggers show its name, of at most 15 characters.
template <class Body> std::thread named_thread(const char *name, const Body &body)
{
    return std::thread([name, body] {
        pthread_setname_np(pthread_self(), name);
        body();
    });
}

/// All parts of the daemon, in the order in which they depend on each other.
class Daemon {
public:
    void init(const char *config_path);
    void check();
    void run();

private:
    std::size_t need() const;
    bool has_per_beam() const;
    void init_parts();
    void restore();
    void open_senders();
    void run_threads(const sigset_t &signals);
    void subscribe();
    void receive(const std::atomic<bool> &stop);
    void watch(const sigset_t &signals);
    bool has_pulse();
    void log(const std::string &text) { log_.tell(text.c_str()); }
    void note_drops();
    void log_problems();
    void log_drops();
    void log_jump(std::int64_t now_us);
    void log_link();
    static void on_any(void *daemon, const char *channel, const std::uint8_t *bytes,
                       std::size_t n_bytes);
    static void on_scan(void *daemon, const char *channel, const std::uint8_t *bytes,
                        std::size_t n_bytes);
    static void on_pose(void *daemon, const char *channel, const std::uint8_t *bytes,
                        std::size_t n_bytes);
    static void on_query(void *daemon, const char *channel, const std::uint8_t *bytes,
                         std::size_t n_bytes);
    static void on_request(void *daemon, const char *channel, const std::uint8_t *bytes,
                           std::size_t n_bytes);
    static void on_status(void *daemon, const char *channel, const std::uint8_t *bytes,
                          std::size_t n_bytes);

    Config config_;
    Log log_{STDOUT_FILENO};
    Memory memory_;
    Counts counts_;
    Problems problems_;
    Channels channels_;
    Sender map_sender_{&counts_}, answer_sender_{&counts_}, status_sender_{&counts_};
    Subscriber subscriber_;
    ScanQueue scans_;
    QueryQueue queries_;
    Intake intake_;
    std::optional<gpom_tools::SnapshotFile> snapshot_file_;
    Snapshots snapshots_;
    MapThread mapping_;
    Publisher publisher_;
    Odometry odometry_;
    CanPort can_;
    MavlinkPort mavlink_;
    std::atomic<std::uint64_t> pulse_{0}; ///< Pulse of the receiving thread.
    std::uint64_t seen_pulses_[5] = {};
    std::int64_t n_logged_jumps_ = 0;
    std::int64_t jump_log_us_ = 0; ///< No line about a jump before this time, monotonic.
    bool has_logged_link_ = true;  ///< The link state that the log reported last.
    std::uint32_t n_logged_links_ = 1;
    std::int64_t logged_drops_[kDropCount] = {}, noted_drops_[kDropCount] = {};
};

bool Daemon::has_per_beam() const
{
    bool has = false;
    for (std::size_t i = 0; i < config_.n_sensors; ++i) {
        has = has || config_.sensors[i].type == ScanType::lidar;
    }
    return has;
}

std::size_t Daemon::need() const
{
    const IntakeConfig &intake = config_.intake;
    return ScanQueue::need(intake.queue_scans + 1, intake.ranges_max, has_per_beam()) +
           QueryQueue::need() + Intake::need(config_) + MapThread::need(config_) +
           Snapshots::need(config_) + Publisher::need(config_) + CanPort::need(config_) +
           Subscriber::need(intake.ranges_max);
}

void Daemon::init(const char *config_path) { read_config(config_path, config_); }

void Daemon::check()
{
    char text[200];
    std::snprintf(text, sizeof text,
                  "configuration is good: %zu sensors, %u beams, %u x %u cells of %g m; "
                  "%.1f MB taken at start",
                  config_.n_sensors, config_.map.beam_max, unsigned{config_.map.lowres_nx},
                  unsigned{config_.map.lowres_ny}, config_.map.lowres_cell_m,
                  1e-6 * static_cast<double>(need()));
    log(text);
}

void Daemon::subscribe()
{
    static_assert(kSensorsMax + 4 <= Subscriber::kSubscriptionsMax,
                  "poses, queries, requests, statuses");
    channels_.init(config_, problems_, monotonic_us());
    subscriber_.hear_all(on_any, this);
    for (std::size_t i = 0; i < config_.n_sensors; ++i) {
        bool is_new = true; // sensors of gpom.scan_t may share a channel
        for (std::size_t j = 0; j < i; ++j) {
            is_new =
                is_new && std::strcmp(config_.sensors[i].channel, config_.sensors[j].channel) != 0;
        }
        if (is_new) {
            subscriber_.subscribe(config_.sensors[i].channel, on_scan, this);
        }
    }
    if (config_.pose.channel[0] != '\0') {
        subscriber_.subscribe(config_.pose.channel, on_pose, this);
    }
    subscriber_.subscribe(config_.publish.query, on_query, this);
    subscriber_.subscribe(config_.publish.request, on_request, this);
    subscriber_.subscribe(config_.publish.status, on_status, this);
    if (const char *const problem = subscriber_.open(config_.lcm_url); problem != nullptr) {
        throw std::runtime_error(problem);
    }
}

void Daemon::on_any(void *daemon, const char *channel, const std::uint8_t *bytes,
                    std::size_t n_bytes)
{
    static_cast<Daemon *>(daemon)->channels_.take(channel, bytes, n_bytes, monotonic_us());
}

void Daemon::on_scan(void *daemon, const char *channel, const std::uint8_t *bytes,
                     std::size_t n_bytes)
{
    static_cast<Daemon *>(daemon)->intake_.take_scan(channel,
                                                     {bytes, n_bytes, wall_us(), monotonic_us()});
}

void Daemon::on_pose(void *daemon, const char * /*channel*/, const std::uint8_t *bytes,
                     std::size_t n_bytes)
{
    static_cast<Daemon *>(daemon)->intake_.take_pose({bytes, n_bytes, wall_us(), monotonic_us()});
}

void Daemon::on_query(void *daemon, const char * /*channel*/, const std::uint8_t *bytes,
                      std::size_t n_bytes)
{
    Daemon &self = *static_cast<Daemon *>(daemon);
    bool has_slot = false;
    const char *const problem =
        self.queries_.push(bytes, n_bytes, self.config_.publish.is_query_crc_optional, has_slot);
    if (has_slot) {
        self.scans_.ready.wake();
    } else {
        self.counts_.add(GPOM_WIRE_QUERIES_REFUSED);
    }
    if (problem != nullptr) {
        Problem refused = {GPOM_WIRE_PROBLEM_QUERY_REFUSED};
        refused.text = problem;
        self.problems_.note(refused);
    }
}

/// Any message is a request. Its contents do not matter.
void Daemon::on_request(void *daemon, const char * /*channel*/, const std::uint8_t * /*bytes*/,
                        std::size_t /*n_bytes*/)
{
    static_cast<Daemon *>(daemon)->publisher_.request_keyframe();
}

/// Another gpomd sends its status on our channel. Our own status comes back, too, but from our own
/// port.
void Daemon::on_status(void *daemon, const char *channel, const std::uint8_t *bytes,
                       std::size_t n_bytes)
{
    Daemon &self = *static_cast<Daemon *>(daemon);
    const std::uint64_t sender = self.subscriber_.sender();
    if (ntohs(static_cast<std::uint16_t>(sender & 0xffff)) != self.status_sender_.port() &&
        gpom_wire_fingerprint(bytes, n_bytes) == GPOM_WIRE_STATUS_FINGERPRINT) {
        Problem problem = {GPOM_WIRE_PROBLEM_TWO_MAPPERS};
        problem.sender = sender;
        std::memcpy(problem.channel, channel, std::strlen(channel) + 1);
        self.problems_.note(problem);
    }
}

void Daemon::receive(const std::atomic<bool> &stop)
{
    while (!stop.load(std::memory_order_relaxed)) {
        pulse_.fetch_add(1, std::memory_order_relaxed);
        subscriber_.handle(kWait_ms);
        intake_.match_waiting(); // odometry comes on another thread
        intake_.expire(monotonic_us());
        channels_.check(monotonic_us());
    }
}

/// True if every thread has run since this function last returned true.
bool Daemon::has_pulse()
{
    const std::uint64_t pulses[] = {pulse_.load(std::memory_order_relaxed), mapping_.pulse(),
                                    publisher_.pulse(),
                                    can_.is_used() ? can_.pulse() : pulse_.load(),
                                    mavlink_.is_used() ? mavlink_.pulse() : pulse_.load()};
    for (std::size_t i = 0; i < std::size(pulses); ++i) {
        if (pulses[i] == seen_pulses_[i]) {
            return false;
        }
    }
    std::copy(std::begin(pulses), std::end(pulses), seen_pulses_);
    return true;
}

/// Note a problem for each kind of drop that only a counter reports.
void Daemon::note_drops()
{
    for (std::size_t i = 0; i < kDropCount; ++i) {
        const std::int64_t n = counts_[kDrops[i].place] - noted_drops_[i];
        noted_drops_[i] += n;
        if (n > 0 && kDrops[i].kind >= 0) {
            Problem problem = {static_cast<std::uint32_t>(kDrops[i].kind)};
            problem.value = static_cast<double>(n);
            problem.i_drop = i;
            problems_.note(problem);
        }
    }
}

void Daemon::log_problems()
{
    for (Problem problem = {}; problems_.next(problem);) {
        log(sentence(problem, config_));
    }
}

void Daemon::log_drops()
{
    std::string text;
    for (std::size_t i = 0; i < kDropCount; ++i) {
        const std::int64_t n = counts_[kDrops[i].place] - logged_drops_[i];
        logged_drops_[i] += n;
        if (n > 0) {
            text += (text.empty() ? "" : ", ") + std::to_string(n) + " " + kDrops[i].name;
        }
    }
    if (!text.empty()) {
        log("dropped: " + text);
    }
}

/// Log the last jump, if it has not been logged. A localiser that jumps back and forth must not
/// fill the disk with log lines.
void Daemon::log_jump(std::int64_t now_us)
{
    const std::int64_t n_jumps = counts_[GPOM_WIRE_FRAME_JUMPS];
    if (n_jumps == n_logged_jumps_ || now_us < jump_log_us_) {
        return;
    }
    n_logged_jumps_ = n_jumps;
    jump_log_us_ = now_us + kLogPeriod_us;
    const MapState state = mapping_.state();
    const double *const from = state.jump_from;
    const double *const to = state.jump_to;
    char text[240];
    std::snprintf(
        text, sizeof text,
        "the map frame jumped (%lld until now): robot before at %.3f m, %.3f m, %.3f rad; "
        "after at %.3f m, %.3f m, %.3f rad",
        static_cast<long long>(n_jumps), from[0], from[1], from[2], to[0], to[1], to[2]);
    log(text);
}

/// Log when LCM's network is lost, and when it is joined again.
void Daemon::log_link()
{
    const bool has_link = subscriber_.has_link();
    const std::uint32_t n_links = subscriber_.n_links();
    if (!has_link && has_logged_link_) {
        log("no interface carries LCM's network any more; gpomd joins it again when one does");
    } else if (has_link && (!has_logged_link_ || n_links != n_logged_links_)) {
        log("LCM's network was joined again");
    }
    has_logged_link_ = has_link;
    n_logged_links_ = n_links;
}

/// Send status, feed the watchdog and write the log, until a signal says to stop.
void Daemon::watch(const sigset_t &signals)
{
    StatusSender status(config_, status_sender_, mapping_, counts_, problems_);
    const std::int64_t watchdog_period_us = std::min(watchdog_us() / 3, kPulseMax_us);
    std::int64_t status_us = monotonic_us();
    std::int64_t watchdog_next_us = status_us;
    std::int64_t log_us = status_us + kLogPeriod_us;
    bool is_ready_told = !is_managed();
    for (int signal_number = -1; signal_number < 0;) {
        const std::int64_t now_us = monotonic_us();
        if (now_us >= status_us) {
            status.send(false);
            status_us = now_us + config_.publish.status_period_us;
        }
        // Its queue may be full: try again next turn.
        is_ready_told = is_ready_told || notify("READY=1");
        if (watchdog_period_us > 0 && now_us >= watchdog_next_us && has_pulse()) {
            notify("WATCHDOG=1");
            watchdog_next_us = now_us + watchdog_period_us;
        }
        if (now_us >= log_us) {
            log_drops();
            log_us = now_us + kLogPeriod_us;
        }
        log_.tell_lost();
        note_drops();
        log_problems();
        log_jump(now_us);
        log_link();
        for (const char *news = can_.next_news(); news != nullptr; news = can_.next_news()) {
            log(std::string(config_.can.interface) + " " + news);
        }
        for (MavlinkNews news = {}; mavlink_.next_news(news);) {
            log(std::string(config_.mavlink.to) + " " + news.text + news.reason);
        }
        signal_number = sigtimedwait(&signals, nullptr, &kTurn);
    }
    status.send(true);
    for (int i = 0; i < kStoppingTries && is_managed() && !notify("STOPPING=1"); ++i) {
        nanosleep(&kTurn, nullptr);
    }
}

void Daemon::init_parts()
{
    if (!memory_.reserve(need())) {
        throw std::runtime_error("not enough memory for the map; lower map.beam_max or the raster");
    }
    scans_.init(memory_, config_.intake.queue_scans + 1, config_.intake.ranges_max, has_per_beam());
    queries_.init(memory_);
    intake_.init(config_, memory_, scans_, counts_, problems_);
    const char *const problem = mapping_.init(
        config_, memory_, {&answer_sender_, &scans_, &queries_, &snapshots_, &counts_, &problems_});
    if (problem != nullptr) {
        throw std::runtime_error(std::string("map: ") + problem);
    }
    publisher_.init(config_, memory_, map_sender_, mapping_, counts_);
    subscriber_.init(config_.intake.ranges_max, memory_, counts_);
    odometry_.init(config_.can.odometry);
    can_.init(config_, memory_, {&mapping_, &odometry_, &counts_});
    mavlink_.init(config_, {&mapping_, &odometry_, &counts_}, counts_);
    if (config_.can.has_odometry) {
        intake_.use_odometry(odometry_);
    }
    if (config_.snapshot_path[0] != '\0') {
        snapshot_file_.emplace(config_.snapshot_path, config_.map.beam_max, true);
        snapshots_.init(config_, memory_, snapshot_file_->io(), counts_);
    }
}

void Daemon::restore()
{
    gpom_snapshot_report_t report = {};
    if (mapping_.restore(report)) {
        const std::int64_t stamp_us = mapping_.state().stamp_us;
        char text[160];
        std::snprintf(text, sizeof text,
                      "restored %u beams from snapshot %llu, its newest scan of %.3f s, %.3f s old",
                      report.n_beams, static_cast<unsigned long long>(report.sequence),
                      1e-6 * static_cast<double>(stamp_us),
                      1e-6 * static_cast<double>(wall_us() - stamp_us));
        log(std::string(text) +
            (report.params_differ != 0 ? ", taken with other hyperparameters" : "") +
            (report.n_dropped > 0 ? "; " + std::to_string(report.n_dropped) + " did not fit" : ""));
        const std::string kept = snapshot_file_->keep_larger(report.slot);
        if (!kept.empty()) {
            snapshots_.drop(report.slot);
            log("that snapshot is of a larger map.beam_max; gpomd keeps all of it in " + kept);
        }
    } else if (snapshots_.is_used()) {
        log(std::string("no whole snapshot in ") + config_.snapshot_path +
            ": the map begins empty");
    }
}

void Daemon::open_senders()
{
    const char *problem = map_sender_.open(config_.lcm_url, kMapBufferBytes);
    for (Sender *const sender : {&answer_sender_, &status_sender_}) {
        problem = problem == nullptr ? sender->open(config_.lcm_url) : problem;
    }
    if (problem != nullptr) {
        throw std::runtime_error(problem);
    }
}

void Daemon::run()
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    // Blocks the signals in all threads; watch() waits for them.
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::signal(SIGPIPE, SIG_IGN); // the daemon goes on when nobody reads its log
    std::signal(SIGXFSZ, SIG_IGN); // a snapshot that may not grow fails, but does not end the
                                   // daemon
    open_senders();
    init_parts();
    check();
    restore();
    subscribe();
    can_.open();
    run_threads(signals);
    note_drops();
    log_problems();
    jump_log_us_ = 0; // log the last jump in any case
    log_jump(monotonic_us());
    log_drops();
    log("stopped after " + std::to_string(counts_[GPOM_WIRE_SCANS_INSERTED]) + " scans");
}

void Daemon::run_threads(const sigset_t &signals)
{
    std::atomic<bool> stop_receiving{false}, stop_mapping{false}, stop_publishing{false};
    std::thread writer = named_thread("snapshots", [&] { snapshots_.run(); });
    std::thread mapper = named_thread("mapping", [&] { mapping_.run(stop_mapping); });
    std::thread publisher = named_thread("publisher", [&] { publisher_.run(stop_publishing); });
    std::thread can = named_thread("can", [&] { can_.run(stop_publishing); });
    std::thread mavlink = named_thread("mavlink", [&] { mavlink_.run(stop_publishing); });
    std::thread receiver = named_thread("receiver", [&] { receive(stop_receiving); });
    log(std::string("ready on ") + config_.lcm_url);
    watch(signals);
    stop_receiving = true;
    receiver.join();
    stop_mapping = true;
    scans_.ready.wake();
    mapper.join();
    snapshots_.stop();
    writer.join();
    stop_publishing = true;
    publisher_.wake();
    publisher.join();
    can.join();
    mavlink.join();
}

} // namespace

} // namespace gpomd

int main(int argc, char **argv)
{
    CLI::App app("Receive scans over LCM and send low-resolution maps, status and answers.\n"
                 "Runs in the foreground until SIGTERM or SIGINT.",
                 "gpomd");
    std::string config_path;
    bool is_check = false;
    app.add_option("--config", config_path, "Configuration in TOML, see ports/linux/gpomd.toml")
        ->required()
        ->type_name("FILE");
    app.add_flag("--check", is_check, "Check the configuration and stop");
    static gpomd::Daemon daemon; // static because it is large; its parts point to each other
    return gpom_tools::run_tool(app, argc, argv, [&] {
        daemon.init(config_path.c_str());
        if (is_check) {
            daemon.check();
        } else {
            daemon.run();
        }
    });
}
