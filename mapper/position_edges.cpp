#include "mapper/position_edges.hpp"

#include <Eigen/LU>

#include "common/core/pose.hpp"

namespace seastitch {

GraphEdge StartEdge(SubmapId submap, const NavState& frame, bool from_fix) {
  GraphEdge edge;
  edge.kind = from_fix ? EdgeKind::kPositionFix : EdgeKind::kDeadReckoning;
  edge.from = edge.to = submap;
  edge.T_from_to = LevelPose(frame.T_map_vehicle);
  edge.information.topLeftCorner<2, 2>() = frame.covariance.topLeftCorner<2, 2>().inverse();
  return edge;
}

GraphEdge FixEdge(SubmapId submap,
                  const NavState& frame,
                  const MapFix& fix,
                  const NavState& at_fix,
                  const Eigen::Matrix3d& covariance_frame_fix) {
  const Pose2 T_map_submap = LevelPose(frame.T_map_vehicle);
  const Eigen::Matrix2d R = T_map_submap.Rotation();
  const Eigen::Vector2d lever =
      LevelPose(at_fix.T_map_vehicle).Translation() - T_map_submap.Translation();  // map axes
  const Eigen::Matrix2d covariance =
      fix.covariance_m2 + R * covariance_frame_fix.topLeftCorner<2, 2>() * R.transpose();
  Eigen::Matrix<double, 2, 3> J;  // derivative of the fix by x, y, yaw of the submap
  J << Eigen::Matrix2d::Identity(), Eigen::Vector2d(-lever.y(), lever.x());
  const Eigen::Vector2d p = fix.north_east_m - lever;

  GraphEdge edge;
  edge.kind = EdgeKind::kPositionFix;
  edge.from = edge.to = submap;
  edge.T_from_to = {p.x(), p.y(), T_map_submap.yaw};
  edge.information = J.transpose() * covariance.inverse() * J;
  return edge;
}

}  // namespace seastitch
