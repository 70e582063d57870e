#pragma once

#include <Eigen/Core>

namespace seastitch {

// Nearer to the vertical than this, roll and yaw cannot be distinguished.
constexpr double kMinCosPitch = 0.1;

// Cross product as a matrix: Skew(a) * b = a x b.
Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

// Columns: the axes in the map about which roll, pitch and yaw turn a body of this attitude.
Eigen::Matrix3d EulerAxes(const Eigen::Matrix3d& R_map_body);

}  // namespace seastitch
