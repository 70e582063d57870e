#include "optimizer/relative_pose_cost.hpp"

namespace seastitch {

Eigen::Vector3d RelativePoseCost::Error(const Pose2& T_map_i, const Pose2& T_map_j) const {
  const Eigen::Vector2d p_i =
      T_map_i.Rotation().transpose() * (T_map_j.Translation() - T_map_i.Translation());
  Eigen::Vector3d e;
  e << p_i - T_i_j.Translation(), WrapAngle(T_map_j.yaw - T_map_i.yaw - T_i_j.yaw);
  return e;
}

Eigen::Vector3d RelativePoseCost::Evaluate(const Pose2& T_map_i,
                                           const Pose2& T_map_j,
                                           Eigen::Matrix3d* J_i,
                                           Eigen::Matrix3d* J_j) const {
  const Eigen::Matrix2d R_i_map = T_map_i.Rotation().transpose();
  const Eigen::Vector2d p_i = R_i_map * (T_map_j.Translation() - T_map_i.Translation());
  if (J_i != nullptr) {
    Eigen::Matrix3d J = -Eigen::Matrix3d::Identity();
    J.topLeftCorner<2, 2>() = -R_i_map;
    J(0, 2) = p_i.y();  // d(R^T p)/dyaw = (y, -x) of R^T p
    J(1, 2) = -p_i.x();
    *J_i = W * J;
  }
  if (J_j != nullptr) {
    Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
    J.topLeftCorner<2, 2>() = R_i_map;
    *J_j = W * J;
  }
  return W * Error(T_map_i, T_map_j);
}

}  // namespace seastitch
