// Errors of a way beside corrected poses and beside relations.
#ifndef GPOM_TOOLS_SLAM_ERRORS_HPP
#define GPOM_TOOLS_SLAM_ERRORS_HPP

#include "tools/slam/drive.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

struct RelativeError {
    double place_m = 0.0, yaw_rad = 0.0; ///< Means.
    std::size_t n = 0;
};

/// Root mean square distance from the corrected poses after the rigid motion that makes it
/// smallest (Horn 1987 in the plane). NaN: fewer than two poses.
double absolute_rms_m(const std::vector<DrivenScan> &log, const std::vector<Visited> &way);

/// Mean error of the pose at the end of each stretch of this length of the corrected way, seen from
/// its start.
RelativeError relative_error(const std::vector<DrivenScan> &log, const std::vector<Visited> &way,
                             double length_m);

/// A relation of the SLAM benchmark (Kuemmerle et al. 2009): the true pose at one time, seen from
/// the pose at another time.
struct Relation {
    double from_s, to_s;
    Pose step;
};

/// Read relations: `t0 t1 x y z roll pitch yaw` a line. Throws FileError.
std::vector<Relation> read_relations(const std::string &path);

struct RelationError {
    double place_m = 0.0, place_sd_m = 0.0, yaw_rad = 0.0, yaw_sd_rad = 0.0;
    std::size_t n = 0; ///< Relations of which both scans were visited.
};

/// The benchmark's metric: the mean error of the relations, not squared, and its standard
/// deviation.
RelationError relation_error(const std::vector<Relation> &relations,
                             const std::vector<DrivenScan> &log, const std::vector<Visited> &way);

} // namespace gpom_tools

#endif
