/// \file se2.hpp
/// Planar poses: T_a_b maps coordinates of frame b into frame a.
#pragma once

#include "src/lane/elementary.hpp"

#include <Eigen/Core>

namespace gpom
{

struct Pose {
    Eigen::Vector2d position_m;
    double yaw_rad;
};

/// T_a_c = T_a_b T_b_c. Offsets are rotated in float32, which is exact to 1e-7 of their length.
inline Pose operator*(const Pose &T_a_b, const Pose &T_b_c)
{
    const Direction x_axis = direction_of(T_a_b.yaw_rad);
    Eigen::Matrix2f R_a_b;
    R_a_b << x_axis.x, -x_axis.y, x_axis.y, x_axis.x;
    const Eigen::Vector2f offset_m = R_a_b * T_b_c.position_m.cast<float>();
    return {T_a_b.position_m + offset_m.cast<double>(), T_a_b.yaw_rad + T_b_c.yaw_rad};
}

/// Position variance, summed over x and y [m2], of a point that is rigidly fixed to a frame. The
/// pose (x, y, yaw) of the frame has covariance `cov`, 3 x 3 by rows. `lever_m` is the vector from
/// the frame's origin to the point. The formula is of first order in yaw: the trace of J cov J^T
/// with J = [1 0 -lever_y; 0 1 lever_x].
inline float position_variance(const float *cov, const Eigen::Vector2f &lever_m)
{
    return cov[0] + cov[4] + lever_m.squaredNorm() * cov[8] - lever_m.y() * (cov[2] + cov[6]) +
           lever_m.x() * (cov[5] + cov[7]);
}

} // namespace gpom
