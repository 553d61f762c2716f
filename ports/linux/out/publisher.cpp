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

/// How long after SIGTERM messages still wait for a slow network.
constexpr std::int64_t kLast_us = 500000;

/// Log-odds of MBot's grids are int8 without a stated unit; here 1 / 16.
constexpr double kLogOddsUnits = 16.0;

constexpr std::size_t kGridHeadBytes = 40;
constexpr std::size_t kPixelHeadBytes = 70;

/// Whole maps that messages cause, by asking or by jumps of the pose, are so far apart at least: a
/// few bytes on the bus must not become many.
constexpr std::int64_t kWholePeriod_us = 1000000;

/// Copies of the map in a row that a jump of its frame may spoil.
constexpr int kCopyTries = 4;

/// A turn that comes every period; late turns are not made up for.
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

/// A cell as MBot's planners read it: below 0 is free, above 0 occupied, 0 unknown. A cell that is
/// not called free is never below 0.
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
           Memory::need<std::uint8_t>(message_need(config));
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
}

void Publisher::run(const std::atomic<bool> &stop)
{
    Turn changes(config_->publish.map_period_us);
    Turn keyframes(config_->publish.keyframe_period_us);
    Turn grids(config_->publish.grid_period_us);
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
        send_map(keyframes.has_come(now_us) || is_requested);
        if (grids.has_come(now_us)) {
            send_grid();
            send_pixels();
        }
    }
    if (copy()) {
        send_map(true);
    }
}

/// Was a keyframe asked for, and may it go out already? Else the request stays.
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

/// False: the frame has jumped again too soon. Nothing is sent then, since tiles of two frames do
/// not fit each other.
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

/// Send what was encoded into `message_`, as fast as the network takes it: a slow one gets fewer
/// maps, not older ones. False: nothing was encoded, or it did not go out.
bool Publisher::send(const char *channel, std::size_t n_bytes)
{
    return n_bytes > 0 && sender_->send(channel, message_, n_bytes, {goes_on, this});
}

/// Waiting for the network is a sign of life, and ends soon after the daemon is told to stop.
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

/// Copy cells and state, of one frame. False: there is no map yet, or the raster or the frame kept
/// moving: at the next turn.
bool Publisher::copy()
{
    for (int i = 0; i < kCopyTries; ++i) {
        state_ = mapping_->state(); // before the cells: they may be newer than it says, never older
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

/// Send all tiles, or those that changed. If none did but scans came, the robot's tile is sent all
/// the same: its stamp tells subscribers that the map is fresh.
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
        return; // nobody lost anything: the same at the next turn
    }
    has_sent_ = true;
    sent_info_ = info_;
    sent_stamp_us_ = state_.stamp_us;
    ++map_sequence_;
    counts_->add(GPOM_WIRE_MAPS_PUBLISHED);
}

/// Codes of a tile's cells.
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
    // fmax() and fmin() make 0 of a place that is not known
    const auto clamped = [&raster](double from_corner_m, std::uint32_t n) {
        return static_cast<std::uint32_t>(
            std::fmin(std::fmax(from_corner_m / raster.cell_m, 0.0), static_cast<double>(n - 1)));
    };
    const std::uint32_t ix = clamped(state_.pose[0] - raster.x0_m, raster.nx);
    const std::uint32_t iy = clamped(state_.pose[1] - raster.y0_m, raster.ny);
    return iy / kTileNy * n_tiles_x_ + ix / kTileNx;
}

/// False: the system refused it.
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

/// MBot's grid: corner of cell 0, log-odds. It begins where float32 holds its corner, with unknown
/// cells before the raster's.
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
    std::uint8_t *const cells = message_ + message_bytes_ - n_cells; // behind what is encoded
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

/// libbot's pixel map: centre of cell 0, probability as float; 0.5 where nothing is known, as its
/// readers expect.
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
        std::memcpy(pixels + i * sizeof p, &p, sizeof p); // little-endian, as this processor is
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
