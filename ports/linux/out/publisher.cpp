#include "ports/linux/out/publisher.hpp"

#include "ports/linux/base/clock.hpp"
#include "ports/linux/config/grid_corner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace gpomd
{

namespace
{

/// After SIGTERM, messages wait for a slow network for this time at most.
constexpr std::int64_t kLast_us = 500000;

/// The log-odds of MBot's grids are int8 without a stated unit. The unit here is 1 / 16.
constexpr double kLogOddsUnits = 16.0;

constexpr std::size_t kGridHeadBytes = 40;
constexpr std::size_t kPixelHeadBytes = 70;

/// Shortest time between two whole maps that messages cause, by requests or by jumps of the pose.
/// It limits the traffic that a few bytes on the bus can cause.
constexpr std::int64_t kWholePeriod_us = 1000000;

/// Number of tries to copy the map. A jump of its frame spoils a copy.
constexpr int kCopyTries = 4;

/// A turn that comes every period. Late turns are skipped.
class Turn {
public:
    explicit Turn(std::int64_t period_us) : period_us_(period_us), next_us_(monotonic_us()) {}

    std::int64_t wait_us(std::int64_t now_us) const { return next_us_ - now_us; }
    bool has_come(std::int64_t now_us)
    {
        if (now_us < next_us_) {
            return false;
        }
        next_us_ = std::max(next_us_ + period_us_, now_us + period_us_ / 2);
        return true;
    }

private:
    std::int64_t period_us_;
    std::int64_t next_us_;
};

std::uint32_t ceil_div(std::uint32_t a, std::uint32_t b) { return (a + b - 1) / b; }

std::uint32_t tile_count(const gpom_config_t &map)
{
    return ceil_div(map.lowres_nx, kTileNx) * ceil_div(map.lowres_ny, kTileNy);
}

std::size_t message_need(const Config &config)
{
    const std::size_t n = std::size_t{config.map.lowres_nx} * config.map.lowres_ny;
    const std::size_t n_grid = (std::size_t{config.map.lowres_nx} + kGridMarginMax) *
                               (std::size_t{config.map.lowres_ny} + kGridMarginMax);
    const std::size_t grid = config.publish.grid[0] != '\0' ? kGridHeadBytes + 2 * n_grid : 0;
    const std::size_t pixels =
        config.publish.pixels[0] != '\0' ? kPixelHeadBytes + 2 * n * sizeof(float) : 0;
    return std::max({GPOM_WIRE_MAP_BYTES(kTileCells), grid, pixels});
}

/// A cell as MBot's planners read it: below 0 is free, above 0 occupied, 0 unknown. Only cells of
/// class free are below 0.
std::int8_t log_odds_of(const gpom_cell_t &cell)
{
    if (cell.cls == GPOM_UNKNOWN) {
        return 0;
    }
    const double p = std::clamp(cell.probability / 65535.0, 1e-6, 1.0 - 1e-6);
    const double odds = std::round(kLogOddsUnits * std::log(p / (1.0 - p)));
    const double low = cell.cls == GPOM_FREE ? -127.0 : cell.cls == GPOM_OCCUPIED ? 1.0 : 0.0;
    const double high = cell.cls == GPOM_FREE ? -1.0 : 127.0;
    return static_cast<std::int8_t>(std::clamp(odds, low, high));
}

bool is_same_raster(const gpom_lowres_info_t &a, const gpom_lowres_info_t &b)
{
    return a.raster.x0_m == b.raster.x0_m && a.raster.y0_m == b.raster.y0_m &&
           a.frame_epoch == b.frame_epoch;
}

} // namespace

std::size_t Publisher::need(const Config &config)
{
    const std::size_t n = std::size_t{config.map.lowres_nx} * config.map.lowres_ny;
    const std::size_t n_codes = std::size_t{2} * kTileCells * tile_count(config.map);
    return Memory::need<gpom_cell_t>(n) + 2 * Memory::need<std::uint8_t>(n_codes) +
           Memory::need<std::uint8_t>(message_need(config)) + DistanceTiles::need(config);
}

void Publisher::init(const Config &config, Memory &memory, Sender &sender, MapThread &mapping,
                     Counts &counts)
{
    config_ = &config;
    sender_ = &sender;
    mapping_ = &mapping;
    counts_ = &counts;
    n_cells_ = std::uint32_t{config.map.lowres_nx} * config.map.lowres_ny;
    n_tiles_x_ = ceil_div(config.map.lowres_nx, kTileNx);
    n_tiles_ = tile_count(config.map);
    cells_ = memory.take<gpom_cell_t>(n_cells_);
    codes_ = memory.take<std::uint8_t>(std::size_t{2} * kTileCells * n_tiles_);
    sent_ = memory.take<std::uint8_t>(std::size_t{2} * kTileCells * n_tiles_);
    message_bytes_ = message_need(config);
    message_ = memory.take<std::uint8_t>(message_bytes_);
    distances_.init(config, memory, mapping);
}

void Publisher::run(const std::atomic<bool> &stop)
{
    Turn changes(config_->publish.map_period_us);
    Turn keyframes(config_->publish.keyframe_period_us);
    Turn grids(config_->publish.grid_period_us);
    Turn distances(config_->publish.distances_period_us);
    stop_ = &stop;
    while (!stop.load(std::memory_order_relaxed)) {
        pulse_.fetch_add(1, std::memory_order_relaxed);
        {
            std::unique_lock<std::mutex> lock(mutex_);
            const std::chrono::microseconds wait(
                std::clamp<std::int64_t>(changes.wait_us(monotonic_us()), 0, 200000));
            changed_.wait_for(lock, wait, [this] { return is_woken_; });
            is_woken_ = false;
        }
        const std::int64_t now_us = monotonic_us();
        if (!changes.has_come(now_us) || !copy() || !may_begin_epoch(now_us)) {
            continue;
        }
        const bool is_requested = take_request(now_us);
        const bool is_keyframe = keyframes.has_come(now_us) || is_requested;
        send_map(is_keyframe);
        if (is_keyframe || distances.has_come(now_us)) {
            send_distances(is_keyframe);
        }
        if (grids.has_come(now_us)) {
            send_grid();
            send_pixels();
        }
    }
    if (copy()) {
        send_map(true);
    }
}

void Publisher::send_distances(bool is_keyframe)
{
    const DistanceChannel channel = {
        [](void *publisher, const std::uint8_t *bytes, std::size_t n_bytes) {
            Publisher &self = *static_cast<Publisher *>(publisher);
            return self.sender_->send(self.config_->publish.distances, bytes, n_bytes,
                                      {goes_on, publisher});
        },
        this};
    distances_.send(state_, is_keyframe, channel);
}

/// True if a keyframe was requested and may be sent now. A request that is too early stays.
bool Publisher::take_request(std::int64_t now_us)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!is_requested_ || now_us < request_due_us_) {
        return false;
    }
    is_requested_ = false;
    request_due_us_ = now_us + kWholePeriod_us;
    return true;
}

