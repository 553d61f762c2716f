// Configuration of gpomd, read from its file.
#ifndef GPOM_LINUX_CONFIG_HPP
#define GPOM_LINUX_CONFIG_HPP

#include "gpom/gpom.h"
#include "ports/codec/codec.h"
#include "ports/linux/config/can_config.hpp"
#include "ports/linux/config/mavlink_config.hpp"
#include "ports/linux/pose/frame_jump.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

constexpr std::size_t kSensorsMax = 8;
constexpr std::size_t kMasksMax = 16;
constexpr std::size_t kPathMax = 512;

/// Cells of a tile: 650, at most GPOM_WIRE_MAP_CELLS_MAX.
constexpr std::uint32_t kTileNx = 26;
constexpr std::uint32_t kTileNy = 25;
constexpr std::uint32_t kTileCells = kTileNx * kTileNy;
static_assert(kTileCells <= GPOM_WIRE_MAP_CELLS_MAX, "a tile must fit a datagram");
/// Cells along the sides of a tile of distances.
constexpr std::uint32_t kDistanceTileNx = 16;
constexpr std::uint32_t kDistanceTileNy = 10;
constexpr std::uint32_t kDistanceTileCells = kDistanceTileNx * kDistanceTileNy;
static_assert(kDistanceTileCells <= GPOM_WIRE_DISTANCES_CELLS_MAX, "a tile must fit a datagram");
constexpr std::uint32_t distance_tile_count(const gpom_config_t &map)
{
    return (map.lowres_nx + kDistanceTileNx - 1) / kDistanceTileNx *
           ((map.lowres_ny + kDistanceTileNy - 1) / kDistanceTileNy);
}
/// The number of tiles is an int16 in the message.
constexpr std::uint32_t kTilesMax = 32767;

using ChannelName = char[GPOM_WIRE_CHANNEL_MAX + 1];

enum class ScanType : std::uint8_t { gpom_scan, planar_lidar, lidar };
enum class PoseType : std::uint8_t { bot_pose, pose2d };

/// A sensor: where its scans come from and where it is mounted.
struct SensorConfig {
    ChannelName channel;
    ScanType type;
    std::uint16_t id;        ///< sensor_id of gpom.scan_t. Other types: 0.
    std::int64_t latency_us; ///< Subtracted from every stamp.
    std::int64_t gap_max_us; ///< Types without sequence number: a longer silence counts as a gap.
    bool ignores_no_return;  ///< Readings at or above the maximum are failures, not free space.
    gpom_sensor_t sensor;    ///< Its masks point to `masks` below.
    gpom_mask_t masks[kMasksMax];
};

/// Poses for scans that carry no pose.
struct PoseConfig {
    ChannelName channel; ///< Empty: there is no pose channel.
    PoseType type;
    float cov[9];             ///< Covariance of every pose, by rows.
    std::int64_t gap_max_us;  ///< Poses further apart are not interpolated.
    std::int64_t wait_max_us; ///< A scan is dropped if its pose has not come after this time.
    std::int64_t hold_max_us; ///< The last pose holds for this time while no pose comes. 0: it does
                              ///< not hold.
};

/// Where the map is sent, and how often.
struct PublishConfig {
    ChannelName map, request, status, query, answer; ///< Channels of gpom's own types.
    ChannelName grid;                                ///< Channel of mbot's grid. Empty: it is not
                                                     ///< sent.
    ChannelName pixels;                              ///< Channel of libbot's pixel map. Empty: it
                                                     ///< is not sent.
    ChannelName distances;                           ///< Channel of distances. Empty: they are not
                                                     ///< computed.
    std::int64_t distances_period_us;                ///< Period of changed tiles of distances.
    std::int64_t map_period_us;                      ///< Period of changed tiles.
    std::int64_t keyframe_period_us;                 ///< Period of all tiles.
    std::int64_t grid_period_us;                     ///< Period of grid and pixels.
    std::int64_t status_period_us;
    std::int64_t stale_after_us; ///< After this time without a scan the state is STALE.
    bool is_query_crc_optional;  ///< Queries whose crc32 is 0 are answered, too.
};

/// Which scans are accepted.
struct IntakeConfig {
    std::uint32_t ranges_max;  ///< Most ranges of a scan.
    std::uint32_t queue_scans; ///< Scans that may wait, for a pose or for the map.
    std::int64_t ahead_max_us; ///< Stamps further ahead of the clock are refused.
    std::int64_t age_max_us;   ///< Older scans are refused. 0: any age is accepted.
};

struct Config {
    char lcm_url[256];
    gpom_config_t map; ///< With hyperparameters and low-resolution map.
    float late_m;      ///< Of gpom_map_begin_late(). 0: no beam begins late.
    std::uint64_t
        step_ops; ///< Budget of gpom_map_step() after each scan, and of a slice when idle.
    std::size_t n_sensors;
    SensorConfig sensors[kSensorsMax];
    PoseConfig pose;
    JumpConfig jump;
    IntakeConfig intake;
    PublishConfig publish;
    char snapshot_path[kPathMax]; ///< Empty: no snapshots.
    std::int64_t snapshot_period_us;
    CanConfig can;
    MavlinkConfig mavlink;
};

/// Read and check a file. Paths in the file are relative to it. `config` must not move, because
/// sensors point to their masks. Throws gpom_tools::FileError, which names file, line and key.
void read_config(const char *path, Config &config);

} // namespace gpomd

#endif
