#pragma once

#include <Eigen/Core>

#include "common/core/pose.hpp"

namespace seastitch {

// Pose of level frame b with respect to level frame a, with the covariance of (x, y [m], yaw [rad])
// in the axes of a.
struct RelativePose {
  Pose2 T_a_b;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Largest standard deviation over all directions.
double WorstSigma(const Eigen::Matrix2d& covariance);

// T_a_c of two independent relative poses, to first order.
RelativePose Compose(const RelativePose& a_b, const RelativePose& b_c);

}  // namespace seastitch
