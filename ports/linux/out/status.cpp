#include "ports/linux/out/status.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>

namespace gpomd
{

StatusSender::StatusSender(const Config &config, Sender &sender, MapThread &mapping, Counts &counts,
                           Problems &problems)
    : config_(config), sender_(sender), mapping_(mapping), counts_(counts), problems_(problems),
      started_us_(monotonic_us()), last_us_(started_us_)
{
}

void StatusSender::send(bool is_stopping)
{
    const std::int64_t now_us = monotonic_us();
    const std::int64_t span_us = std::max<std::int64_t>(now_us - last_us_, 1);
    const std::int64_t n_inserted = counts_[GPOM_WIRE_SCANS_INSERTED];
    // Read after the counts: the state contains all scans counted.
    const MapState state = mapping_.state(true);
    gpom_lowres_info_t info = {};
    if (gpom_lowres_info(mapping_.map(), GPOM_LAYER_COARSE, &info) == GPOM_OK) {
        n_dirty_ = info.n_dirty;
    }
    gpom_wire_status_t status = {};
    status.stamp_us = wall_us();
    status.sequence = sequence_++;
    status.state = static_cast<std::uint8_t>(is_stopping ? GPOM_WIRE_STATE_STOPPING
                                                         : state_of(state, n_inserted));
    status.version = static_cast<std::int32_t>(gpom_version());
    status.map_format = GPOM_MAP_FORMAT;
    status.frame_epoch = static_cast<std::int32_t>(state.frame_epoch);
    status.uptime_us = now_us - started_us_;
    status.scan_stamp_us = state.stamp_us;
    status.scan_lag_us = state.lag_us;
    status.scan_lag_us_max = state.lag_us_max;
    status.scan_rate_hz = rate_of(GPOM_WIRE_SCANS_INSERTED, span_us);
    status.pose_rate_hz = rate_of(GPOM_WIRE_POSES_RECEIVED, span_us);
    status.map_rate_hz = rate_of(GPOM_WIRE_MAPS_PUBLISHED, span_us);
    status.query_rate_hz = rate_of(GPOM_WIRE_QUERIES_ANSWERED, span_us);
    status.n_beams = static_cast<std::int32_t>(state.n_beams);
    status.beam_max = static_cast<std::int32_t>(config_.map.beam_max);
    status.n_cells_dirty = static_cast<std::int32_t>(n_dirty_);
    status.map_bytes = static_cast<std::int64_t>(gpom_map_bytes(&config_.map));
    status.process_bytes = resident_bytes();
    for (std::size_t i = 0; i < GPOM_WIRE_COUNTS; ++i) {
        status.counts[i] = last_counts_[i] = counts_[i];
    }
    status.counts[GPOM_WIRE_SCANS_INSERTED] = n_inserted;
    gpom_wire_count_beams(&state.stats, status.counts);
    status.counts[GPOM_WIRE_PROBLEMS] = problems_.bits();
    last_us_ = now_us;
    std::uint8_t bytes[GPOM_WIRE_STATUS_BYTES];
    const std::size_t n_bytes = gpom_wire_status_encode(&status, bytes, sizeof bytes);
    sender_.send(config_.publish.status, bytes, n_bytes);
}

/// Increase of a counter since the last status, per second.
float StatusSender::rate_of(std::size_t place, std::int64_t span_us)
{
    const std::int64_t n = counts_[place] - last_counts_[place];
    return static_cast<float>(1e6 * static_cast<double>(n) / static_cast<double>(span_us));
}

gpom_wire_state_t StatusSender::state_of(const MapState &state, std::int64_t n_inserted) const
{
    if (n_inserted == 0) {
        return GPOM_WIRE_STATE_STARTING;
    }
    const bool is_stale = monotonic_us() - state.fresh_us > config_.publish.stale_after_us;
    return is_stale ? GPOM_WIRE_STATE_STALE : GPOM_WIRE_STATE_MAPPING;
}

} // namespace gpomd
