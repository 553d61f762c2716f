#include "gpom/scan.h"

#include "src/insert/keep.hpp"
#include "src/map/map.hpp"
#include "src/map/masked.hpp"
#include "src/map/origin.hpp"
#include "src/map/scan_input.hpp"

#include <float.h>

using gpom::Beam;
using gpom::place_of;
using gpom::SensorPlace;

namespace
{

/// A beam speaks against others if the standard deviation of its end is at most this many times
/// keep_m. The limit is no smaller because errors of poses change slowly: within one drive, a beam
/// and the hits near it have mostly the same error (docs/decisions/beam-noise.md).
constexpr float kSureSpacings = 2.0f;

/// The mark of the nth time. Each time makes one step of 2^32 / golden ratio along a circle of
/// circumference 2^32. The mark is the number of the sector in which the step ends. Any two times
/// up to 20 apart have different marks. Scans at regular intervals do not keep the same mark for
/// ever, whatever the interval is.
uint16_t mark_of(uint32_t time_number)
{
    constexpr uint32_t kStep = 2654435769u;
    return static_cast<uint16_t>(time_number * kStep >> (32 - gpom::kTimeMarkBits));
}

/// True if a reading cannot be used: counts its cause. False if it can be used. A reading that
/// means "no return" then becomes the usable maximum.
bool count_unusable(gpom_stats_t &stats, const gpom_sensor_t &sensor, float &range_m,
                    double bearing_rad)
{
    uint64_t *cause = nullptr;
    bool is_no_return = false;
    if (range_m != range_m) {
        cause = &stats.beams_nan;
    } else if (range_m <= 0.0f) {
        cause = &stats.beams_not_positive;
        is_no_return = range_m == 0.0f && sensor.zero_is_no_return != 0;
    } else if (range_m < sensor.range_min_m) {
        cause = &stats.beams_too_near;
        is_no_return = sensor.too_near_is_no_return != 0;
    }
    if (is_no_return) {
        range_m = sensor.range_max_m;
        cause = nullptr;
    }
    if (cause == nullptr && gpom::is_masked(sensor, bearing_rad)) {
        cause = &stats.beams_masked;
    }
    if (cause == nullptr) {
        return false;
    }
    ++*cause;
    return true;
}

/// Data that all beams of one scan share.
struct ScanContext {
    const gpom_sensor_t &sensor;
    const float *pose_cov; ///< 3 x 3 by rows, or NULL.
    gpom::Pose T_map_sensor;
    Eigen::Vector2f sensor_m; ///< Sensor position relative to the map's origin.
    Eigen::Vector2f lever_m;  ///< From the robot to the sensor, map axes.
    uint16_t scan;            ///< Number of the scan, modulo 2^16.
};

/// Variance of the place of a beam's end, measured across the surface there [m2]. It is the
/// variance of the range plus the variance that the pose has at the end. Only an error across the
/// surface changes the map, but the direction of the surface is not known. So the pose's variance
/// is the mean over all directions, which is half of the sum over x and y.
float end_variance(const ScanContext &context, const Beam &beam)
{
    float var_m2 = context.sensor.range_var_m2;
    if (context.pose_cov != nullptr) {
        const Eigen::Vector2f direction(beam.dir_x, beam.dir_y);
        const Eigen::Vector2f lever_m = context.lever_m + beam.range_m * direction;
        var_m2 += 0.5f * gpom::position_variance(context.pose_cov, lever_m);
    }
    return gpom::lane::max(var_m2, 0.0f); // rounding may make it negative
}

/// The excess w, by which the position uncertainty of a beam's end raises its noise (scan.h). Let
/// rho be the prior correlation between f at the true place and f at the believed place. Then
/// f(true) = rho f(believed) + an independent part. Division by rho gives the noise
/// (sn2 + (1 - rho^2) k) / rho^2 = sn2 + w (sn2 + k) with w = 1 / rho^2 - 1.
float excess_of(const gpom_map &map, float var_m2)
{
    if (var_m2 == 0.0f) {
        return 0.0f;
    }
    const gpom_params_t &params = map.config.params;
    const float sd_m = gpom::lane::sqrt(gpom::lane::min(var_m2, FLT_MAX));
    const float k = gpom::covariance_on_axis(params, 0.0f, sd_m);
    const float k_product =
        gpom::covariance_on_axis(params, 0.0f, 0.0f) * gpom::covariance_on_axis(params, sd_m, sd_m);
    const float rho2 = k * k / k_product;
    if (!(rho2 > 1.0f / gpom::kExcessMax)) {
        return gpom::kExcessMax;
    }
    return gpom::lane::max(1.0f / rho2 - 1.0f, 0.0f);
}

Beam beam_of(const gpom_map &map, const ScanContext &context, float range_m, double bearing_rad)
{
    const double turned_rad = context.sensor.upside_down != 0 ? -bearing_rad : bearing_rad;
    const gpom::Direction direction = gpom::direction_of(context.T_map_sensor.yaw_rad + turned_rad);
    Beam beam = {};
    beam.scan = context.scan;
    beam.stamp_ms = map.keeper.stamp_ms;
    beam.hit_time = map.keeper.time_mark & gpom::kTimeMarkMask;
    beam.x_m = context.sensor_m.x();
    beam.y_m = context.sensor_m.y();
    beam.dir_x = direction.x;
    beam.dir_y = direction.y;
    beam.returned = range_m < context.sensor.range_max_m ? 1u : 0u;
    beam.hit = beam.returned != 0 ? gpom::kStanding : gpom::kNoHit;
    beam.has_free = 1;
    beam.range_m = beam.returned != 0 ? range_m : context.sensor.range_max_m;
    return beam;
}

/// Make a beam from a reading and pass it to consider(), which decides whether the beam is kept. A
/// reading that cannot be used is only counted.
void insert_beam(gpom_map &map, const ScanContext &context, float range_m, double bearing_rad)
{
    if (count_unusable(map.stats, context.sensor, range_m, bearing_rad)) {
        return;
    }
    const float sure_m = kSureSpacings * map.config.keep_m;
    Beam beam = beam_of(map, context, range_m, bearing_rad);
    const float var_m2 = end_variance(context, beam);
    beam.excess = excess_of(map, var_m2);
    gpom::consider(map, beam, var_m2 <= sure_m * sure_m);
}

/// True if the sensor is in reach of the origin after the origin has moved by a step.
bool is_in_reach(const gpom_map &map, const gpom_sensor_t &sensor, const gpom_pose_t &pose,
                 const Eigen::Vector2d &step_m)
{
    const Eigen::Vector2d from_m = place_of(map, sensor, pose).from_origin_m - step_m;
    return from_m.squaredNorm() <= GPOM_REACH_M * GPOM_REACH_M;
}

/// True if the origin may move by a step to follow the robot. A pose that is out of reach of the
/// present origin may be wrong, and a move to it would drop the kept beams. So it is refused, with
/// two exceptions. If the map is empty, nothing is lost. If many poses near each other were
/// refused, the kept beams came from a wrong pose.
bool may_follow(gpom_map &map, const gpom_sensor_t &sensor, const gpom_pose_t &pose,
                const Eigen::Vector2d &step_m)
{
    return is_in_reach(map, sensor, pose, step_m) &&
           (map.index.n_beams == 0 || is_in_reach(map, sensor, pose, {0.0, 0.0}) ||
            gpom::note_out_of_reach(map, step_m));
}

/// The context of the scan that note_scan() noted last.
ScanContext context_of(const gpom_map &map, const gpom_sensor_t &sensor, const gpom_pose_t &pose,
                       const SensorPlace &place)
{
    const auto scan_number = static_cast<uint16_t>((map.stats.scans_inserted - 1) & 0xffffu);
    return {sensor,        pose.cov,   place.T_map_sensor, place.from_origin_m.cast<float>(),
            place.lever_m, scan_number};
}

/// Note the time and the place of a new scan.
void note_scan(gpom_map &map, int64_t stamp_us, const SensorPlace &place)
{
    const Eigen::Vector2f robot_m = place.from_origin_m.cast<float>() - place.lever_m;
    const gpom::Point robot = {robot_m.x(), robot_m.y()};
    gpom::follow_clock(map, stamp_us);
    gpom::lowres_follow(map.lowres, robot, stamp_us);
    gpom::Keeper &keeper = map.keeper;
    if (map.stats.scans_inserted == 0 || stamp_us != keeper.stamp_us) {
        ++keeper.time_number;
        keeper.time_mark = mark_of(keeper.time_number);
    }
    keeper.stamp_us = stamp_us;
    keeper.stamp_ms = gpom::milliseconds_since(map.lowres.stamp0_us, stamp_us);
    keeper.robot = robot;
    keeper.scan_first_id = map.index.next_id;
    keeper.moves = 0;
    ++map.stats.scans_inserted;
}

gpom_status_t refuse_pose(gpom_map &map)
{
    ++map.stats.scans_bad_pose;
    return GPOM_ERR_ARG;
}

gpom_status_t refuse_reach(gpom_map &map)
{
    ++map.stats.scans_out_of_reach;
    return GPOM_ERR_REACH;
}

} // namespace

