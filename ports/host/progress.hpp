// A progress bar on one line of a terminal.
#ifndef GPOM_PORTS_HOST_PROGRESS_HPP
#define GPOM_PORTS_HOST_PROGRESS_HPP

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

namespace gpom_tools
{

/// Shown only if stderr is a terminal and the work takes over a second. Wiped at the end.
class Progress {
public:
    explicit Progress(std::string label)
        : label_(std::move(label)), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now())
    {
    }
    ~Progress()
    {
        if (percent_shown_ >= 0) {
            std::fputs("\r\033[K", stderr);
        }
    }
    Progress(const Progress &) = delete;
    Progress &operator=(const Progress &) = delete;

    void update(std::size_t n_done, std::size_t n_total)
    {
        const int percent = n_total > 0 ? static_cast<int>(100 * n_done / n_total) : 100;
        if (!terminal_ || percent == percent_shown_ ||
            Clock::now() - start_ < std::chrono::seconds(1)) {
            return;
        }
        percent_shown_ = percent;
        const std::string bar(static_cast<std::size_t>(percent * 40 / 100), '#');
        std::fprintf(stderr, "\r%s [%-40s] %3d %%", label_.c_str(), bar.c_str(), percent);
    }

private:
    using Clock = std::chrono::steady_clock;
    std::string label_;
    bool terminal_;
    Clock::time_point start_;
    int percent_shown_ = -1;
};

} // namespace gpom_tools

#endif
