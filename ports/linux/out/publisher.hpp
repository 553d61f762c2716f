// Sends the map as messages: gpom's tiles, and the grids of other message families.
#ifndef GPOM_LINUX_PUBLISHER_HPP
#define GPOM_LINUX_PUBLISHER_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/lcm/sender.hpp"
#include "ports/linux/map/mapping.hpp"
#include "ports/linux/out/distance_tiles.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// A thread that copies the low-resolution map while the mapping thread changes it, and sends the
/// copy.
class Publisher {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, Sender &sender, MapThread &mapping,
              Counts &counts);

    /// Work until `stop`. Then send a last keyframe, as far as the network takes it at once.
    void run(const std::atomic<bool> &stop);
    /// Send a keyframe at the next turn, but at least a second after the last requested keyframe.
    void request_keyframe();
    /// Check `stop` now.
    void wake();
    /// Increases as long as the thread runs.
    std::uint64_t pulse() const { return pulse_.load(std::memory_order_relaxed); }

private:
    bool send(const char *channel, std::size_t n_bytes);
    static bool goes_on(void *publisher);
    bool copy();
    bool take_request(std::int64_t now_us);
    bool may_begin_epoch(std::int64_t now_us);
    void send_map(bool is_keyframe);
    void note_raster();
    void encode_tile(std::uint32_t i_tile);
    bool has_changed(std::uint32_t i_tile) const;
    std::uint32_t tile_of_robot() const;
    bool send_tile(std::uint32_t i_tile, std::uint16_t i_sent, std::uint16_t n_sent,
                   bool is_keyframe);
    void send_distances(bool is_keyframe);
    void send_grid();
    void send_pixels();

    const Config *config_ = nullptr;
    Sender *sender_ = nullptr; ///< Used by this thread only.
    MapThread *mapping_ = nullptr;
    Counts *counts_ = nullptr;

    std::uint32_t n_cells_ = 0, n_tiles_x_ = 0, n_tiles_ = 0;
    gpom_cell_t *cells_ = nullptr; ///< The copy of the map, by rows.
    std::uint8_t *codes_ =
        nullptr;                   ///< The copy's codes, tile by tile: probabilities, then classes.
    std::uint8_t *sent_ = nullptr; ///< The codes that subscribers have, in the same order.
    std::uint8_t *message_ = nullptr;
    std::size_t message_bytes_ = 0;

    DistanceTiles distances_;
    gpom_lowres_info_t info_ = {};
    MapState state_ = {};
    gpom_lowres_info_t sent_info_ = {};
    std::int64_t sent_stamp_us_ = 0;
    bool has_sent_ = false;
    std::int64_t request_due_us_ = 0, epoch_due_us_ = 0; ///< No whole map for a request, or for a
                                                         ///< new epoch, before this time.
    std::uint32_t map_sequence_ = 0;

    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_requested_ = false; ///< Guarded by mutex_.
    bool is_woken_ = false;     ///< Guarded by mutex_.
    std::atomic<std::uint64_t> pulse_{0};
    const std::atomic<bool> *stop_ = nullptr;
    std::int64_t end_us_ = 0; ///< When the last message is given up. Monotonic, 0: not stopping.
};

} // namespace gpomd

#endif
