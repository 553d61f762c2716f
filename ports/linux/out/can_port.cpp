#include "ports/linux/out/can_port.hpp"

#include "ports/linux/base/clock.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <poll.h>

#include <algorithm>

namespace gpomd
{

namespace
{

/// Longest sleep. The thread checks the clock and the daemon's stop flag at least this often.
constexpr std::int64_t kWait_us = 20000;
/// Most frames received in one go before something is sent.
constexpr int kFramesAtOnce = 512;
/// Period of looking for an interface that is not there.
constexpr std::int64_t kOpenPeriod_us = 200000;
/// Pauses after a full queue. Each is twice as long as the one before.
constexpr std::int64_t kBackOffMin_us = 2000, kBackOffMax_us = 500000;

constexpr const char *kNews[] = {
    "is there: frames are received and sent",
    "is not there, or this kernel has no CAN; gpomd waits for it. To make a virtual one: modprobe "
    "vcan && ip link add vcan0 type vcan && ip link set vcan0 mtu 72 up",
    "carries no CAN FD: frames of more than 8 bytes are not sent. For a virtual interface: ip "
    "link set vcan0 mtu 72; for a real one: ip link set can0 type can ... dbitrate RATE fd on",
    "is down; bring it up with: ip link set INTERFACE up",
    "is up again",
    "was removed; gpomd waits until it comes back",
    "is bus-off: the controller takes no part in the bus. To let it come back by itself: "
    "ip link set INTERFACE type can restart-ms 100",
    "was restarted after bus-off",
    "brings no odometry: no message for can.odometry.timeout_s",
    "brings odometry"};

std::size_t place_of(gpom_can_fault_t fault)
{
    switch (fault) {
    case GPOM_CAN_LENGTH:
        return GPOM_WIRE_CAN_BAD_LENGTH;
    case GPOM_CAN_CRC:
        return GPOM_WIRE_CAN_BAD_CRC;
    case GPOM_CAN_COUNTER:
        return GPOM_WIRE_CAN_BAD_COUNTER;
    default:
        return GPOM_WIRE_CAN_BAD_VALUE;
    }
}

} // namespace

std::size_t CanPort::need(const Config &config) { return CanPicture::need(config); }

void CanPort::init(const Config &config, Memory &memory, const CanLinks &links)
{
    static_assert(sizeof kNews / sizeof *kNews == static_cast<std::size_t>(News::count),
                  "a sentence for each");
    config_ = &config;
    links_ = links;
    picture_.init(config, memory, {links.mapping, links.odometry, links.counts});
}

void CanPort::tell(News news)
{
    news_.fetch_or(1u << static_cast<unsigned>(news), std::memory_order_relaxed);
}

const char *CanPort::next_news()
{
    const std::uint32_t news = news_.load(std::memory_order_relaxed);
    for (unsigned i = 0; i < static_cast<unsigned>(News::count); ++i) {
        if ((news >> i & 1u) != 0) {
            news_.fetch_and(~(1u << i), std::memory_order_relaxed);
            return kNews[i];
        }
    }
    return nullptr;
}

void CanPort::open()
{
    if (is_used()) {
        try_open(monotonic_us());
    }
}

void CanPort::run(const std::atomic<bool> &stop)
{
    if (!is_used()) {
        return;
    }
    while (!stop.load(std::memory_order_relaxed)) {
        pulse_.fetch_add(1, std::memory_order_relaxed);
        const std::int64_t now_us = monotonic_us();
        try_open(now_us);
        wait(now_us);
        receive();
        note_silence(monotonic_us());
        send_due(monotonic_us());
    }
    send_stopping();
}

void CanPort::try_open(std::int64_t now_us)
{
    if (bus_.is_open() || now_us < open_next_us_) {
        return;
    }
    open_next_us_ = now_us + kOpenPeriod_us;
    if (!bus_.open(config_->can)) {
        if (!is_missed_) {
            tell(News::absent);
        }
        is_missed_ = true;
        return;
    }
    tell(News::open);
    if (config_->can.has_fd && !bus_.has_fd()) {
        tell(News::no_fd);
    }
    is_missed_ = false;
    is_bus_off_ = false;
    down_us_ = 0;
}

/// Wait until a frame comes or something must be sent.
void CanPort::wait(std::int64_t now_us)
{
    std::int64_t until_us = now_us + kWait_us;
    const CanConfig &can = config_->can;
    const struct {
        const CanSendConfig &to;
        const Turn &turn;
    } turns[] = {{can.status, status_},
                 {can.clearance, clearance_},
                 {can.clearance_fd, clearance_fd_},
                 {can.tile, tile_}};
    for (const auto &each : turns) {
        until_us = each.to.period_us > 0 ? std::min(until_us, each.turn.next_us) : until_us;
    }
    const std::int64_t wait_us = std::max<std::int64_t>(until_us - now_us, 0);
    pollfd frames = {bus_.fd(), POLLIN, 0};
    poll(&frames, 1, static_cast<int>((wait_us + 999) / 1000));
}

void CanPort::receive()
{
    for (int i = 0; i < kFramesAtOnce && bus_.is_open(); ++i) {
        CanFrame frame;
        switch (bus_.read(frame)) {
        case CanRead::frame:
            note_up(frame.stamp_us);
            if ((frame.id & CAN_ERR_FLAG) != 0) {
                take_error(frame);
            } else {
                take_message(frame);
            }
            links_.counts->add(GPOM_WIRE_CAN_OVERFLOWS, bus_.take_overflow());
            break;
        case CanRead::none:
            return;
        case CanRead::down:
            note_down();
            return;
        case CanRead::gone:
            links_.counts->add(GPOM_WIRE_CAN_DOWNS);
            tell(News::gone);
            is_missed_ = true; // the log reports this once
            return;
        }
    }
}

/// Note that the interface is down. The kernel reports this once, either to the read or to the
/// write.
void CanPort::note_down()
{
    if (down_us_ == 0) {
        links_.counts->add(GPOM_WIRE_CAN_DOWNS);
        tell(News::down);
        down_us_ = wall_us();
        is_bus_off_ = false; // the controller starts afresh when it comes up
    }
}

/// Note that a frame with this stamp went through. Frames received before the interface went down
/// may be read afterwards, so stamps are compared.
void CanPort::note_up(std::int64_t stamp_us)
{
    if (down_us_ > 0 && stamp_us > down_us_) {
        tell(News::up);
        down_us_ = 0;
    }
}

void CanPort::take_error(const CanFrame &frame)
{
    links_.counts->add(GPOM_WIRE_CAN_ERRORS);
    if ((frame.id & CAN_ERR_BUSOFF) != 0) {
        links_.counts->add(GPOM_WIRE_CAN_BUS_OFFS);
        if (!is_bus_off_) {
            tell(News::bus_off);
        }
        is_bus_off_ = true;
    } else if ((frame.id & CAN_ERR_RESTARTED) != 0) {
        is_bus_off_ = false;
        tell(News::restarted);
    }
}

void CanPort::take_message(const CanFrame &frame)
{
    const CanConfig &can = config_->can;
    links_.counts->add(GPOM_WIRE_CAN_RECEIVED);
    is_bus_off_ = false;
    for (std::size_t i = 0; i < can.n_messages; ++i) {
        const CanMessageConfig &message = can.messages[i];
        if (message.id != frame.id) {
            continue;
        }
        gpom_can_fault_t fault =
            message.n_bytes != 0 && message.n_bytes != frame.n_bytes
                ? GPOM_CAN_LENGTH
                : gpom_can_check(&message.protection, &streams_[i], frame.bytes, frame.n_bytes);
        if (fault == GPOM_CAN_OK) {
            links_.counts->add(GPOM_WIRE_CAN_LOST, streams_[i].n_lost);
            fault = take_signals(i, frame) ? GPOM_CAN_OK : GPOM_CAN_LENGTH;
        }
        if (fault != GPOM_CAN_OK) {
            links_.counts->add(place_of(fault));
            return;
        }
        note_motion(frame.stamp_us);
    }
}

/// Note the values in a message. False: the message is too short.
bool CanPort::take_signals(std::size_t i_message, const CanFrame &frame)
{
    const CanConfig &can = config_->can;
    for (std::size_t k = 0; k < kCanSignals; ++k) {
        const CanSignalConfig &signal = can.signals[k];
        std::uint64_t bits = 0;
        double value = 0.0;
        if (signal.i_message != i_message) {
            continue;
        }
        if (!gpom_can_signal_bits(&signal.signal, frame.bytes, frame.n_bytes, &bits) ||
            !gpom_can_signal_value(&signal.signal, frame.bytes, frame.n_bytes, &value)) {
            return false;
        }
        const bool is_known = !signal.has_absent || bits != signal.absent;
        values_[k] = {is_known, value, frame.stamp_us};
        links_.counts->add(GPOM_WIRE_CAN_BAD_VALUE, is_known ? 0 : 1);
    }
    return true;
}

/// Add an odometry sample if both signals are known and have the same time.
void CanPort::note_motion(std::int64_t stamp_us)
{
    const CanConfig &can = config_->can;
    for (const Value &value : values_) {
        const std::int64_t age_us = stamp_us - value.stamp_us;
        if (!value.is_known || age_us > can.odometry.timeout_us || age_us < 0) {
            return;
        }
    }
    const double a = values_[0].value, b = values_[1].value;
    const double speed_mps = can.is_wheels ? 0.5 * (a + b) : a;
    const double yaw_rate_radps = can.is_wheels ? (b - a) / can.track_m : b;
    const Motion motion = {stamp_us - can.latency_us, speed_mps, yaw_rate_radps};
    if (!Odometry::is_sane(motion)) {
        links_.counts->add(GPOM_WIRE_CAN_BAD_VALUE);
    } else if (!links_.odometry->push(motion)) {
        links_.counts->add(GPOM_WIRE_CAN_REORDERED);
    } else {
        motion_us_ = monotonic_us();
        if (is_silent_) {
            tell(News::heard);
        }
        is_silent_ = false;
    }
}

void CanPort::note_silence(std::int64_t now_us)
{
    const bool is_late = now_us - motion_us_ > config_->can.odometry.timeout_us;
    if (config_->can.has_odometry && !is_silent_ && is_late) {
        is_silent_ = true;
        links_.counts->add(GPOM_WIRE_ODOMETRY_GAPS);
        tell(News::silent);
    }
}

bool CanPort::has_come(Turn &turn, std::int64_t period_us, std::int64_t now_us) const
{
    if (period_us == 0 || now_us < turn.next_us) {
        return false;
    }
    turn.next_us = std::max(turn.next_us + period_us, now_us + period_us / 2);
    return true;
}

void CanPort::send_due(std::int64_t now_us)
{
    const CanConfig &can = config_->can;
    picture_.look(now_us);
    const bool is_status_due = has_come(status_, can.status.period_us, now_us);
    const bool is_clearance_due = has_come(clearance_, can.clearance.period_us, now_us);
    const bool is_fd_due = has_come(clearance_fd_, can.clearance_fd.period_us, now_us);
    const bool is_tile_due = has_come(tile_, can.tile.period_us, now_us);
    if (!is_status_due && !is_clearance_due && !is_fd_due && !is_tile_due) {
        return;
    }
    picture_.take({is_bus_off_, can.has_odometry && is_silent_, false});
    if (is_status_due) {
        send_status();
    }
    if (is_clearance_due) {
        send_clearance();
    }
    if (is_fd_due) {
        send_clearance_fd();
    }
    if (is_tile_due) {
        send_tiles();
    }
}

/// Send a last status, so that receivers need not wait for their time-outs.
void CanPort::send_stopping()
{
    picture_.take({is_bus_off_, false, true});
    if (config_->can.status.period_us > 0) {
        send_status();
    }
    if (config_->can.clearance.period_us > 0) {
        send_clearance();
    }
    if (config_->can.clearance_fd.period_us > 0) {
        send_clearance_fd();
    }
}

void CanPort::send_status()
{
    std::uint8_t bytes[GPOM_CAN_CLASSIC_BYTES];
    gpom_can_status_t message = picture_.status();
    message.alive = status_.alive = gpom_can_alive_next(status_.alive);
    gpom_can_status_pack(&message, bytes);
    send(config_->can.status, bytes, sizeof bytes);
}

void CanPort::send_clearance()
{
    ++clearance_.sequence;
    for (std::uint8_t i_part = 0; i_part < GPOM_CAN_CLEARANCE_FRAMES; ++i_part) {
        std::uint8_t bytes[GPOM_CAN_CLASSIC_BYTES];
        gpom_can_clearance_t message = picture_.clearance(i_part);
        message.alive = clearance_.alive = gpom_can_alive_next(clearance_.alive);
        message.sequence = clearance_.sequence;
        gpom_can_clearance_pack(&message, bytes);
        send(config_->can.clearance, bytes, sizeof bytes);
    }
}

void CanPort::send_clearance_fd()
{
    std::uint8_t bytes[GPOM_CAN_FD_BYTES];
    gpom_can_clearance_fd_t message = picture_.clearance_fd();
    message.alive = clearance_fd_.alive = gpom_can_alive_next(clearance_fd_.alive);
    message.sequence = ++clearance_fd_.sequence;
    gpom_can_clearance_fd_pack(&message, bytes);
    send(config_->can.clearance_fd, bytes, sizeof bytes);
}

/// Send the tiles around the robot's tile. Sends none if the robot's place is not known.
void CanPort::send_tiles()
{
    ++tile_.sequence;
    const std::int32_t n_beside = config_->can.tiles_beside;
    for (std::int32_t ty = -n_beside; ty <= n_beside; ++ty) {
        for (std::int32_t tx = -n_beside; tx <= n_beside; ++tx) {
            std::uint8_t bytes[GPOM_CAN_FD_BYTES];
            gpom_can_tile_t message = {};
            if (!picture_.tile(tx, ty, message)) {
                return;
            }
            message.alive = tile_.alive = gpom_can_alive_next(tile_.alive);
            message.sequence = tile_.sequence;
            message.n_tiles = static_cast<std::uint8_t>((2 * n_beside + 1) * (2 * n_beside + 1));
            gpom_can_tile_pack(&message, bytes);
            send(config_->can.tile, bytes, sizeof bytes);
        }
    }
}

/// Send a message, or count it as not sent. After a full queue nothing is sent for a while.
void CanPort::send(const CanSendConfig &to, const std::uint8_t *bytes, std::size_t n_bytes)
{
    const std::int64_t now_us = monotonic_us();
    const CanWrite result =
        now_us < write_next_us_ ? CanWrite::failed : bus_.write(to.id, bytes, n_bytes);
    if (result == CanWrite::full) {
        back_off_us_ = std::clamp(2 * back_off_us_, kBackOffMin_us, kBackOffMax_us);
        write_next_us_ = now_us + back_off_us_;
    }
    if (result == CanWrite::down) {
        note_down();
    }
    if (result == CanWrite::sent) {
        back_off_us_ = 0;
        note_up(wall_us());
    }
    links_.counts->add(result == CanWrite::sent ? GPOM_WIRE_CAN_SENT : GPOM_WIRE_CAN_NOT_SENT);
}

} // namespace gpomd
