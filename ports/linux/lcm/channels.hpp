// Watches the channels that gpomd listens to and notes when one is silent. Remembers other channels
// of scans and poses, to suggest them.
#ifndef GPOM_LINUX_CHANNELS_HPP
#define GPOM_LINUX_CHANNELS_HPP

#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// Used by one thread.
class Channels {
public:
    /// `now_us` is monotonic, in all functions of this class.
    void init(const Config &config, Problems &problems, std::int64_t now_us);

    /// A message came, on any channel.
    void take(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes,
              std::int64_t now_us);

    /// Look for channels that are silent.
    void check(std::int64_t now_us);

private:
    /// A channel that gpomd listens to. i_sensor is kSensorsMax for the pose channel.
    struct Listened {
        const char *channel;
        std::size_t i_sensor;
        std::int64_t heard_us; ///< When the last message came, or gpomd began to listen.
    };
    /// A channel of scans or poses that gpomd does not listen to.
    struct Other {
        ChannelName channel;
        std::uint64_t type;
        std::int64_t heard_us;
    };

    void listen(const char *channel, std::size_t i_sensor, std::int64_t now_us);
    const Other *like(bool is_poses, std::int64_t now_us) const;

    static constexpr std::size_t kOthers = 8;

    const Config *config_ = nullptr;
    Problems *problems_ = nullptr;
    Listened listened_[kSensorsMax + 1] = {};
    std::size_t n_listened_ = 0;
    Other others_[kOthers] = {};
    std::int64_t checked_us_ = 0;
};

} // namespace gpomd

#endif
