// The rival OctoMap (Hornung et al., 2013) without changes, used in the plane.
#ifndef GPOM_TOOLS_EVAL_OCTOMAP_RIVAL_HPP
#define GPOM_TOOLS_EVAL_OCTOMAP_RIVAL_HPP

#include "gpom/query.h"
#include "ports/host/scan_log.hpp"

#include <memory>
#include <vector>

namespace octomap
{
class OcTree;
}

namespace gpom_tools
{

/// An octree of which only the layer at z = 0 is filled, with OctoMap's own sensor model.
class OctomapRival {
public:
    /// OctoMap's coordinates have single precision and are relative to `origin`. Choose the middle
    /// of the area, rounded to metres.
    OctomapRival(double cell_m, gpom_point_t origin);
    ~OctomapRival();

    /// Insert one scan at a time. OctoMap changes each cell once per scan, and a return has
    /// priority over passing beams.
    void insert(const Scan &scan);
    void insert(const std::vector<Scan> &scans);

    /// Probability of the leaf at the point. 0.5: there is no leaf.
    double probability(gpom_point_t point) const;

private:
    gpom_point_t origin_;
    std::unique_ptr<octomap::OcTree> tree_;
};

} // namespace gpom_tools

#endif
