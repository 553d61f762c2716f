#include "ports/linux/out/can_picture.hpp"

#include <algorithm>
#include <cmath>

namespace gpomd
{

namespace
{

static_assert(GPOM_CAN_STARTING == static_cast<int>(GPOM_WIRE_STATE_STARTING) &&
                  GPOM_CAN_MAPPING == static_cast<int>(GPOM_WIRE_STATE_MAPPING) &&
                  GPOM_CAN_STALE == static_cast<int>(GPOM_WIRE_STATE_STALE) &&
                  GPOM_CAN_STOPPING == static_cast<int>(GPOM_WIRE_STATE_STOPPING),
              "frames and messages number the states alike");

/// A fault is shown for this time after its counter rose.
constexpr std::int64_t kFaultShown_us = 1000000;

/// Counters behind each bit of GPOM_Status, from the lowest bit on. A list ends with 0, which is
/// the place of a counter that is no fault.
constexpr std::size_t kCausesMax = 9;
constexpr std::size_t kCauses[][kCausesMax] = {
    {},
    {GPOM_WIRE_SCANS_NO_POSE, GPOM_WIRE_SCANS_BAD_POSE, GPOM_WIRE_POSES_REFUSED,
     GPOM_WIRE_ODOMETRY_GAPS},
    {GPOM_WIRE_SCANS_LOST, GPOM_WIRE_SCANS_CORRUPT, GPOM_WIRE_SCANS_MALFORMED, GPOM_WIRE_TIME_GAPS,
     GPOM_WIRE_DATAGRAMS_LOST, GPOM_WIRE_MESSAGES_TIMED_OUT},
    {GPOM_WIRE_CAN_BAD_LENGTH, GPOM_WIRE_CAN_BAD_CRC, GPOM_WIRE_CAN_BAD_COUNTER,
     GPOM_WIRE_CAN_BAD_VALUE, GPOM_WIRE_CAN_LOST, GPOM_WIRE_CAN_REORDERED, GPOM_WIRE_CAN_ERRORS,
     GPOM_WIRE_CAN_OVERFLOWS, GPOM_WIRE_CAN_NOT_SENT},
    {GPOM_WIRE_SCANS_OVERRUN, GPOM_WIRE_QUERIES_REFUSED},
    {}};

std::int64_t sum_of(const Counts &counts, const std::size_t (&places)[kCausesMax])
{
    std::int64_t sum = 0;
    for (const std::size_t place : places) {
        sum += place != GPOM_WIRE_SCANS_RECEIVED ? counts[place] : 0;
    }
    return sum;
}

/// Number of the tile that contains a cell of the map frame's grid.
std::int64_t tile_number(std::int64_t i_cell)
{
    const auto side = static_cast<std::int64_t>(GPOM_CAN_TILE_SIDE);
    return i_cell >= 0 ? i_cell / side : -((side - 1 - i_cell) / side);
}

/// The low 16 bits.
std::int16_t low_16(std::int64_t number)
{
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(number & 0xFFFF));
}

std::uint32_t milliseconds(std::int64_t stamp_us)
{
    return static_cast<std::uint32_t>((stamp_us / 1000) & 0xFFFFFFFF);
}

/// Code of a sector's distance for GPOM_Clearance. gpom_sectors() has rounded the distance down.
std::uint8_t distance_code(const gpom_sector_t &sector)
{
    return static_cast<std::uint8_t>(
        (sector.flags & GPOM_SECTOR_UNKNOWN) != 0 ? GPOM_CAN_DISTANCE_UNKNOWN
        : sector.cls == GPOM_FREE                 ? GPOM_CAN_DISTANCE_CLEAR
                                                  : gpom_can_distance_code(sector.distance_m));
}

std::uint8_t probability_code(const gpom_sector_t &sector)
{
    return sector.cls == GPOM_UNKNOWN ? static_cast<std::uint8_t>(GPOM_CAN_LEVEL_UNKNOWN)
                                      : gpom_can_probability_code(sector.probability);
}

std::uint8_t deviation_code(const gpom_sector_t &sector)
{
    return sector.cls == GPOM_UNKNOWN
               ? static_cast<std::uint8_t>(GPOM_CAN_LEVEL_UNKNOWN)
               : gpom_can_deviation_code(sector.variance, GPOM_CAN_LEVEL_MAX);
}

/// Number of cells that are copied. Only tiles need the cells themselves.
std::size_t copied_cells(const Config &config)
{
    const bool has_tiles = config.can.interface[0] != '\0' && config.can.tile.period_us > 0;
    return has_tiles ? std::size_t{config.map.lowres_nx} * config.map.lowres_ny : 0;
}

} // namespace

