#include "ports/host/lcm_log.hpp"

#include "ports/host/file_error.hpp"

#include <filesystem>

namespace gpom_tools
{

namespace
{

/// Every event begins with this number.
constexpr std::uint64_t kMagic = 0xeda1da01;
constexpr std::size_t kMagicBytes = 4;

/// Head of an event: magic, number, time, length of the channel's name, length of the message. The
/// name and the message follow.
constexpr std::size_t kHeadBytes = 28;
constexpr std::size_t kStampAt = 12, kChannelBytesAt = 20, kMessageBytesAt = 24;

std::uint64_t big_endian(const char *bytes, std::size_t n_bytes)
{
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < n_bytes; ++i) {
        value = value << 8 | static_cast<unsigned char>(bytes[i]);
    }
    return value;
}

} // namespace

bool is_lcm_log(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    char head[kMagicBytes] = {};
    file.read(head, sizeof head);
    return file && big_endian(head, sizeof head) == kMagic;
}

LcmLog::LcmLog(const std::string &path) : file_(path, std::ios::binary)
{
    std::error_code error;
    file_bytes_ = std::filesystem::file_size(path, error);
    if (!file_ || error) {
        throw FileError(path, 0, "cannot open; give the name of an LCM event log");
    }
}

bool LcmLog::next(LcmEvent &event)
{
    char head[kHeadBytes] = {};
    file_.read(head, sizeof head);
    const std::uint64_t n_channel = big_endian(head + kChannelBytesAt, 4);
    const std::uint64_t n_message = big_endian(head + kMessageBytesAt, 4);
    const std::uint64_t n_event = kHeadBytes + n_channel + n_message;
    if (!file_ || big_endian(head, kMagicBytes) != kMagic || n_event > file_bytes_ - n_bytes_) {
        return false;
    }
    event.stamp_us = static_cast<std::int64_t>(big_endian(head + kStampAt, 8));
    event.channel.resize(n_channel);
    event.bytes.resize(n_message);
    file_.read(event.channel.data(), static_cast<std::streamsize>(n_channel));
    file_.read(event.bytes.data(), static_cast<std::streamsize>(n_message));
    if (!file_) {
        return false;
    }
    n_bytes_ += n_event;
    return true;
}

} // namespace gpom_tools
