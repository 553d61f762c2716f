// A rival: point-to-line ICP against the scan that was inserted last (Censi 2008, "An ICP variant
// using a point-to-line metric"), with robust weights in place of its trimming.
#ifndef GPOM_TOOLS_SLAM_ICP_HPP
#define GPOM_TOOLS_SLAM_ICP_HPP

#include "tools/slam/matcher.hpp"

namespace gpom_tools
{

class IcpMatcher : public Matcher {
public:
    explicit IcpMatcher(std::size_t n_returns) : n_returns_(n_returns) {}
    Matched match(const Scan &scan, const PredictedPose &predicted) override;
    void insert(const Scan &scan, const Matched &at) override;

private:
    struct Row {
        Eigen::Vector3d j;
        double error_m;
    };
    std::vector<Row> rows_of(const std::vector<PolarReturn> &returns, const Pose &pose,
                             double reach_m) const;

    std::size_t n_returns_;
    std::vector<Eigen::Vector2d> points_m_, normals_; ///< Of the reference scan, in its frame.
    Pose reference_;
};

} // namespace gpom_tools

#endif
