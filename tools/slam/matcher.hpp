// What all scan matchers have in common.
#ifndef GPOM_TOOLS_SLAM_MATCHER_HPP
#define GPOM_TOOLS_SLAM_MATCHER_HPP

#include "ports/host/scan_log.hpp"
#include "tools/slam/pose.hpp"

#include <Eigen/Dense>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace gpom_tools
{

/// A pose that is expected, and how far the robot went to it.
struct PredictedPose {
    Pose pose;
    double moved_m = 0.0, turned_rad = 0.0; ///< By odometry since the pose before.
};

struct Matched {
    Pose pose;
    bool is_doubtful = false; ///< The matcher says that it does not know the pose.
    unsigned flags = 0;       ///< Those of gpom_alignment_t; of the other matchers 0.
    double residual_m = 0.0;
    std::size_t n_returns = 0, n_matched = 0, n_new = 0;
    double weak_sd_m = 0.0, weak_sd_rad = 0.0;
    std::size_t n_searches = 0;
    Eigen::Matrix3d cov = Eigen::Matrix3d::Zero(); ///< Of x, y, yaw. Zero: the matcher has none.
};

class Matcher {
public:
    virtual ~Matcher() = default;
    Matcher() = default;
    Matcher(const Matcher &) = delete;
    Matcher &operator=(const Matcher &) = delete;

    /// Find the pose of a scan. Before the first scan was inserted: the predicted pose.
    virtual Matched match(const Scan &scan, const PredictedPose &predicted) = 0;
    /// Take a scan at a pose into the map.
    virtual void insert(const Scan &scan, const Matched &at) = 0;
    virtual std::size_t n_beams() const { return 0; } ///< Kept beams of gpom's map.
};

/// A return in the laser's frame.
struct PolarReturn {
    double bearing_rad, range_m;
};

/// At most n_max returns of a scan, evenly taken. Nearer ones than 0.2 m do not count.
inline std::vector<PolarReturn> returns_of(const Scan &scan, std::size_t n_max)
{
    std::vector<PolarReturn> all, some;
    for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
        const double range_m = double{scan.ranges_m[i]};
        if (range_m > 0.2 && range_m < scan.range_max_m) {
            all.push_back(
                {scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad, range_m});
        }
    }
    if (all.size() <= n_max) {
        return all;
    }
    for (std::size_t i = 0; i < n_max; ++i) {
        some.push_back(all[i * all.size() / n_max]);
    }
    return some;
}

} // namespace gpom_tools

#endif