/// False: the frame jumped again too soon. Nothing is sent then, because tiles of two frames do not
/// fit together.
bool Publisher::may_begin_epoch(std::int64_t now_us)
{
    if (!has_sent_ || info_.frame_epoch == sent_info_.frame_epoch) {
        return true;
    }
    if (now_us < epoch_due_us_) {
        return false;
    }
    epoch_due_us_ = now_us + kWholePeriod_us;
    return true;
}

void Publisher::request_keyframe()
{
    const std::lock_guard<std::mutex> lock(mutex_);
    is_requested_ = true;
}

void Publisher::wake()
{
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        is_woken_ = true;
    }
    changed_.notify_one();
}

/// Send the message that was encoded into `message_`, as fast as the network takes it. A slow
/// network gets fewer maps, not older ones. False: nothing was encoded, or it was not sent.
bool Publisher::send(const char *channel, std::size_t n_bytes)
{
    return n_bytes > 0 && sender_->send(channel, message_, n_bytes, {goes_on, this});
}

/// Called while a message waits for the network. Shows that the thread runs, and ends the wait soon
/// after the daemon is told to stop.
bool Publisher::goes_on(void *publisher)
{
    Publisher &self = *static_cast<Publisher *>(publisher);
    self.pulse_.fetch_add(1, std::memory_order_relaxed);
    if (!self.stop_->load(std::memory_order_relaxed)) {
        return true;
    }
    const std::int64_t now_us = monotonic_us();
    self.end_us_ = self.end_us_ == 0 ? now_us + kLast_us : self.end_us_;
    return now_us < self.end_us_;
}

/// Copy cells and state of one frame. False: there is no map yet, or the raster or the frame kept
/// changing. The next turn tries again.
bool Publisher::copy()
{
    for (int i = 0; i < kCopyTries; ++i) {
        // Before the cells: they may be newer than the state, never older.
        state_ = mapping_->state();
        if (!state_.has_map || gpom_lowres_copy(mapping_->map(), GPOM_LAYER_COARSE, cells_,
                                                n_cells_, &info_) != GPOM_OK) {
            return false;
        }
        if (info_.frame_epoch == state_.frame_epoch) {
            return true;
        }
    }
    return false;
}

