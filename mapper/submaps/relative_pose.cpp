#include "mapper/submaps/relative_pose.hpp"

#include <cmath>

#include "mapper/submaps/eigenvalues.hpp"

template Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>&
Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>::compute(const Eigen::EigenBase<Eigen::Matrix2d>&,
                                                        int options);

namespace seastitch {

double WorstSigma(const Eigen::Matrix2d& covariance) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues()(1));
}

RelativePose Compose(const RelativePose& a_b, const RelativePose& b_c) {
  // p_ac = p_ab + R_ab p_bc, yaw_ac = yaw_ab + yaw_bc.
  const Eigen::Matrix2d R = a_b.T_a_b.Rotation();
  const Eigen::Vector2d p = R * b_c.T_a_b.Translation();
  Eigen::Matrix3d J_ab = Eigen::Matrix3d::Identity();
  J_ab(0, 2) = -p.y();
  J_ab(1, 2) = p.x();
  Eigen::Matrix3d J_bc = Eigen::Matrix3d::Identity();
  J_bc.topLeftCorner<2, 2>() = R;
  return {a_b.T_a_b * b_c.T_a_b,
          J_ab * a_b.covariance * J_ab.transpose() + J_bc * b_c.covariance * J_bc.transpose()};
}

}  // namespace seastitch
