#pragma once

#include <Eigen/Core>
#include <optional>

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

}  // namespace seastitch
