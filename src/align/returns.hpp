/// \file returns.hpp
/// The returns of a scan that an alignment uses.
#pragma once

#include "gpom/align.h"

#include <Eigen/Core>

namespace gpom
{

/// A return, seen from the predicted pose of the robot, in the axes of the map.
struct Return {
    Eigen::Vector2f lever_m;   ///< From the robot to the return.
    Eigen::Vector2f direction; ///< Of its beam; a unit vector.
};

/// At most n_max returns of a scan or a sweep, taken evenly. Returns their number.
uint32_t gather_returns(const gpom_scan_t &scan, const gpom_align_task_t &task, Return *returns);
uint32_t gather_returns(const gpom_sweep_t &sweep, const gpom_align_task_t &task, Return *returns);

} // namespace gpom
