#include "common/core/pose.hpp"

#include <cmath>

namespace seastitch {

double WrapAngle(double rad) {
  if (rad >= -kPi && rad < kPi) return rad;
  const double wrapped = std::remainder(rad, 2.0 * kPi);
  return wrapped >= kPi ? -kPi : wrapped;
}

Eigen::Matrix3d RotationFromRpy(double roll_rad, double pitch_rad, double yaw_rad) {
  return (Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d RpyFromRotation(const Eigen::Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)),
          std::atan2(-R(2, 0), Hypotenuse(R(2, 1), R(2, 2))),
          std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Isometry3d MakePose(const Eigen::Vector3d& p, const Eigen::Matrix3d& R) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p;
  T.linear() = R;
  return T;
}

Eigen::Matrix2d Pose2::Rotation() const { return Eigen::Rotation2Dd(yaw).toRotationMatrix(); }

Pose2 operator*(const Pose2& T_a_b, const Pose2& T_b_c) {
  const Eigen::Vector2d p = T_a_b * T_b_c.Translation();
  return {p.x(), p.y(), WrapAngle(T_a_b.yaw + T_b_c.yaw)};
}

Pose2 Inverse(const Pose2& T_a_b) {
  const Eigen::Vector2d p = -(T_a_b.Rotation().transpose() * T_a_b.Translation());
  return {p.x(), p.y(), WrapAngle(-T_a_b.yaw)};
}

Eigen::Vector2d operator*(const Pose2& T_a_b, const Eigen::Vector2d& p_b) {
  return T_a_b.Rotation() * p_b + T_a_b.Translation();
}

Pose2 PoseBetween(const Pose2& a, const Pose2& b, double share) {
  return {a.x + share * (b.x - a.x),
          a.y + share * (b.y - a.y),
          WrapAngle(a.yaw + share * WrapAngle(b.yaw - a.yaw))};
}

Pose2 LevelPose(const Eigen::Isometry3d& T_map_body) {
  const auto& R = T_map_body.linear();
  return {T_map_body.translation().x(), T_map_body.translation().y(), std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Matrix3d LevelFromBody(const Eigen::Isometry3d& T_map_body) {
  const double yaw = LevelPose(T_map_body).yaw;
  return Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T_map_body.linear();
}

Eigen::Isometry3d WithLevelPose(const Eigen::Isometry3d& T_map_body, const Pose2& T_map_level) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(T_map_level.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      LevelFromBody(T_map_body);
  return MakePose({T_map_level.x, T_map_level.y, T_map_body.translation().z()}, R);
}

Eigen::Matrix3d RelativeCovariance(const Pose2& T_r_a,
                                   const Pose2& T_r_b,
                                   const Eigen::Matrix3d& cov_a,
                                   const Eigen::Matrix3d& cov_b,
                                   const Eigen::Matrix3d& cov_a_b) {
  // p_ab = Ra^T (pb - pa), yaw_ab = yaw_b - yaw_a.
  const Eigen::Matrix2d Rt = T_r_a.Rotation().transpose();
  const Eigen::Vector2d d = Rt * (T_r_b.Translation() - T_r_a.Translation());
  Eigen::Matrix3d Ja = Eigen::Matrix3d::Zero();
  Ja.topLeftCorner<2, 2>() = -Rt;
  Ja(0, 2) = d.y();
  Ja(1, 2) = -d.x();
  Ja(2, 2) = -1.0;
  Eigen::Matrix3d Jb = Eigen::Matrix3d::Identity();
  Jb.topLeftCorner<2, 2>() = Rt;
  const Eigen::Matrix3d cross = Ja * cov_a_b * Jb.transpose();
  return Ja * cov_a * Ja.transpose() + Jb * cov_b * Jb.transpose() + cross + cross.transpose();
}

}  // namespace seastitch
