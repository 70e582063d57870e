#include "mapper/registration/known_directions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace seastitch {

double KnownDirections::Chi2(const SmallVector& coordinates) const {
  return coordinates.dot(covariance.ldlt().solve(coordinates));
}

double KnownDirections::Information() const {
  double sum = 0.0;
  if (rank() == 0) return sum;
  const SmallVector variances =
      Eigen::SelfAdjointEigenSolver<SmallMatrix>(covariance).eigenvalues();
  for (const double v : variances) sum += 0.5 * std::log1p(1.0 / std::max(v, 1e-12));
  return sum;
}

KnownDirections KnownDirectionsOf(const GridAligner& aligner,
                                  const Alignment& fit,
                                  const AlignmentInformation& info,
                                  const RegistrationPrior& prior,
                                  const RegistrationParams& params) {
  KnownDirections known;
  const Eigen::Matrix3d J = aligner.CenterJacobian(fit.at.T_target_source);
  const Eigen::Matrix3d L = (J * prior.covariance * J.transpose()).llt().matrixL();
  known.whiten = L.inverse();
  const Eigen::Matrix3d hessian = L.transpose() * info.hessian * L;
  const Eigen::Matrix3d noise = L.transpose() * info.noise_hessian * L;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(hessian);
  std::vector<int> columns;
  double open_slopes = 0.0;  // one-sided Hessian along the open directions
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d v = eigen.eigenvectors().col(i);
    const double along = v.dot(noise * v);
    if (eigen.eigenvalues()[i] > params.min_slope_significance * along / std::sqrt(fit.patches))
      columns.push_back(i);
    else
      open_slopes += eigen.eigenvalues()[i] + along;
  }
  known.directions = eigen.eigenvectors()(Eigen::all, columns);
  const SmallMatrix V = known.directions;
  const SmallMatrix uncoupled = (V.transpose() * hessian * V).inverse();
  known.gain = uncoupled * V.transpose() * L.transpose();
  known.covariance = known.gain * info.gradient_covariance * known.gain.transpose();
  // The open directions are uncertain by one prior sigma, and this couples into the known ones: a
  // pipe's direction is not known exactly, and the slopes along it differ at random between
  // patches. The covariance of the coupling is V^T H V open_slopes / patches.
  known.covariance += uncoupled * (open_slopes / fit.patches);
  const double position_variance = params.min_position_sigma_m * params.min_position_sigma_m;
  const SmallMatrix to_position = V.transpose() * known.whiten.leftCols<2>();
  known.covariance += position_variance * to_position * to_position.transpose();
  return known;
}

}  // namespace seastitch
