// Reads LCM event logs, as lcm-logger writes them. liblcm's own reader is not used, because it ends
// the program at some damaged logs.
#ifndef GPOM_PORTS_HOST_LCM_LOG_HPP
#define GPOM_PORTS_HOST_LCM_LOG_HPP

#include <cstdint>
#include <fstream>
#include <string>

namespace gpom_tools
{

/// A message of a log.
struct LcmEvent {
    std::int64_t stamp_us; ///< Time of recording, since the Unix epoch.
    std::string channel;
    std::string bytes;
};

/// True if a file begins like an event log.
bool is_lcm_log(const std::string &path);

/// Reads the events of a file in order.
class LcmLog {
public:
    /// Throws FileError if the file cannot be opened.
    explicit LcmLog(const std::string &path);

    /// Read the next event. False: there is no whole event left.
    bool next(LcmEvent &event);
    /// Bytes of the events read so far.
    std::uint64_t n_bytes() const { return n_bytes_; }
    /// After next() returned false: true if bytes are left in the file.
    bool is_cut() const { return n_bytes_ != file_bytes_; }

private:
    std::ifstream file_;
    std::uint64_t file_bytes_ = 0;
    std::uint64_t n_bytes_ = 0;
};

} // namespace gpom_tools

#endif
