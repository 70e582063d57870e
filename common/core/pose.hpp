#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

// Frames: map = local North-East-Down; vehicle = Forward-Right-Down. T_a_b takes b coordinates to
// a. A gravity-levelled frame ("level") shares origin and yaw with its body frame; its z is the
// map's.
namespace seastitch {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kPi = 3.14159265358979323846;
constexpr double Deg2Rad(double deg) { return deg * (kPi / 180.0); }
constexpr double Rad2Deg(double rad) { return rad * (180.0 / kPi); }

// Root of a^2 + b^2. glibc rounds std::hypot, std::cbrt and std::erf differently on x86-64 and on
// arm64; this it rounds alike.
inline double Hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }

// The same angle in [-pi, pi).
double WrapAngle(double rad);

// Roll, pitch, yaw [rad], applied as Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d RotationFromRpy(double roll_rad, double pitch_rad, double yaw_rad);
Eigen::Vector3d RpyFromRotation(const Eigen::Matrix3d& R);

Eigen::Isometry3d MakePose(const Eigen::Vector3d& p, const Eigen::Matrix3d& R);

// The three degrees of freedom that registration and graph may move: x, y [m] and yaw [rad].
struct Pose2 {
  double x = 0.0;
  double y = 0.0;
  double yaw = 0.0;

  Eigen::Vector2d Translation() const { return {x, y}; }
  Eigen::Vector3d Vector() const { return {x, y, yaw}; }
  Eigen::Matrix2d Rotation() const;
};

Pose2 operator*(const Pose2& T_a_b, const Pose2& T_b_c);  // T_a_c
Pose2 Inverse(const Pose2& T_a_b);                        // T_b_a
Eigen::Vector2d operator*(const Pose2& T_a_b, const Eigen::Vector2d& p_b);
// The pose between two others, linear in x, y and yaw. share: 0 for a, 1 for b.
Pose2 PoseBetween(const Pose2& a, const Pose2& b, double share);

// x, y, yaw of a pose: where its level frame stands.
Pose2 LevelPose(const Eigen::Isometry3d& T_map_body);

// Rotation from the body axes to the level axes of the same pose: roll and pitch alone.
Eigen::Matrix3d LevelFromBody(const Eigen::Isometry3d& T_map_body);

// The pose with its x, y, yaw replaced; z, roll and pitch stay to the last bit of meaning.
Eigen::Isometry3d WithLevelPose(const Eigen::Isometry3d& T_map_body, const Pose2& T_map_level);

// Covariance (x, y, yaw) of T_a_b from the covariances of T_r_a and T_r_b and their
// cross-covariance cov_a_b (rows a, columns b), to first order:
// that of Inverse(T_r_a) * T_r_b, in the axes of a.
Eigen::Matrix3d RelativeCovariance(const Pose2& T_r_a,
                                   const Pose2& T_r_b,
                                   const Eigen::Matrix3d& cov_a,
                                   const Eigen::Matrix3d& cov_b,
                                   const Eigen::Matrix3d& cov_a_b);

}  // namespace seastitch
