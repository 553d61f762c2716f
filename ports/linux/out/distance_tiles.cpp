#include "ports/linux/out/distance_tiles.hpp"

#include "gpom/crc32.h"
#include "ports/codec/codec.h"

#include <algorithm>

namespace gpomd
{

namespace
{

constexpr std::size_t kOffsetBytes = 2;
constexpr std::size_t kArrays = 4;
constexpr std::size_t kArrayBytes = kOffsetBytes * kDistanceTileCells;

std::uint32_t ceil_div(std::uint32_t a, std::uint32_t b) { return (a + b - 1) / b; }

} // namespace

std::size_t DistanceTiles::need(const Config &config)
{
    if (config.publish.distances[0] == '\0') {
        return 0;
    }
    const std::size_t n_tiles = distance_tile_count(config.map);
    return Memory::need<std::uint8_t>(
               GPOM_DISTANCES_BYTES(config.map.lowres_nx, config.map.lowres_ny)) +
           Memory::need<std::uint8_t>(kArrays * kArrayBytes) +
           Memory::need<std::uint8_t>(GPOM_WIRE_DISTANCES_BYTES(kDistanceTileCells)) +
           2 * Memory::need<std::uint32_t>(n_tiles);
}

void DistanceTiles::init(const Config &config, Memory &memory, const MapThread &mapping)
{
    if (config.publish.distances[0] == '\0') {
        return;
    }
    mapping_ = &mapping;
    n_tiles_x_ = ceil_div(config.map.lowres_nx, kDistanceTileNx);
    n_tiles_ = distance_tile_count(config.map);
    field_bytes_ = GPOM_DISTANCES_BYTES(config.map.lowres_nx, config.map.lowres_ny);
    field_memory_ = memory.take<std::uint8_t>(field_bytes_);
    offsets_ = memory.take<std::uint8_t>(kArrays * kArrayBytes);
    message_ = memory.take<std::uint8_t>(GPOM_WIRE_DISTANCES_BYTES(kDistanceTileCells));
    sent_crc_ = memory.take<std::uint32_t>(n_tiles_);
    crc_ = memory.take<std::uint32_t>(n_tiles_);
}

/// False: there is no map yet, or its raster kept moving.
bool DistanceTiles::keep_up()
{
    const gpom_map_t *const map = mapping_->map();
    if (field_ == nullptr &&
        gpom_distances_init(&field_, map, field_memory_, field_bytes_) != GPOM_OK) {
        return false;
    }
    return gpom_distances_step(field_, map, UINT64_MAX, nullptr) == GPOM_OK &&
           gpom_distances_info(field_, &info_) == GPOM_OK && info_.n_left == 0;
}

/// Write the codes of a tile. Returns their CRC-32.
std::uint32_t DistanceTiles::encode_tile(std::uint32_t i_tile)
{
    const std::uint32_t ix0 = i_tile % n_tiles_x_ * kDistanceTileNx;
    const std::uint32_t iy0 = i_tile / n_tiles_x_ * kDistanceTileNy;
    const std::uint32_t nx = std::min(kDistanceTileNx, info_.raster.nx - ix0);
    const std::uint32_t ny = std::min(kDistanceTileNy, info_.raster.ny - iy0);
    std::fill_n(offsets_, kArrays * kArrayBytes, std::uint8_t{0});
    for (std::uint32_t i = 0; i < nx * ny; ++i) {
        gpom_offsets_t cell = {};
        (void)!gpom_distances_cell(field_, ix0 + i % nx, iy0 + i / nx,
                                   &cell); // it is in the raster
        gpom_wire_offset_put(offsets_, i, cell.occupied_dx);
        gpom_wire_offset_put(offsets_ + kArrayBytes, i, cell.occupied_dy);
        gpom_wire_offset_put(offsets_ + 2 * kArrayBytes, i, cell.not_free_dx);
        gpom_wire_offset_put(offsets_ + 3 * kArrayBytes, i, cell.not_free_dy);
    }
    return gpom_crc32(offsets_, kArrays * kArrayBytes);
}

bool DistanceTiles::send_tile(const MapState &state, std::uint32_t i_tile,
                              const DistanceChannel &channel)
{
    const std::uint32_t ix0 = i_tile % n_tiles_x_ * kDistanceTileNx;
    const std::uint32_t iy0 = i_tile / n_tiles_x_ * kDistanceTileNy;
    const gpom_raster_t &raster = info_.raster;
    (void)encode_tile(i_tile);
    gpom_wire_distances_t tile = {};
    tile.stamp_us = state.stamp_us;
    tile.sequence = sequence_;
    tile.i_tile = i_sent_++;
    tile.n_tiles = n_sent_;
    tile.keyframe = is_whole_ ? 1 : 0;
    tile.frame_epoch = static_cast<std::int32_t>(info_.frame_epoch);
    tile.corner_m[0] = raster.x0_m + ix0 * raster.cell_m;
    tile.corner_m[1] = raster.y0_m + iy0 * raster.cell_m;
    tile.cell_m = static_cast<float>(raster.cell_m);
    tile.map_nx = static_cast<std::uint16_t>(raster.nx);
    tile.map_ny = static_cast<std::uint16_t>(raster.ny);
    tile.ix0 = static_cast<std::uint16_t>(ix0);
    tile.iy0 = static_cast<std::uint16_t>(iy0);
    tile.nx = static_cast<std::uint16_t>(std::min(kDistanceTileNx, raster.nx - ix0));
    tile.ny = static_cast<std::uint16_t>(std::min(kDistanceTileNy, raster.ny - iy0));
    tile.occupied_dx = offsets_;
    tile.occupied_dy = offsets_ + kArrayBytes;
    tile.not_free_dx = offsets_ + 2 * kArrayBytes;
    tile.not_free_dy = offsets_ + 3 * kArrayBytes;
    const std::size_t n_bytes =
        gpom_wire_distances_encode(&tile, message_, GPOM_WIRE_DISTANCES_BYTES(kDistanceTileCells));
    return n_bytes > 0 && channel.send(channel.ctx, message_, n_bytes);
}

void DistanceTiles::send(const MapState &state, bool is_keyframe, const DistanceChannel &channel)
{
    if (mapping_ == nullptr || !keep_up()) {
        return;
    }
    is_whole_ = is_keyframe || !has_sent_ || info_.frame_epoch != sent_info_.frame_epoch ||
                info_.raster.x0_m != sent_info_.raster.x0_m ||
                info_.raster.y0_m != sent_info_.raster.y0_m;
    n_sent_ = 0;
    for (std::uint32_t i = 0; i < n_tiles_; ++i) {
        crc_[i] = encode_tile(i);
        n_sent_ = static_cast<std::uint16_t>(n_sent_ + (is_whole_ || crc_[i] != sent_crc_[i]));
    }
    i_sent_ = 0;
    for (std::uint32_t i = 0; i < n_tiles_; ++i) {
        if ((is_whole_ || crc_[i] != sent_crc_[i]) && send_tile(state, i, channel)) {
            sent_crc_[i] = crc_[i];
            has_sent_ = true;
            sent_info_ = info_;
        }
    }
    sequence_ += n_sent_ > 0 ? 1u : 0u;
}

} // namespace gpomd
