#include "optimizer/relative_pose_cost.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace seastitch {
namespace {

// Of the unit-diagonal matrix. Below the first, a direction counts as unknown; below minus the
// second, it is no rounding error but a matrix that is not semi-definite.
constexpr double kUnknownDirection = 1e-12;
constexpr double kIndefinite = 1e-9;
constexpr double kAsymmetry = 1e-6;

// Square roots of the diagonal, 1 where it is zero: what brings metres and radians to one scale.
Eigen::Vector3d DiagonalScale(const Eigen::Matrix3d& information) {
  Eigen::Vector3d scale = information.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0.0 ? s : 1.0;
  return scale;
}

bool DiagonalIsUsable(const Eigen::Matrix3d& information) {
  return information.allFinite() && information.diagonal().minCoeff() >= 0.0 &&
         information.diagonal().maxCoeff() <= kMaxInformation;
}

}  // namespace

std::optional<SqrtInformation> FactorInformation(const Eigen::Matrix3d& information) {
  if (!DiagonalIsUsable(information)) return std::nullopt;
  const Eigen::Vector3d scale = DiagonalScale(information);
  const Eigen::Matrix3d unit =
      scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
  if ((unit - unit.transpose()).cwiseAbs().maxCoeff() > kAsymmetry) return std::nullopt;

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (unit + unit.transpose()));
  const Eigen::Vector3d values = eigen.eigenvalues();
  if (values.minCoeff() < -kIndefinite) return std::nullopt;

  SqrtInformation root;
  for (int k = 0; k < 3; ++k) {
    if (values(k) <= kUnknownDirection) continue;
    root.W.row(k) = std::sqrt(values(k)) * eigen.eigenvectors().col(k).cwiseProduct(scale);
    ++root.rank;
  }
  return root;
}

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
