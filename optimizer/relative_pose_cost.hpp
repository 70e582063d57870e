#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/core/pose.hpp"

namespace seastitch {

// W with W^T W = information, so that |W e|^2 = e^T information e, and the number of directions
// that the information knows (0 to 3).
struct SqrtInformation {
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  int rank = 0;
};

// The square root of an information matrix of (x, y [m], yaw [rad]) that may be singular: an
// eigen-decomposition V D V^T of the unit-diagonal matrix gives W = sqrt(D) V^T. A Cholesky factor
// would need full rank. Nothing for a matrix that is not finite, not symmetric, not positive
// semi-definite, or above kMaxInformation on its diagonal.
std::optional<SqrtInformation> FactorInformation(const Eigen::Matrix3d& information);

// Sigmas under 10 um or 10 urad: nobody knows that, and a double cannot hold it beside a weak link.
constexpr double kMaxInformation = 1e10;

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
