/// \file solve.hpp
/// Information about a pose (x, y, yaw): small symmetric matrices.
#pragma once

#include <Eigen/Core>

namespace gpom
{

/// The inverse of a symmetric positive definite 3 x 3 matrix. False if it is not positive definite.
/// The matrix is scaled to a unit diagonal first, because metres and radians differ in size.
bool invert(const Eigen::Matrix3f &matrix, Eigen::Matrix3f &inverse);

/// The information of a covariance: its inverse, with 0.1 mm and 0.1 mrad added to its standard
/// deviations, so that a pose that is exact in some direction has one.
bool information_of(const float *cov, Eigen::Matrix3f &information);

/// What information leaves open.
struct Weakness {
    Eigen::Vector2f direction; ///< Unit vector: the place is known worst along it.
    float sd_m;                ///< Along it.
    float sd_rad;              ///< Of the yaw.
};

/// The weakest direction of the place if the yaw is not known either, and the yaw if the place is
/// not known. Standard deviations are at most 1e6.
Weakness weakness_of(const Eigen::Matrix3f &information);

} // namespace gpom