/// Send all tiles, or those that changed. If no tile changed but scans came, the robot's tile is
/// sent: its stamp tells subscribers that the map is fresh.
void Publisher::send_map(bool is_keyframe)
{
    const bool is_whole = is_keyframe || !has_sent_ || !is_same_raster(info_, sent_info_);
    const bool is_fresh = state_.stamp_us != sent_stamp_us_;
    std::uint32_t n_sent = 0;
    for (std::uint32_t i = 0; i < n_tiles_; ++i) {
        encode_tile(i);
        n_sent += is_whole || has_changed(i) ? 1 : 0;
    }
    const bool is_sign_of_life = n_sent == 0 && is_fresh;
    if (n_sent == 0 && !is_sign_of_life) {
        return;
    }
    n_sent = std::max(n_sent, std::uint32_t{1});
    std::uint16_t i_sent = 0;
    bool is_published = false;
    for (std::uint32_t i = 0; i < n_tiles_; ++i) {
        if (is_whole || has_changed(i) || (is_sign_of_life && i == tile_of_robot())) {
            const bool is_sent =
                send_tile(i, i_sent++, static_cast<std::uint16_t>(n_sent), is_whole);
            is_published = is_published || is_sent;
        }
    }
    if (!is_published) {
        return; // nothing was sent: the next turn tries again
    }
    has_sent_ = true;
    sent_info_ = info_;
    sent_stamp_us_ = state_.stamp_us;
    ++map_sequence_;
    counts_->add(GPOM_WIRE_MAPS_PUBLISHED);
}

/// Write the codes of a tile's cells.
void Publisher::encode_tile(std::uint32_t i_tile)
{
    const std::uint32_t ix0 = i_tile % n_tiles_x_ * kTileNx;
    const std::uint32_t iy0 = i_tile / n_tiles_x_ * kTileNy;
    const std::uint32_t nx = std::min(kTileNx, info_.raster.nx - ix0);
    const std::uint32_t ny = std::min(kTileNy, info_.raster.ny - iy0);
    std::uint8_t *const probability = codes_ + std::size_t{2} * kTileCells * i_tile;
    std::uint8_t *const variance_class = probability + kTileCells;
    for (std::uint32_t iy = 0; iy < ny; ++iy) {
        const gpom_cell_t *const row = cells_ + std::size_t{iy0 + iy} * info_.raster.nx + ix0;
        for (std::uint32_t ix = 0; ix < nx; ++ix) {
            const gpom_cell_t &cell = row[ix];
            probability[iy * nx + ix] = gpom_wire_probability_code(cell.probability, cell.cls);
            variance_class[iy * nx + ix] = gpom_wire_variance_class_code(cell.variance, cell.cls);
        }
    }
}

bool Publisher::has_changed(std::uint32_t i_tile) const
{
    const std::size_t at = std::size_t{2} * kTileCells * i_tile;
    return std::memcmp(codes_ + at, sent_ + at, 2 * kTileCells) != 0;
}

std::uint32_t Publisher::tile_of_robot() const
{
    const gpom_raster_t &raster = info_.raster;
    // if the place is NaN, fmax() and fmin() make it 0
    const auto clamped = [&raster](double from_corner_m, std::uint32_t n) {
        return static_cast<std::uint32_t>(
            std::fmin(std::fmax(from_corner_m / raster.cell_m, 0.0), static_cast<double>(n - 1)));
    };
    const std::uint32_t ix = clamped(state_.pose[0] - raster.x0_m, raster.nx);
    const std::uint32_t iy = clamped(state_.pose[1] - raster.y0_m, raster.ny);
    return iy / kTileNy * n_tiles_x_ + ix / kTileNx;
}

/// Send one tile. False: the system refused it.
bool Publisher::send_tile(std::uint32_t i_tile, std::uint16_t i_sent, std::uint16_t n_sent,
                          bool is_keyframe)
{
    const gpom_raster_t &raster = info_.raster;
    const std::uint32_t ix0 = i_tile % n_tiles_x_ * kTileNx;
    const std::uint32_t iy0 = i_tile / n_tiles_x_ * kTileNy;
    const std::size_t at = std::size_t{2} * kTileCells * i_tile;
    gpom_wire_map_t tile = {};
    tile.stamp_us = state_.stamp_us;
    tile.map_sequence = map_sequence_;
    tile.i_tile = i_sent;
    tile.n_tiles = n_sent;
    tile.keyframe = is_keyframe ? 1 : 0;
    tile.frame_epoch = static_cast<std::int32_t>(info_.frame_epoch);
    std::copy_n(state_.pose, 3, tile.pose);
    tile.corner_m[0] = raster.x0_m + ix0 * raster.cell_m;
    tile.corner_m[1] = raster.y0_m + iy0 * raster.cell_m;
    tile.cell_m = static_cast<float>(raster.cell_m);
    tile.prior_variance = gpom_params_prior_variance(&config_->map.params);
    tile.map_nx = static_cast<std::uint16_t>(raster.nx);
    tile.map_ny = static_cast<std::uint16_t>(raster.ny);
    tile.ix0 = static_cast<std::uint16_t>(ix0);
    tile.iy0 = static_cast<std::uint16_t>(iy0);
    tile.nx = static_cast<std::uint16_t>(std::min(kTileNx, raster.nx - ix0));
    tile.ny = static_cast<std::uint16_t>(std::min(kTileNy, raster.ny - iy0));
    tile.probability = codes_ + at;
    tile.variance_class = codes_ + at + kTileCells;
    const std::size_t n_bytes = gpom_wire_map_encode(&tile, message_, message_bytes_);
    if (!send(config_->publish.map, n_bytes)) {
        return false;
    }
    std::memcpy(sent_ + at, codes_ + at, 2 * kTileCells);
    counts_->add(GPOM_WIRE_TILES_PUBLISHED);
    return true;
}