std::size_t CanPicture::need(const Config &config)
{
    return Memory::need<gpom_cell_t>(copied_cells(config));
}

void CanPicture::init(const Config &config, Memory &memory, const SurroundingsLinks &links)
{
    static_assert(sizeof kCauses / sizeof *kCauses == kFaults, "a list for each bit");
    config_ = &config;
    links_ = links;
    surroundings_.init(config, links);
    n_cells_ = copied_cells(config);
    cells_ = n_cells_ > 0 ? memory.take<gpom_cell_t>(n_cells_) : nullptr;
}

void CanPicture::look(std::int64_t now_us)
{
    now_us_ = now_us;
    surroundings_.look(now_us);
    for (std::size_t i = 0; i < kFaults; ++i) {
        const std::int64_t n = sum_of(*links_.counts, kCauses[i]);
        fault_us_[i] = n != n_faults_[i] ? now_us : fault_us_[i];
        n_faults_[i] = n;
    }
}

/// Fill the sectors.
bool CanPicture::look_about(gpom_sector_t *sectors, std::size_t n_sectors)
{
    const CanConfig &can = config_->can;
    return surroundings_.look_about({can.range_m, can.radius_m, sectors, n_sectors}, info_);
}

/// Copy the cells if they are needed. False: they are not of the frame of the place.
bool CanPicture::copy()
{
    return n_cells_ == 0 ||
           (gpom_lowres_copy(links_.mapping->map(), GPOM_LAYER_COARSE, cells_,
                             static_cast<std::uint32_t>(n_cells_), &info_) == GPOM_OK &&
            info_.frame_epoch == surroundings_.map().frame_epoch);
}

void CanPicture::take(const PortState &port)
{
    has_map_ = false;
    for (int i = 0; i < Surroundings::kTries && !has_map_; ++i) {
        surroundings_.take(port.is_stopping);
        has_map_ = look_about(sectors_, GPOM_CAN_SECTORS) &&
                   (config_->can.clearance_fd.period_us == 0 ||
                    look_about(fd_sectors_, GPOM_CAN_FD_SECTORS)) &&
                   copy();
    }
    if (!has_map_) {
        const gpom_sector_t unknown = {0.0f, 0.0f, 0, 255, GPOM_UNKNOWN, GPOM_SECTOR_UNKNOWN};
        std::fill_n(sectors_, GPOM_CAN_SECTORS, unknown);
        std::fill_n(fd_sectors_, GPOM_CAN_FD_SECTORS, unknown);
    }
    faults_ = 0;
    for (std::size_t i = 0; i < kFaults; ++i) {
        show_fault(1u << i, fault_us_[i] > 0 && now_us_ - fault_us_[i] < kFaultShown_us);
    }
    show_fault(GPOM_CAN_FAULT_SCAN, surroundings_.state() == GPOM_WIRE_STATE_STALE);
    show_fault(GPOM_CAN_FAULT_POSE, port.is_silent);
    show_fault(GPOM_CAN_FAULT_CAN, port.is_bus_off);
    show_fault(GPOM_CAN_FAULT_FULL, surroundings_.map().n_beams >= config_->map.beam_max);
}

void CanPicture::show_fault(unsigned bit, bool is_shown)
{
    faults_ = static_cast<std::uint8_t>(faults_ | (is_shown ? bit : 0u));
}

