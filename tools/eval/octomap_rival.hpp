// OctoMap (Hornung et al., 2013) as shipped, kept to the plane.
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

/// A tree of cubes of which only the layer at z = 0 is filled, with OctoMap's own sensor model.
class OctomapRival {
public:
    /// Single precision is relative to `origin`: put it in the middle, at whole metres.
    OctomapRival(double cell_m, gpom_point_t origin);
    ~OctomapRival();

    /// One scan at a time: OctoMap lets each change a cell once, returns before passing beams.
    void insert(const Scan &scan);
    void insert(const std::vector<Scan> &scans);

    /// Of the leaf at the point; 0.5 where there is none.
    double probability(gpom_point_t point) const;

private:
    gpom_point_t origin_;
    std::unique_ptr<octomap::OcTree> tree_;
};

} // namespace gpom_tools

#endif
