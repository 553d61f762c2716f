// What the map says about the robot's surroundings at one moment, for small controllers and
// autopilots.
#ifndef GPOM_LINUX_SURROUNDINGS_HPP
#define GPOM_LINUX_SURROUNDINGS_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/map/mapping.hpp"
#include "ports/linux/pose/odometry.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// The parts that are looked at.
struct SurroundingsLinks {
    MapThread *mapping;
    const Odometry *odometry;
    const Counts *counts;
};

/// Sectors to fill, and how far to look.
struct SectorRequest {
    float range_m;
    float radius_m; ///< Cells this near to the reference point are the robot's own place.
    gpom_sector_t *sectors;
    std::size_t n_sectors;
};

/// Used by one thread. A jump of the map's frame may come between take() and look_about(): try both
/// kTries times.
class Surroundings {
public:
    static constexpr int kTries = 4;

    void init(const Config &config, const SurroundingsLinks &links);

    /// Note how many scans are in the map now. Call it before take().
    void look(std::int64_t now_us);
    /// Read state and place of the robot.
    void take(bool is_stopping);
    /// Fill the sectors about the place. False: the map is not fresh, is not of the frame of the
    /// place, or the place is not known; then nothing is known of any sector. Outside of the raster
    /// all sectors are unknown.
    bool look_about(const SectorRequest &request, gpom_lowres_info_t &info) const;

    gpom_wire_state_t state() const { return state_; }
    /// Age of the newest scan. Below 0: there is none.
    std::int64_t age_us() const { return age_us_; }
    std::int64_t n_inserted() const { return n_inserted_; }
    const MapState &map() const { return map_; }
    /// The newest known place of the robot.
    const StampedPose &place() const { return place_; }

private:
    gpom_wire_state_t find_state(bool is_stopping);
    void find_place();

    const Config *config_ = nullptr;
    SurroundingsLinks links_ = {};
    std::int64_t now_us_ = 0;
    std::int64_t n_inserted_ = 0;
    MapState map_ = {};
    StampedPose place_ = {};
    gpom_wire_state_t state_ = GPOM_WIRE_STATE_STARTING;
    std::int64_t age_us_ = -1;
};

} // namespace gpomd

#endif
