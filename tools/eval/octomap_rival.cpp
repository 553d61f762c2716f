#include "tools/eval/octomap_rival.hpp"

#include "tools/eval/occupancy_grid.hpp"

#include <octomap/octomap.h>

namespace gpom_tools
{
namespace
{

/// Beams without return end this far beyond the usable range [m]. OctoMap cuts them there.
constexpr double kBeyondRange = 1.0;

octomap::point3d planar(double x_m, double y_m)
{
    return {static_cast<float>(x_m), static_cast<float>(y_m), 0.0f};
}

} // namespace

OctomapRival::OctomapRival(double cell_m, gpom_point_t origin)
    : origin_(origin), tree_(std::make_unique<octomap::OcTree>(cell_m))
{
}

OctomapRival::~OctomapRival() = default;

void OctomapRival::insert(const Scan &scan)
{
    octomap::Pointcloud cloud;
    for (GridBeam beam : beams_of({scan}, 0.0)) {
        beam.range_m += beam.hit ? 0.0 : kBeyondRange;
        const gpom_point_t end = end_of(beam);
        cloud.push_back(planar(end.x_m - origin_.x_m, end.y_m - origin_.y_m));
    }
    constexpr bool kLazy = true;
    tree_->insertPointCloud(cloud, planar(scan.x_m - origin_.x_m, scan.y_m - origin_.y_m),
                            scan.range_max_m, kLazy);
}

void OctomapRival::insert(const std::vector<Scan> &scans)
{
    for (const Scan &scan : scans) {
        insert(scan);
    }
}

double OctomapRival::probability(gpom_point_t point) const
{
    const octomap::OcTreeNode *const leaf =
        tree_->search(planar(point.x_m - origin_.x_m, point.y_m - origin_.y_m));
    return leaf != nullptr ? leaf->getOccupancy() : 0.5;
}

} // namespace gpom_tools