void gpom_sensor_init(gpom_sensor_t *sensor)
{
    if (sensor == nullptr) {
        return;
    }
    *sensor = gpom_sensor_t{};
    sensor->range_min_m = 0.02f;
    sensor->range_max_m = 30.0f;
}

gpom_status_t gpom_scan_insert(gpom_map_t *map, const gpom_scan_t *scan,
                               const gpom_sensor_t *sensor, const gpom_pose_t *pose)
{
    if (!gpom::is_map(map) || pose == nullptr || !gpom::is_scan(scan) || !gpom::is_sensor(sensor)) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_pose(*pose)) {
        return refuse_pose(*map);
    }
    const Eigen::Vector2d step_m = gpom::origin_step(*map, pose->x_m, pose->y_m);
    if (!may_follow(*map, *sensor, *pose, step_m)) {
        return refuse_reach(*map);
    }
    gpom::move_origin(*map, step_m);
    const SensorPlace place = place_of(*map, *sensor, *pose);
    note_scan(*map, scan->stamp_us, place);
    const ScanContext context = context_of(*map, *sensor, *pose, place);
    for (uint32_t i = 0; i < scan->n_ranges; ++i) {
        insert_beam(*map, context, scan->ranges_m[i],
                    scan->angle_min_rad + i * scan->angle_step_rad);
    }
    gpom::settle(*map);
    return GPOM_OK;
}