gpom_can_status_t CanPicture::status() const
{
    gpom_can_status_t message = {};
    message.state = static_cast<std::uint8_t>(surroundings_.state());
    const std::int64_t age_us = surroundings_.age_us();
    message.age = age_us < 0 ? static_cast<std::uint8_t>(GPOM_CAN_AGE_UNKNOWN)
                             : gpom_can_age_code(1e-6f * static_cast<float>(age_us));
    message.sequence = static_cast<std::uint8_t>(surroundings_.n_inserted() & 0xFF);
    message.clearance = GPOM_CAN_DISTANCE_UNKNOWN;
    message.bearing = GPOM_CAN_BEARING_UNKNOWN;
    for (std::size_t i = 0; i < GPOM_CAN_SECTORS; ++i) {
        const std::uint8_t code = distance_code(sectors_[i]);
        if (code < message.clearance) {
            const float turn = static_cast<float>(i) / static_cast<float>(GPOM_CAN_SECTORS);
            message.clearance = code;
            message.bearing = code == GPOM_CAN_DISTANCE_CLEAR
                                  ? static_cast<std::int8_t>(GPOM_CAN_BEARING_UNKNOWN)
                                  : gpom_can_bearing_code(6.2831853f * turn);
        }
    }
    const std::uint64_t percent =
        std::uint64_t{100} * surroundings_.map().n_beams / config_->map.beam_max;
    message.fill = static_cast<std::uint8_t>(std::min<std::uint64_t>(percent, GPOM_CAN_FILL_MAX));
    message.faults = faults_;
    return message;
}

gpom_can_clearance_t CanPicture::clearance(std::uint8_t i_part) const
{
    gpom_can_clearance_t message = {};
    message.i_part = i_part;
    message.state = static_cast<std::uint8_t>(surroundings_.state());
    for (std::size_t i = 0; i < GPOM_CAN_SECTORS_IN_FRAME; ++i) {
        message.distance[i] = distance_code(sectors_[GPOM_CAN_SECTORS_IN_FRAME * i_part + i]);
    }
    return message;
}

gpom_can_clearance_fd_t CanPicture::clearance_fd() const
{
    gpom_can_clearance_fd_t message = {};
    message.state = static_cast<std::uint8_t>(surroundings_.state());
    message.stamp_ms = milliseconds(surroundings_.map().stamp_us);
    for (std::size_t i = 0; i < GPOM_CAN_FD_SECTORS; ++i) {
        message.distance[i] = distance_code(fd_sectors_[i]);
        message.probability[i] = probability_code(fd_sectors_[i]);
        message.deviation[i] = deviation_code(fd_sectors_[i]);
    }
    return message;
}

bool CanPicture::tile(std::int32_t tx, std::int32_t ty, gpom_can_tile_t &message) const
{
    if (!has_map_ || n_cells_ == 0) {
        return false;
    }
    const gpom_raster_t &raster = info_.raster;
    const std::int64_t ix0 = std::llround(raster.x0_m / raster.cell_m); // the raster's first column
    const std::int64_t iy0 = std::llround(raster.y0_m / raster.cell_m);
    const std::int64_t reference_x =
        tile_number(std::llround(std::floor(surroundings_.place().x_m / raster.cell_m)));
    const std::int64_t reference_y =
        tile_number(std::llround(std::floor(surroundings_.place().y_m / raster.cell_m)));
    message.state = static_cast<std::uint8_t>(surroundings_.state());
    message.tile_x = static_cast<std::int8_t>(tx);
    message.tile_y = static_cast<std::int8_t>(ty);
    message.cell_cm = static_cast<std::uint8_t>(std::lround(100.0 * raster.cell_m));
    message.stamp_ms = milliseconds(surroundings_.map().stamp_us);
    message.reference_x = low_16(reference_x);
    message.reference_y = low_16(reference_y);
    const auto side = static_cast<std::int64_t>(GPOM_CAN_TILE_SIDE);
    for (std::int64_t i = 0; i < side * side; ++i) {
        const std::int64_t ix = (reference_x + tx) * side + i % side - ix0;
        const std::int64_t iy = (reference_y + ty) * side + i / side - iy0;
        const bool is_inside = ix >= 0 && iy >= 0 && ix < raster.nx && iy < raster.ny;
        const gpom_cell_t *const cell = is_inside ? &cells_[iy * raster.nx + ix] : nullptr;
        const bool is_known = cell != nullptr && cell->cls != GPOM_UNKNOWN;
        message.probability[i] = is_known ? gpom_can_probability_code(cell->probability)
                                          : static_cast<std::uint8_t>(GPOM_CAN_LEVEL_UNKNOWN);
        message.deviation[i] =
            is_known ? gpom_can_deviation_code(cell->variance, GPOM_CAN_TILE_DEVIATION_MAX)
                     : static_cast<std::uint8_t>(GPOM_CAN_TILE_DEVIATION_MAX);
    }
    return true;
}

} // namespace gpomd
