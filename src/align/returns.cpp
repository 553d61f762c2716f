#include "src/align/returns.hpp"

#include "src/map/masked.hpp"
#include "src/map/se2.hpp"

namespace gpom
{

namespace
{

float range_of(const gpom_scan_t &scan, uint32_t i) { return scan.ranges_m[i]; }
float range_of(const gpom_sweep_t &sweep, uint32_t i) { return sweep.ranges_m[i]; }

double bearing_of(const gpom_scan_t &scan, uint32_t i)
{
    return scan.angle_min_rad + i * scan.angle_step_rad;
}

double bearing_of(const gpom_sweep_t &sweep, uint32_t i)
{
    return static_cast<double>(sweep.bearings_rad[i]);
}

const gpom_pose_t &pose_of(const gpom_scan_t &, uint32_t, const gpom_pose_t &predicted)
{
    return predicted;
}

const gpom_pose_t &pose_of(const gpom_sweep_t &sweep, uint32_t i, const gpom_pose_t &)
{
    return sweep.poses[i];
}

/// True if a reading is a return: neither bad nor "no return".
template <class Scan> bool is_return(const Scan &scan, const gpom_sensor_t &sensor, uint32_t i)
{
    const float range_m = range_of(scan, i);
    return range_m > 0.0f && range_m >= sensor.range_min_m && range_m < sensor.range_max_m &&
           !is_masked(sensor, bearing_of(scan, i));
}

template <class Scan> Return return_of(const Scan &scan, const gpom_align_task_t &task, uint32_t i)
{
    const gpom_sensor_t &sensor = *task.sensor;
    const gpom_pose_t &pose = pose_of(scan, i, task.predicted);
    const Pose T_map_robot = {{pose.x_m, pose.y_m}, pose.yaw_rad};
    const Pose T_map_sensor = T_map_robot * Pose{{sensor.x_m, sensor.y_m}, sensor.yaw_rad};
    const double bearing_rad = bearing_of(scan, i);
    const double turned_rad = sensor.upside_down != 0 ? -bearing_rad : bearing_rad;
    const Direction along = direction_of(T_map_sensor.yaw_rad + turned_rad);
    const Eigen::Vector2d from_m(task.predicted.x_m, task.predicted.y_m);
    const Eigen::Vector2f direction(along.x, along.y);
    const Eigen::Vector2f sensor_m = (T_map_sensor.position_m - from_m).cast<float>();
    return {sensor_m + range_of(scan, i) * direction, direction};
}

template <class Scan>
uint32_t gather(const Scan &scan, const gpom_align_task_t &task, Return *returns)
{
    uint32_t n_all = 0;
    for (uint32_t i = 0; i < scan.n_ranges; ++i) {
        n_all += is_return(scan, *task.sensor, i) ? 1 : 0;
    }
    const uint32_t n_max = task.config->n_returns_max;
    const uint32_t n_wanted = n_all < n_max ? n_all : n_max;
    uint32_t n = 0;
    uint32_t sum = n_all; // grows by n_wanted for each return; one is taken for each n_all
    for (uint32_t i = 0; i < scan.n_ranges && n < n_wanted; ++i) {
        if (is_return(scan, *task.sensor, i)) {
            if (sum >= n_all) {
                sum -= n_all;
                returns[n++] = return_of(scan, task, i);
            }
            sum += n_wanted;
        }
    }
    return n;
}

} // namespace

uint32_t gather_returns(const gpom_scan_t &scan, const gpom_align_task_t &task, Return *returns)
{
    return gather(scan, task, returns);
}

uint32_t gather_returns(const gpom_sweep_t &sweep, const gpom_align_task_t &task, Return *returns)
{
    return gather(sweep, task, returns);
}

} // namespace gpom
