#include "ports/linux/base/log.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <iterator>

namespace gpomd
{

void Log::tell(const char *text)
{
    tell_lost();
    if (n_lost_ > 0 || !write_line(text)) {
        ++n_lost_;
    }
}

void Log::tell_lost()
{
    char text[64] = "log lines lost: ";
    std::to_chars(text + std::strlen(text), std::end(text) - 1, n_lost_);
    if (n_lost_ > 0 && write_line(text)) {
        n_lost_ = 0;
    }
}

/// Write one line if poll() says that there is room. A pipe with room takes PIPE_BUF bytes in one
/// write. O_NONBLOCK is not used, because it would change all processes that share standard output.
bool Log::write_line(const char *text)
{
    constexpr char kBegin[] = "gpomd: ";
    constexpr std::size_t n_begin = sizeof kBegin - 1;
    const std::size_t n_text = std::min(std::strlen(text), sizeof line_ - n_begin - 1);
    std::memcpy(line_, kBegin, n_begin);
    std::memcpy(line_ + n_begin, text, n_text);
    line_[n_begin + n_text] = '\n';
    const std::size_t n_line = n_begin + n_text + 1;
    pollfd room = {fd_, POLLOUT, 0};
    return poll(&room, 1, 0) > 0 && (room.revents & POLLOUT) != 0 &&
           write(fd_, line_, n_line) == static_cast<ssize_t>(n_line);
}

} // namespace gpomd
