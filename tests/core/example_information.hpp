#pragma once

#include <Eigen/Core>

namespace seastitch {

// Of x, y [m], yaw [rad].
inline Eigen::Matrix3d CorrelatedInformation() {
  Eigen::Matrix3d A;
  A << 3.0, -1.0, 4.0, 0.5, 2.0, -7.0, 0.2, 0.1, 30.0;
  return A.transpose() * A;
}

// Known along one horizontal direction only, and not in yaw.
inline Eigen::Matrix3d RidgeInformation() {
  const Eigen::Vector3d known = Eigen::Vector3d(0.6, 0.8, 0.0) / 0.05;
  return known * known.transpose();
}

}  // namespace seastitch
