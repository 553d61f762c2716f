// Contents of the frames sent on CAN, taken from the map at one moment.
#ifndef GPOM_LINUX_CAN_PICTURE_HPP
#define GPOM_LINUX_CAN_PICTURE_HPP

#include "ports/can/messages.h"
#include "ports/linux/base/counts.hpp"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/out/surroundings.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// State of the port, which the map does not know.
struct PortState {
    bool is_bus_off;
    bool is_silent; ///< Odometry is configured and does not come.
    bool is_stopping;
};

/// The messages, without their alive counters. Used by one thread.
class CanPicture {
public:
    static std::size_t need(const Config &config);
    void init(const Config &config, Memory &memory, const SurroundingsLinks &links);

    /// Note which counters rose. Call this often, because the time of the call counts as the time
    /// of the rise.
    void look(std::int64_t now_us);
    /// Take a picture now.
    /// Cost: gpom_sectors() once or twice. If tiles are sent, a copy of the low-resolution map.
    void take(const PortState &port);

    gpom_can_status_t status() const;
    gpom_can_clearance_t clearance(std::uint8_t i_part) const;
    gpom_can_clearance_fd_t clearance_fd() const;
    /// The tile that is (tx, ty) tiles to the right of and above the robot's tile. False: the
    /// robot's place is not known.
    bool tile(std::int32_t tx, std::int32_t ty, gpom_can_tile_t &message) const;

private:
    static constexpr std::size_t kFaults = 6;

    bool look_about(gpom_sector_t *sectors, std::size_t n_sectors);
    bool copy();
    void show_fault(unsigned bit, bool is_shown);

    const Config *config_ = nullptr;
    SurroundingsLinks links_ = {};
    gpom_cell_t *cells_ = nullptr;
    std::size_t n_cells_ = 0;
    std::int64_t now_us_ = 0;
    std::int64_t n_faults_[kFaults] = {};
    std::int64_t fault_us_[kFaults] =
        {}; ///< Time when each was last seen to rise. Monotonic, 0: never.

    Surroundings surroundings_;
    gpom_lowres_info_t info_ = {};
    bool has_map_ = false; ///< Sectors and cells are known, and belong to this picture.
    std::uint8_t faults_ = 0;
    gpom_sector_t sectors_[GPOM_CAN_SECTORS] = {};
    gpom_sector_t fd_sectors_[GPOM_CAN_FD_SECTORS] = {};
};

} // namespace gpomd

#endif
