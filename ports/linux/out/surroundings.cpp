#include "ports/linux/out/surroundings.hpp"

#include "ports/linux/base/clock.hpp"

#include <algorithm>

namespace gpomd
{

void Surroundings::init(const Config &config, const SurroundingsLinks &links)
{
    config_ = &config;
    links_ = links;
}

void Surroundings::look(std::int64_t now_us)
{
    now_us_ = now_us;
    n_inserted_ = (*links_.counts)[GPOM_WIRE_SCANS_INSERTED]; // the state contains all these scans
}

void Surroundings::take(bool is_stopping)
{
    map_ = links_.mapping->state(); // before the cells: they may be newer than the state, not older
    state_ = find_state(is_stopping);
    find_place();
}

/// The map is old if its newest scan was inserted long ago, or if the stamp of that scan is long
/// ago.
gpom_wire_state_t Surroundings::find_state(bool is_stopping)
{
    age_us_ = -1;
    if (n_inserted_ == 0 || map_.stamp_us == 0) {
        return is_stopping ? GPOM_WIRE_STATE_STOPPING : GPOM_WIRE_STATE_STARTING;
    }
    age_us_ = std::max({wall_us() - map_.stamp_us, now_us_ - map_.fresh_us, std::int64_t{0}});
    return is_stopping                                 ? GPOM_WIRE_STATE_STOPPING
           : age_us_ > config_->publish.stale_after_us ? GPOM_WIRE_STATE_STALE
                                                       : GPOM_WIRE_STATE_MAPPING;
}

/// Place where the newest scan was taken, carried on by the odometry since then.
void Surroundings::find_place()
{
    place_ = {map_.stamp_us, map_.pose[0], map_.pose[1], map_.pose[2]};
    std::int64_t newest_us = 0;
    StampedPose carried = {};
    PoseCov cov = {};
    if (links_.odometry->newest(newest_us) && newest_us > place_.stamp_us &&
        links_.odometry->carry(place_, newest_us, carried, cov) == PoseMatch::found) {
        place_ = carried;
    }
}

bool Surroundings::look_about(const SectorRequest &request, gpom_lowres_info_t &info) const
{
    if (state_ != GPOM_WIRE_STATE_MAPPING) {
        return false;
    }
    const gpom_lookout_t lookout = {place_.x_m, place_.y_m, place_.yaw_rad, request.range_m,
                                    request.radius_m};
    const gpom_status_t status =
        gpom_sectors(links_.mapping->map(), &lookout, request.sectors, request.n_sectors, &info);
    return (status == GPOM_OK || status == GPOM_ERR_REACH) && info.frame_epoch == map_.frame_epoch;
}

} // namespace gpomd
