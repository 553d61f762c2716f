// Lines for whoever reads the daemon's standard output, who may be slow, hang or go away.
#ifndef GPOM_LINUX_LOG_HPP
#define GPOM_LINUX_LOG_HPP

#include <climits>

namespace gpomd
{

/// Used by one thread. That never waits: a line for which there is no room is lost, and counted in
/// the log when there is room again.
class Log {
public:
    explicit Log(int fd) : fd_(fd) {}

    /// "gpomd: TEXT"; what goes beyond PIPE_BUF bytes is cut off.
    void tell(const char *text);
    /// Tell of lines that were lost, if there are any and there is room now.
    void tell_lost();

private:
    bool write_line(const char *text);

    int fd_;
    unsigned long long n_lost_ = 0; ///< Since the last line that was told.
    char line_[PIPE_BUF] = {};
};

} // namespace gpomd

#endif
