#pragma once

#include <Eigen/Core>
#include <optional>

namespace seastitch {

// Square root of an information matrix: W^T W = information, so that |W e|^2 = e^T information e
// for an error e. rank: number of directions with information (0 to 3).
struct SqrtInformation {
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  int rank = 0;
};

// Largest usable information [1/m2, 1/rad2]: a sigma of 10 um or 10 urad. A larger value is wrong,
// and a graph that has it beside large sigmas is ill-conditioned.
constexpr double kMaxInformation = 1e10;

// Square root of an information matrix of (x, y [m], yaw [rad]), which may be singular.
// std::nullopt if the matrix is not finite, not symmetric or not positive semi-definite, or if a
// diagonal entry exceeds kMaxInformation.
//
// Method: with S = sqrt(diagonal), the scaled matrix S^-1 information S^-1 = V D V^T gives
// W = sqrt(D) V^T S. A Cholesky factor would need full rank.
std::optional<SqrtInformation> FactorInformation(const Eigen::Matrix3d& information);

}  // namespace seastitch
