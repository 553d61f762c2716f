// LCM event logs, as lcm-logger writes them. liblcm's reader of them ends the program at some that
// are damaged.
#ifndef GPOM_PORTS_HOST_LCM_LOG_HPP
#define GPOM_PORTS_HOST_LCM_LOG_HPP

#include <cstdint>
#include <fstream>
#include <string>

namespace gpom_tools
{

/// A message of a log.
struct LcmEvent {
    std::int64_t stamp_us; ///< When it was recorded, since the Unix epoch.
    std::string channel;
    std::string bytes;
};

/// Does a file begin as an event log does?
bool is_lcm_log(const std::string &path);

/// Reads the events of a file in their order.
class LcmLog {
public:
    /// Throws FileError if the file cannot be opened.
    explicit LcmLog(const std::string &path);

    /// The next event. False: there is none that is whole.
    bool next(LcmEvent &event);
    /// Bytes of the events read so far.
    std::uint64_t n_bytes() const { return n_bytes_; }
    /// After next() said false: is anything left in the file?
    bool is_cut() const { return n_bytes_ != file_bytes_; }

private:
    std::ifstream file_;
    std::uint64_t file_bytes_ = 0;
    std::uint64_t n_bytes_ = 0;
};

} // namespace gpom_tools

#endif