gpom_status_t gpom_sweep_insert(gpom_map_t *map, const gpom_sweep_t *sweep,
                                const gpom_sensor_t *sensor, const gpom_pose_t *pose)
{
    if (!gpom::is_map(map) || pose == nullptr || !gpom::is_sweep(sweep) ||
        !gpom::is_sensor(sensor)) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_pose(*pose) || !gpom::are_poses(*sweep)) {
        return refuse_pose(*map);
    }
    const Eigen::Vector2d step_m = gpom::origin_step(*map, pose->x_m, pose->y_m);
    bool are_in_reach = true;
    for (uint32_t i = 0; i < sweep->n_ranges && are_in_reach; ++i) {
        are_in_reach = is_in_reach(*map, *sensor, sweep->poses[i], step_m);
    }
    if (!are_in_reach || !may_follow(*map, *sensor, *pose, step_m)) {
        return refuse_reach(*map);
    }
    gpom::move_origin(*map, step_m);
    note_scan(*map, sweep->stamp_us, place_of(*map, *sensor, *pose));
    map->keeper.moves = 1;
    for (uint32_t i = 0; i < sweep->n_ranges; ++i) {
        const gpom_pose_t &own = sweep->poses[i];
        insert_beam(*map, context_of(*map, *sensor, own, place_of(*map, *sensor, own)),
                    sweep->ranges_m[i], static_cast<double>(sweep->bearings_rad[i]));
    }
    gpom::settle(*map);
    return GPOM_OK;
}
