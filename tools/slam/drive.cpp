#include "tools/slam/drive.hpp"

#include <chrono>
#include <cmath>

namespace gpom_tools
{

namespace
{

class Stopwatch {
public:
    double ms() const
    {
        return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
    }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

bool is_beyond(const Pose &step, double way_m, double turn_rad)
{
    return step.distance_m() > way_m || std::abs(step.yaw_rad) > turn_rad;
}

/// The first pose of the drive: that of the first corrected scan, carried back by odometry.
Pose first_pose(const std::vector<DrivenScan> &log)
{
    for (const DrivenScan &scan : log) {
        if (scan.corrected) {
            return *scan.corrected * between_poses(scan.odometry, log.front().odometry);
        }
    }
    return log.front().odometry;
}

/// The state of a drive.
struct Robot {
    Matcher *matcher;
    const DriveOptions &options;
    Pose pose, last_inserted;
    Driven driven = {};
};

void visit(Robot &robot, const DrivenScan &scan, std::size_t i_scan, const Pose &step)
{
    Driven &driven = robot.driven;
    Matched matched;
    matched.pose = robot.pose * step;
    if (robot.matcher != nullptr && driven.n_inserted > 0) {
        const Stopwatch watch;
        const Matched found = robot.matcher->match(
            scan.scan, {matched.pose, step.distance_m(), std::abs(step.yaw_rad)});
        const double ms = watch.ms();
        driven.match_ms += ms;
        driven.match_ms_max = std::max(driven.match_ms_max, ms);
        driven.n_searches += found.n_searches;
        driven.n_searches_max = std::max(driven.n_searches_max, found.n_searches);
        ++driven.n_matched;
        driven.n_doubtful += found.is_doubtful ? 1 : 0;
        matched = found;
    }
    robot.pose = matched.pose;
    driven.way.push_back({i_scan, matched.pose, matched.flags});
    const Pose since = between_poses(robot.last_inserted, robot.pose);
    const bool is_far = driven.n_inserted == 0 ||
                        is_beyond(since, robot.options.insert_m, robot.options.insert_rad);
    if (robot.matcher != nullptr && is_far && !matched.is_doubtful) {
        const Stopwatch watch;
        robot.matcher->insert(scan.scan, matched);
        driven.insert_ms += watch.ms();
        ++driven.n_inserted;
        robot.last_inserted = robot.pose;
    }
}

} // namespace

Driven drive(const std::vector<DrivenScan> &log, Matcher *matcher, const DriveOptions &options)
{
    Robot robot = {matcher, options, first_pose(log), {}};
    std::size_t last = 0;
    bool has_begun = false;
    for (std::size_t i = 0; i < log.size(); ++i) {
        const Pose step = between_poses(log[last].odometry, log[i].odometry);
        if (!has_begun || log[i].corrected || is_beyond(step, options.match_m, options.match_rad)) {
            visit(robot, log[i], i, step);
            last = i;
            has_begun = true;
        }
    }
    return robot.driven;
}

Driven corrected_drive(const std::vector<DrivenScan> &log)
{
    Driven driven;
    for (std::size_t i = 0; i < log.size(); ++i) {
        if (log[i].corrected) {
            driven.way.push_back({i, *log[i].corrected});
        }
    }
    return driven;
}

} // namespace gpom_tools
