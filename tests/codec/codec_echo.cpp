// Decodes messages with the codec and encodes them again, for peers in other languages.
//
// codec-echo                     stdin to stdout, each message with its length (u32, big-endian) in
//                                front; length 0 for a message that was refused
// codec-echo GROUP PORT CHANNEL  LCM over UDP multicast by the codec's own receiver and datagrams:
//                                messages of CHANNEL come back on CHANNEL_BACK, fragments and all
#include "tests/codec/types.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>

namespace
{

constexpr std::uint32_t kMessageMax = 1u << 20;
constexpr std::uint32_t kFragmentsMax = 1000;
constexpr std::int64_t kTimeoutUs = 1000000;

Reencoded reencode(const Bytes &message)
{
    const Type *const type = type_of(message);
    return type != nullptr ? type->reencode(message.data(), message.size())
                           : Reencoded{GPOM_WIRE_TYPE, {}};
}

int echo_stdin()
{
    std::uint8_t length[4];
    while (std::cin.read(reinterpret_cast<char *>(length), sizeof length)) {
        Bytes message((length[0] << 24) | (length[1] << 16) | (length[2] << 8) | length[3]);
        std::cin.read(reinterpret_cast<char *>(message.data()),
                      static_cast<std::streamsize>(message.size()));
        const Bytes again = reencode(message).bytes;
        Bytes out;
        append(out, again.size(), 4);
        out.insert(out.end(), again.begin(), again.end());
        std::cout.write(reinterpret_cast<const char *>(out.data()),
                        static_cast<std::streamsize>(out.size()));
    }
    return 0;
}

[[noreturn]] void die(const char *what)
{
    std::perror(what);
    std::exit(2);
}

/// A socket that hears the group, and its address to send to.
int join(const char *group, const char *port, sockaddr_in &address)
{
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    const int on = 1;
    const int buffer_bytes = 4 << 20;
    address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::atoi(port)));
    if (fd < 0 || inet_pton(AF_INET, group, &address.sin_addr) != 1) {
        die("codec-echo: socket or group address");
    }
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
    if (bind(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0) {
        die("codec-echo: bind");
    }
    ip_mreq membership = {};
    membership.imr_multiaddr = address.sin_addr;
    if (setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
        die("codec-echo: joining the group");
    }
    return fd;
}

/// In one datagram if it fits, else in fragments of the same size.
std::vector<Bytes> datagrams_of(const Bytes &message, const std::string &channel,
                                std::uint32_t sequence)
{
    Bytes bytes(GPOM_WIRE_DATAGRAM_BYTES);
    const std::size_t n =
        gpom_wire_datagram_begin(bytes.data(), bytes.size(), channel.c_str(), sequence);
    if (n + message.size() <= bytes.size()) {
        bytes.resize(n);
        bytes.insert(bytes.end(), message.begin(), message.end());
        return {bytes};
    }
    const gpom_wire_outgoing_t out = {channel.c_str(), message.data(),
                                      static_cast<std::uint32_t>(message.size()), sequence,
                                      GPOM_WIRE_DATAGRAM_BYTES};
    std::vector<Bytes> datagrams;
    for (std::uint32_t i = 0; i < gpom_wire_fragment_count(&out); ++i) {
        bytes.resize(GPOM_WIRE_DATAGRAM_BYTES);
        bytes.resize(gpom_wire_fragment_write(&out, i, bytes.data(), bytes.size()));
        datagrams.push_back(bytes);
    }
    return datagrams;
}

int echo_udp(const char *group, const char *port, const std::string &channel)
{
    sockaddr_in address;
    const int fd = join(group, port, address);
    std::vector<std::uint64_t> memory(GPOM_WIRE_RECEIVER_BYTES(4, kMessageMax, kFragmentsMax) / 8);
    const gpom_wire_receiver_config_t config = {4, kMessageMax, kFragmentsMax, kTimeoutUs};
    gpom_wire_receiver_t receiver;
    if (gpom_wire_receiver_init(&receiver, &config, memory.data(), memory.size() * 8) != GPOM_OK) {
        return 2;
    }
    std::puts("ready");
    std::fflush(stdout);
    Bytes datagram(65536);
    for (std::uint32_t sequence = 0;;) {
        sockaddr_in from = {};
        socklen_t from_bytes = sizeof from;
        const ssize_t n = recvfrom(fd, datagram.data(), datagram.size(), 0,
                                   reinterpret_cast<sockaddr *>(&from), &from_bytes);
        timespec now = {};
        clock_gettime(CLOCK_MONOTONIC, &now);
        const gpom_wire_arrival_t arrival = {
            datagram.data(), static_cast<std::size_t>(n < 0 ? 0 : n),
            std::uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port,
            std::int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000};
        gpom_wire_message_t message;
        if (!gpom_wire_receive(&receiver, &arrival, &message) || channel != message.channel) {
            continue;
        }
        const Bytes payload(message.payload, message.payload + message.payload_bytes);
        for (const Bytes &out :
             datagrams_of(reencode(payload).bytes, channel + "_BACK", sequence)) {
            if (sendto(fd, out.data(), out.size(), 0, reinterpret_cast<const sockaddr *>(&address),
                       sizeof address) < 0) {
                die("codec-echo: sendto");
            }
        }
        ++sequence;
    }
}

} // namespace

int main(int argc, char **argv)
{
    if (argc == 4) {
        return echo_udp(argv[1], argv[2], argv[3]);
    }
    return argc == 1 ? echo_stdin() : 2;
}
