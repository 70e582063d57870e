#pragma once

#include <Eigen/Core>

#include "common/core/pose.hpp"

namespace seastitch {

// What T_i_j says of the poses of i and j in a common frame (map):
//   e = [ R_i^T (p_j - p_i) - p_ij ;  wrap(yaw_j - yaw_i - yaw_ij) ]   [m, m, rad], axes of i
// Residual: W e. With T_map_i = identity it is a statement on the pose of j in the map alone, in
// the axes of the map: a position fix, a prior.
struct RelativePoseCost {
  Pose2 T_i_j;
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();

  // e, before it is weighted.
  Eigen::Vector3d Error(const Pose2& T_map_i, const Pose2& T_map_j) const;
  // The residual. J_i, J_j (each may be null): its derivatives by (x, y, yaw) of i and of j.
  Eigen::Vector3d Evaluate(const Pose2& T_map_i,
                           const Pose2& T_map_j,
                           Eigen::Matrix3d* J_i,
                           Eigen::Matrix3d* J_j) const;
};

}  // namespace seastitch
