#include "optimizer/solver/outlier_tests.hpp"
#include "common/core/median.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace seastitch {

// Innovation (I - w A)^-1 r, of covariance I + A (I - w A)^-1.
double NormalisedInnovation(const Eigen::Vector3d& residual,
                            const Eigen::Matrix3d& open,
                            double weight) {
  constexpr double kLeastRedundancy = 1e-7;  // below, no other factor measures this direction
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(open);
  const Eigen::Vector3d r = eigen.eigenvectors().transpose() * residual;
  double squared = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double a = std::max(eigen.eigenvalues()(k), 0.0);
    const double redundancy = std::max(1.0 - weight * a, kLeastRedundancy);
    const double innovation = r(k) / redundancy;
    squared += innovation * innovation / (1.0 + a / redundancy);
  }
  return squared;
}

// Uses the median, so that a few steps next to wrong closures do not count. In a single loop the
// innovations of all steps are equal, whether the closure is right or wrong. So fewer than kFew
// steps give 1, and the factor is bounded by kMost, the largest that surveys have shown.
double VarianceFactor(const FactorGraph& graph, const std::vector<double>& innovations) {
  constexpr double kMedian = 2.366;    // of chi-square, 3 degrees of freedom
  constexpr double kUnchecked = 1e-3;  // below, no closure checks the step
  constexpr std::size_t kFew = 10;
  constexpr double kMost = 4.0;
  std::vector<double> squared;
  for (std::size_t k = 0; k < innovations.size(); ++k)
    if (graph.factors[k].is_step && innovations[k] > kUnchecked) squared.push_back(innovations[k]);
  if (squared.size() < kFew) return 1.0;
  return std::clamp(Median(std::move(squared)) / kMedian, 1.0, kMost);
}

}  // namespace seastitch
