// Sends distances to obstacles as messages, tile by tile.
#ifndef GPOM_LINUX_DISTANCE_TILES_HPP
#define GPOM_LINUX_DISTANCE_TILES_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/map/mapping.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// Sends a message on publish.distances. False: it was not sent.
struct DistanceChannel {
    bool (*send)(void *ctx, const std::uint8_t *bytes, std::size_t n_bytes);
    void *ctx;
};

/// The field of distances (gpom/distances.h), and the tiles that subscribers have. Used by one
/// thread, beside the mapping thread. Without publish.distances it takes no memory and does
/// nothing.
class DistanceTiles {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, const MapThread &mapping);

    /// Make all distances exact. Send all tiles, or those that changed.
    void send(const MapState &state, bool is_keyframe, const DistanceChannel &channel);

private:
    bool keep_up();
    std::uint32_t encode_tile(std::uint32_t i_tile);
    bool send_tile(const MapState &state, std::uint32_t i_tile, const DistanceChannel &channel);

    const MapThread *mapping_ = nullptr;
    gpom_distances_t *field_ = nullptr;
    std::uint8_t *field_memory_ = nullptr;
    std::size_t field_bytes_ = 0;
    std::uint8_t *offsets_ = nullptr; ///< The codes of one tile: four arrays.
    std::uint8_t *message_ = nullptr;
    std::uint32_t *sent_crc_ = nullptr; ///< CRC-32 of the codes that subscribers have, by tile.
    std::uint32_t *crc_ = nullptr;      ///< The same of the present codes.
    std::uint32_t n_tiles_x_ = 0, n_tiles_ = 0;
    gpom_distances_info_t info_ = {}, sent_info_ = {};
    std::uint32_t sequence_ = 0;
    std::uint16_t i_sent_ = 0, n_sent_ = 0;
    bool is_whole_ = false, has_sent_ = false;
};

} // namespace gpomd

#endif