/// Send MBot's grid of log-odds. Its position is the corner of cell 0. The grid begins at a corner
/// that float32 can hold, so it has unknown cells before those of the raster.
void Publisher::send_grid()
{
    if (config_->publish.grid[0] == '\0') {
        return;
    }
    const gpom_raster_t &raster = info_.raster;
    const std::uint32_t before_x = grid_margin(raster.x0_m, raster.cell_m);
    const std::uint32_t before_y = grid_margin(raster.y0_m, raster.cell_m);
    if (std::max(before_x, before_y) > kGridMarginMax) {
        counts_->add(GPOM_WIRE_GRIDS_NOT_SENT);
        return;
    }
    const std::uint32_t nx = raster.nx + before_x, ny = raster.ny + before_y;
    const std::size_t n_cells = std::size_t{nx} * ny;
    std::uint8_t *const cells = message_ + message_bytes_ - n_cells; // after the encoded head
    std::memset(cells, 0, n_cells);
    for (std::uint32_t i = 0; i < n_cells_; ++i) {
        const std::size_t iy = before_y + i / raster.nx;
        cells[iy * nx + before_x + i % raster.nx] =
            static_cast<std::uint8_t>(log_odds_of(cells_[i]));
    }
    const gpom_wire_occupancy_grid_t grid = {
        state_.stamp_us,
        static_cast<float>(raster.x0_m - before_x * raster.cell_m),
        static_cast<float>(raster.y0_m - before_y * raster.cell_m),
        static_cast<float>(raster.cell_m),
        nx,
        ny,
        cells};
    const std::size_t n_bytes =
        gpom_wire_occupancy_grid_encode(&grid, message_, message_bytes_ - n_cells);
    send(config_->publish.grid, n_bytes);
}

/// Send libbot's pixel map of probabilities as floats. Its position is the centre of cell 0.
/// Unknown cells are 0.5, as its readers expect.
void Publisher::send_pixels()
{
    if (config_->publish.pixels[0] == '\0') {
        return;
    }
    const gpom_raster_t &raster = info_.raster;
    const std::size_t n_pixel_bytes = std::size_t{n_cells_} * sizeof(float);
    std::uint8_t *const pixels = message_ + message_bytes_ - n_pixel_bytes;
    for (std::uint32_t i = 0; i < n_cells_; ++i) {
        const gpom_cell_t &cell = cells_[i];
        const float p =
            cell.cls == GPOM_UNKNOWN ? 0.5f : static_cast<float>(cell.probability) / 65535.0f;
        std::memcpy(pixels + i * sizeof p, &p, sizeof p); // little-endian, like this processor
    }
    gpom_wire_pixel_map_t map = {};
    map.stamp_us = state_.stamp_us;
    map.nx = raster.nx;
    map.ny = raster.ny;
    map.cell_m = raster.cell_m;
    map.centre0_m[0] = raster.x0_m + 0.5 * raster.cell_m;
    map.centre0_m[1] = raster.y0_m + 0.5 * raster.cell_m;
    map.end_m[0] = map.centre0_m[0] + raster.nx * raster.cell_m;
    map.end_m[1] = map.centre0_m[1] + raster.ny * raster.cell_m;
    map.pixel = GPOM_WIRE_PIXEL_FLOAT;
    map.pixels = pixels;
    map.n_bytes = static_cast<std::uint32_t>(n_pixel_bytes);
    const std::size_t n_bytes =
        gpom_wire_pixel_map_encode(&map, message_, message_bytes_ - n_pixel_bytes);
    send(config_->publish.pixels, n_bytes);
}

} // namespace gpomd
