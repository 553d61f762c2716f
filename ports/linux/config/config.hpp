// What gpomd is told by its configuration file.
#ifndef GPOM_LINUX_CONFIG_HPP
#define GPOM_LINUX_CONFIG_HPP

#include "gpom/gpom.h"
#include "ports/codec/codec.h"
#include "ports/linux/config/can_config.hpp"
#include "ports/linux/pose/frame_jump.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

constexpr std::size_t kSensorsMax = 8;
constexpr std::size_t kMasksMax = 16;
constexpr std::size_t kPathMax = 512;

/// Cells of a tile: 650 of at most GPOM_WIRE_MAP_CELLS_MAX.
constexpr std::uint32_t kTileNx = 26;
constexpr std::uint32_t kTileNy = 25;
constexpr std::uint32_t kTileCells = kTileNx * kTileNy;
static_assert(kTileCells <= GPOM_WIRE_MAP_CELLS_MAX, "a tile must fit a datagram");
/// The number of tiles is an int16 on the wire.
constexpr std::uint32_t kTilesMax = 32767;

using ChannelName = char[GPOM_WIRE_CHANNEL_MAX + 1];

enum class ScanType : std::uint8_t { gpom_scan, planar_lidar, lidar };
enum class PoseType : std::uint8_t { bot_pose, pose2d };

/// A sensor: where its scans come from and where it sits.
struct SensorConfig {
    ChannelName channel;
    ScanType type;
    std::uint16_t id;        ///< gpom.scan_t: the sender's number; else 0.
    std::int64_t latency_us; ///< Subtracted from every stamp.
    std::int64_t gap_max_us; ///< Types without sequence: a longer silence counts as a gap.
    bool ignores_no_return;  ///< Readings of the maximum or more are failures, not free space.
    gpom_sensor_t sensor;    ///< Its masks point to `masks` below.
    gpom_mask_t masks[kMasksMax];
};

/// Poses for scans that carry none.
struct PoseConfig {
    ChannelName channel; ///< Empty: there is none.
    PoseType type;
    float cov[9];             ///< Covariance given to every pose, by rows.
    std::int64_t gap_max_us;  ///< No interpolation over a longer gap.
    std::int64_t wait_max_us; ///< A scan whose pose has not come by then is dropped.
    std::int64_t hold_max_us; ///< While none comes, the last pose holds so long; 0: it does not.
};

/// Where the map goes, and how often.
struct PublishConfig {
    ChannelName map, request, status, query, answer; ///< Of gpom's own types.
    ChannelName grid;                                ///< mbot's grid; empty: not published.
    ChannelName pixels;                              ///< libbot's pixel map; likewise.
    std::int64_t map_period_us;                      ///< Changed tiles.
    std::int64_t keyframe_period_us;                 ///< All tiles.
    std::int64_t grid_period_us;                     ///< grid and pixels.
    std::int64_t status_period_us;
    std::int64_t stale_after_us; ///< No scan for so long: state STALE.
    bool is_query_crc_optional;  ///< Queries whose crc32 is 0 are answered.
};

/// What scans are let in.
struct IntakeConfig {
    std::uint32_t ranges_max;  ///< Most ranges of a scan.
    std::uint32_t queue_scans; ///< Scans that may wait, for a pose or for the map.
    std::int64_t ahead_max_us; ///< Stamps further ahead of the clock are refused.
    std::int64_t age_max_us;   ///< Older scans are refused; 0: any age.
};

struct Config {
    char lcm_url[256];
    gpom_config_t map; ///< Hyperparameters and low-resolution map included.
    std::uint64_t
        step_ops; ///< Budget of gpom_map_step() after each scan, and of a slice when idle.
    std::size_t n_sensors;
    SensorConfig sensors[kSensorsMax];
    PoseConfig pose;
    JumpConfig jump;
    IntakeConfig intake;
    PublishConfig publish;
    char snapshot_path[kPathMax]; ///< Empty: none.
    std::int64_t snapshot_period_us;
    CanConfig can;
};

/// Read and check a file; paths in it are relative to it. `config` must stay where it is: sensors
/// point to their masks. Throws gpom_tools::FileError, which names file, line and key.
void read_config(const char *path, Config &config);

} // namespace gpomd

#endif
