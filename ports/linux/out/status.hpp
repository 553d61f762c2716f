// Builds gpom.status_t from the state of all threads.
#ifndef GPOM_LINUX_STATUS_HPP
#define GPOM_LINUX_STATUS_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/lcm/sender.hpp"
#include "ports/linux/map/mapping.hpp"

#include <cstdint>

namespace gpomd
{

/// Sends a status at each call of send(). Used by one thread.
class StatusSender {
public:
    StatusSender(const Config &config, Sender &sender, MapThread &mapping, Counts &counts,
                 Problems &problems);

    void send(bool is_stopping);

private:
    float rate_of(std::size_t place, std::int64_t span_us);
    gpom_wire_state_t state_of(const MapState &state, std::int64_t n_inserted) const;

    const Config &config_;
    Sender &sender_;
    MapThread &mapping_;
    Counts &counts_;
    Problems &problems_;
    std::int64_t started_us_;
    std::int64_t last_us_;
    std::int64_t last_counts_[GPOM_WIRE_COUNTS] = {};
    std::uint32_t n_dirty_ = 0; ///< The last known number. It cannot be read while the raster
                                ///< moves.
    std::uint32_t sequence_ = 0;
};

} // namespace gpomd

#endif
