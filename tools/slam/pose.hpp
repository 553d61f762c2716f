// Planar poses in double: T_a_b maps coordinates of frame b into frame a.
#ifndef GPOM_TOOLS_SLAM_POSE_HPP
#define GPOM_TOOLS_SLAM_POSE_HPP

#include <cmath>

namespace gpom_tools
{

struct Pose {
    double x_m = 0.0, y_m = 0.0, yaw_rad = 0.0;

    double distance_m() const { return std::hypot(x_m, y_m); }
};

/// The same angle in [-pi, pi].
inline double wrap(double angle_rad) { return std::remainder(angle_rad, 2.0 * M_PI); }

inline Pose operator*(const Pose &a, const Pose &b)
{
    const double c = std::cos(a.yaw_rad), s = std::sin(a.yaw_rad);
    return {a.x_m + c * b.x_m - s * b.y_m, a.y_m + s * b.x_m + c * b.y_m,
            wrap(a.yaw_rad + b.yaw_rad)};
}

inline Pose inverse(const Pose &a)
{
    const double c = std::cos(a.yaw_rad), s = std::sin(a.yaw_rad);
    return {-c * a.x_m - s * a.y_m, s * a.x_m - c * a.y_m, wrap(-a.yaw_rad)};
}

/// Pose b seen from pose a.
inline Pose between_poses(const Pose &a, const Pose &b) { return inverse(a) * b; }

} // namespace gpom_tools

#endif
