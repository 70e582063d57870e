#include "common/core/mounting.hpp"

namespace seastitch {
namespace {

// Displacement [m, level frame] of a sounding x_m ahead of the frame, per radian of dvl_yaw_rad: to
// starboard.
Eigen::Vector2d ShearOf(double x_m) { return {0.0, x_m}; }

}  // namespace

bool MountingSigmas::AreUsable() const {
  return sonar_m >= 0.0 && sonar_m <= 10.0 && dvl_yaw_rad >= 0.0 && dvl_yaw_rad <= kPi;
}

Pose2 SoundingPose(const Pose2& T_map_vehicle, const MountingErrors& errors) {
  return T_map_vehicle * Pose2{errors.sonar_m.x(), errors.sonar_m.y(), 0.0};
}

Pose2 VehiclePose(const Pose2& T_map_level, const MountingErrors& errors) {
  return T_map_level * Pose2{-errors.sonar_m.x(), -errors.sonar_m.y(), 0.0};
}

Pose2 TravelledPose(const Pose2& T_from_to, const MountingErrors& errors) {
  const Eigen::Vector2d p =
      Pose2{0.0, 0.0, errors.dvl_yaw_rad}.Rotation() * T_from_to.Translation();
  return {p.x(), p.y(), T_from_to.yaw};
}

Eigen::Vector2d Shear(const Eigen::Vector2d& p_level_m, double dvl_yaw_rad) {
  return dvl_yaw_rad * ShearOf(p_level_m.x());
}

Eigen::Matrix3d StraightFromBody(const Eigen::Isometry3d& T_map_submap, double added_yaw_rad) {
  Eigen::Matrix3d sheared = Eigen::Matrix3d::Identity();
  sheared.topLeftCorner<2, 1>() += added_yaw_rad * ShearOf(1.0);
  return sheared * LevelFromBody(T_map_submap);
}

Eigen::Matrix3d DeadReckoningByMounting(const Pose2& T_from_to) {
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();
  by.topLeftCorner<2, 2>() = T_from_to.Rotation() - Eigen::Matrix2d::Identity();
  by.topRightCorner<2, 1>() << -T_from_to.y, T_from_to.x;
  return by;
}

Eigen::Matrix3d LoopClosureByMounting(const Pose2& T_from_to,
                                      const Eigen::Vector2d& center_from_m) {
  return LoopClosureByMountingOfFrom(center_from_m) +
         LoopClosureByMountingOfTo(T_from_to, center_from_m);
}

Eigen::Matrix3d LoopClosureByMountingOfFrom(const Eigen::Vector2d& center_from_m) {
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();
  by.topRightCorner<2, 1>() = ShearOf(center_from_m.x());
  return by;
}

Eigen::Matrix3d LoopClosureByMountingOfTo(const Pose2& T_from_to,
                                          const Eigen::Vector2d& center_from_m) {
  const Eigen::Vector2d center_to_m = Inverse(T_from_to) * center_from_m;
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();
  by.topRightCorner<2, 1>() = -(T_from_to.Rotation() * ShearOf(center_to_m.x()));
  return by;
}

Eigen::Matrix3d PositionByMounting(double yaw_rad) {
  Eigen::Matrix3d by = Eigen::Matrix3d::Zero();
  by.topLeftCorner<2, 2>() = Pose2{0.0, 0.0, yaw_rad}.Rotation();
  return by;
}

}  // namespace seastitch
