#pragma once

#include <Eigen/Core>

#include "common/core/pose.hpp"

namespace seastitch {

// Where one level frame stands seen from another, and how well that is known: covariance of
// (x, y [m], yaw [rad]) in the axes of the frame it is seen from.
struct RelativePose {
  Pose2 T_a_b;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// One sigma in the direction in which it is largest.
double WorstSigma(const Eigen::Matrix2d& covariance);

// T_a_c of two independent relative poses, to first order.
RelativePose Compose(const RelativePose& a_b, const RelativePose& b_c);

}  // namespace seastitch
