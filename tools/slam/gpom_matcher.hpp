// gpom_scan_align() as a matcher.
#ifndef GPOM_TOOLS_SLAM_GPOM_MATCHER_HPP
#define GPOM_TOOLS_SLAM_GPOM_MATCHER_HPP

#include "gpom/align.h"
#include "tools/map/host_map.hpp"
#include "tools/slam/matcher.hpp"

namespace gpom_tools
{

/// Standard deviations of a prediction by odometry: a + b moved + c turned.
struct MotionModel {
    double place[3] = {0.1, 0.3, 0.1}; ///< [m], [m / m], [m / rad]
    double yaw[3] = {0.1, 0.1, 0.5};   ///< [rad], [rad / m], [rad / rad]
};

struct GpomMatcherOptions {
    gpom_align_config_t align;
    MotionModel motion;
    bool inserts_cov = false; ///< Insert scans with the covariance of their alignment.
    std::uint64_t step_ops = 1000000;
};

class GpomMatcher : public Matcher {
public:
    GpomMatcher(const gpom_config_t &config, const GpomMatcherOptions &options);
    Matched match(const Scan &scan, const PredictedPose &predicted) override;
    void insert(const Scan &scan, const Matched &at) override;
    std::size_t n_beams() const override;
    const HostMap &map() const { return map_; }

private:
    HostMap map_;
    GpomMatcherOptions options_;
    std::vector<std::uint8_t> scratch_;
};

} // namespace gpom_tools

#endif
