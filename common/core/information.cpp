#include "common/core/information.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace seastitch {
namespace {

// Limits of the eigenvalues of the matrix scaled to a unit diagonal. Below kUnknownDirection a
// direction counts as unknown. Below -kIndefinite the matrix is not semi-definite; between both, a
// negative value is a rounding error.
constexpr double kUnknownDirection = 1e-12;
constexpr double kIndefinite = 1e-9;
constexpr double kAsymmetry = 1e-6;

// Square roots of the diagonal, 1 where it is zero. Dividing by them brings metres and radians to
// one scale.
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

}  // namespace seastitch
