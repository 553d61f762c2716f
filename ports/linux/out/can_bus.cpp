#include "ports/linux/out/can_bus.hpp"

#include "ports/linux/base/clock.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace gpomd
{

namespace
{

/// The error frames that report trouble on the bus.
constexpr can_err_mask_t kErrors = CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL | CAN_ERR_PROT | CAN_ERR_TRX |
                                   CAN_ERR_ACK | CAN_ERR_BUSOFF | CAN_ERR_BUSERROR |
                                   CAN_ERR_RESTARTED;

template <class Type> bool set_option(int fd, int level, int name, const Type &value)
{
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

ifreq request_of(const CanConfig &config)
{
    ifreq request = {};
    std::memcpy(request.ifr_name, config.interface, sizeof request.ifr_name);
    return request;
}

/// Receive exactly these messages: no remote frames, and no identifiers of the other length.
bool set_filters(int fd, const CanConfig &config)
{
    can_filter filters[kCanMessagesMax] = {};
    for (std::size_t i = 0; i < config.n_messages; ++i) {
        const std::uint32_t id = config.messages[i].id;
        const canid_t mask = (id & CAN_EFF_FLAG) != 0 ? CAN_EFF_MASK : CAN_SFF_MASK;
        filters[i] = {id, mask | CAN_EFF_FLAG | CAN_RTR_FLAG};
    }
    return setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters,
                      static_cast<socklen_t>(config.n_messages * sizeof *filters)) == 0;
}

} // namespace

bool CanBus::open(const CanConfig &config)
{
    close();
    fd_ = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
    if (fd_ >= 0 && !set_up(config)) {
        close();
    }
    return is_open();
}

bool CanBus::set_up(const CanConfig &config)
{
    const int on = 1;
    ifreq request = request_of(config);
    if (!set_filters(fd_, config) || !set_option(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, kErrors) ||
        !set_option(fd_, SOL_SOCKET, SO_TIMESTAMP, on) ||
        !set_option(fd_, SOL_SOCKET, SO_RXQ_OVFL, on) || ioctl(fd_, SIOCGIFMTU, &request) != 0) {
        return false;
    }
    has_fd_ = config.has_fd && request.ifr_mtu >= static_cast<int>(CANFD_MTU) &&
              set_option(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on);
    const int n_bytes = static_cast<int>(config.receive_bytes);
    if (!set_option(fd_, SOL_SOCKET, SO_RCVBUFFORCE, n_bytes)) { // root may exceed rmem_max
        set_option(fd_, SOL_SOCKET, SO_RCVBUF, n_bytes);
    }
    request = request_of(config);
    if (ioctl(fd_, SIOCGIFINDEX, &request) != 0) {
        return false;
    }
    sockaddr_can address = {};
    address.can_family = AF_CAN;
    address.can_ifindex = request.ifr_ifindex;
    overflow_ = overflow_taken_ = 0;
    return bind(fd_, reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0;
}

void CanBus::close()
{
    if (fd_ >= 0) {
        ::close(fd_);
    }
    fd_ = -1;
}

CanRead CanBus::read(CanFrame &frame)
{
    canfd_frame raw = {};
    alignas(cmsghdr)
        std::uint8_t control[CMSG_SPACE(sizeof(timeval)) + CMSG_SPACE(sizeof(std::uint32_t))];
    iovec data = {&raw, sizeof raw};
    msghdr message = {};
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t n = recvmsg(fd_, &message, 0);
    if (n < 0) {
        if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) {
            return CanRead::none;
        }
        if (errno == ENETDOWN) {
            return CanRead::down;
        }
        close();
        return CanRead::gone;
    }
    frame.stamp_us = wall_us(); // used if the kernel gives no stamp
    for (cmsghdr *head = CMSG_FIRSTHDR(&message); head != nullptr;
         head = CMSG_NXTHDR(&message, head)) {
        if (head->cmsg_level == SOL_SOCKET && head->cmsg_type == SO_TIMESTAMP) {
            timeval time = {};
            std::memcpy(&time, CMSG_DATA(head), sizeof time);
            frame.stamp_us = std::int64_t{time.tv_sec} * 1000000 + time.tv_usec;
        } else if (head->cmsg_level == SOL_SOCKET && head->cmsg_type == SO_RXQ_OVFL) {
            std::memcpy(&overflow_, CMSG_DATA(head), sizeof overflow_);
        }
    }
    frame.id = raw.can_id;
    frame.n_bytes = std::min<std::size_t>(raw.len, n == CAN_MTU ? CAN_MAX_DLEN : CANFD_MAX_DLEN);
    std::memcpy(frame.bytes, raw.data, sizeof frame.bytes);
    return CanRead::frame;
}

CanWrite CanBus::write(std::uint32_t id, const std::uint8_t *bytes, std::size_t n_bytes)
{
    canfd_frame raw = {};
    raw.can_id = id;
    raw.len = static_cast<std::uint8_t>(n_bytes);
    const bool is_fd = n_bytes > CAN_MAX_DLEN;
    if (fd_ < 0 || n_bytes > sizeof raw.data || (is_fd && !has_fd_)) {
        return CanWrite::failed;
    }
    raw.flags = is_fd ? CANFD_BRS : 0;
    std::memcpy(raw.data, bytes, n_bytes);
    const std::size_t n = is_fd ? CANFD_MTU : CAN_MTU;
    if (::write(fd_, &raw, n) == static_cast<ssize_t>(n)) {
        return CanWrite::sent;
    }
    return errno == ENOBUFS || errno == EAGAIN ? CanWrite::full
           : errno == ENETDOWN                 ? CanWrite::down
                                               : CanWrite::failed;
}

std::uint32_t CanBus::take_overflow()
{
    const std::uint32_t n = overflow_ - overflow_taken_;
    overflow_taken_ = overflow_;
    return n;
}

} // namespace gpomd
