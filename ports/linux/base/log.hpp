// Writes lines to the daemon's standard output. Its reader may be slow, hang or go away.
#ifndef GPOM_LINUX_LOG_HPP
#define GPOM_LINUX_LOG_HPP

#include <climits>

namespace gpomd
{

/// Used by one thread, and never makes that thread wait. A line for which there is no room is lost.
/// The log reports how many lines were lost when there is room again.
class Log {
public:
    explicit Log(int fd) : fd_(fd) {}

    /// Write "gpomd: TEXT". Bytes beyond PIPE_BUF are cut off.
    void tell(const char *text);
    /// Report how many lines were lost, if any were lost and there is room now.
    void tell_lost();

private:
    bool write_line(const char *text);

    int fd_;
    unsigned long long n_lost_ = 0; ///< Lines lost since the last line that was written.
    char line_[PIPE_BUF] = {};
};

} // namespace gpomd

#endif
