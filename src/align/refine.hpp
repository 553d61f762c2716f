/// \file refine.hpp
/// From a start to the pose that fits best.
#pragma once

#include "src/align/lines.hpp"
#include "src/align/solve.hpp"

namespace gpom
{

/// A return counts at most this distance [m].
constexpr float kClip_m = 0.25f;

/// A return that contradicts the map counts this distance in the residual [m].
constexpr float kContradiction_m = 0.05f;

/// Memory of an alignment, in the caller's scratch.
struct AlignWork {
    const gpom_map *map;
    const gpom_align_config_t *config;
    Eigen::Vector2f robot_m; ///< The predicted place, relative to the map's origin.
    Eigen::Matrix3f prior;   ///< Information of the prediction.
    Return *returns;
    Line *lines;
    LineSearch *search;
    uint32_t n_returns;
};

/// A step of the robot from the predicted pose.
struct Motion {
    Eigen::Vector2f step_m;
    float turn_rad;
};

/// How a scan fits at a pose.
struct Fit {
    Motion motion;
    Eigen::Matrix3f scan; ///< Information of the scan.
    float misfit_m;       ///< Mean distance; a return without a line counts kClip_m.
    float residual_m;     ///< gpom_alignment_t::residual_m.
    uint32_t n_matched;
    uint32_t n_new; ///< Returns at places of which the map knows nothing.
    bool has_converged;
};

/// Iterate from a start.
///
/// Cost: n_iterations searches for each return.
Fit refine(const AlignWork &work, const Motion &start);

} // namespace gpom
