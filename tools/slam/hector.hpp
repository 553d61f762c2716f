// A rival: Gauss-Newton on a multi-resolution occupancy grid (Kohlbrecher et al. 2011, "A flexible
// and scalable SLAM system with full 3D motion estimation").
#ifndef GPOM_TOOLS_SLAM_HECTOR_HPP
#define GPOM_TOOLS_SLAM_HECTOR_HPP

#include "tools/slam/matcher.hpp"

namespace gpom_tools
{

struct HectorOptions {
    double cell_m = 0.05;    ///< Of the finest grid; each coarser one has cells twice as large.
    int n_levels = 3;        ///< The authors' number.
    double p_free = 0.4;     ///< The authors' default.
    double p_occupied = 0.9; ///< The authors' default.
    std::size_t n_returns = 180;
};

class HectorMatcher : public Matcher {
public:
    /// A square of side_m around the middle.
    HectorMatcher(Pose middle, double side_m, const HectorOptions &options);
    Matched match(const Scan &scan, const PredictedPose &predicted) override;
    void insert(const Scan &scan, const Matched &at) override;

private:
    struct Grid {
        double cell_m;
        int n_side;
        std::vector<float> log_odds;
        std::vector<int> marked; ///< Number of the scan that marked the cell last.
    };
    struct Sample {
        double p, by_x, by_y;
        bool is_inside;
    };
    Sample sample(const Grid &grid, double x_m, double y_m) const;
    bool step(const Grid &grid, const std::vector<PolarReturn> &returns, Matched &matched) const;
    void mark(Grid &grid, double x_m, double y_m, bool is_occupied);

    HectorOptions options_;
    double x0_m_, y0_m_;
    std::vector<Grid> grids_; ///< The finest first.
    int n_inserted_ = 0;
};

} // namespace gpom_tools

#endif
