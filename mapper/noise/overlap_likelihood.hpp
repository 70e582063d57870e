#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/noise/overlap_blocks.hpp"
#include "mapper/noise/variance_components.hpp"

// Restricted likelihood (REML: Patterson and Thompson, Biometrika 58, 1971) of an overlap's
// residuals, on a grid of the three components that they distinguish.
namespace seastitch {

// Values of one component, each twice the one before.
struct ComponentAxis {
  double first;
  std::size_t size;
  double At(std::size_t i) const;
};
inline constexpr ComponentAxis kErrorRatioAxis{0.0003 / 128.0, 13};
inline constexpr ComponentAxis kPositionWalkAxis{0.00025, 7};
inline constexpr ComponentAxis kHeadingWalkAxis{2.5e-5, 7};

// By correlated_error_ratio, position_walk, heading_walk; the last runs fastest.
class LikelihoodTable {
 public:
  static constexpr std::size_t kSize =
      kErrorRatioAxis.size * kPositionWalkAxis.size * kHeadingWalkAxis.size;
  static std::size_t Index(std::size_t s, std::size_t q, std::size_t p) {
    return (s * kPositionWalkAxis.size + q) * kHeadingWalkAxis.size + p;
  }
  double operator()(std::size_t s, std::size_t q, std::size_t p) const {
    return values_[Index(s, q, p)];
  }
  void Set(std::size_t s, std::size_t q, std::size_t p, double value) {
    values_[Index(s, q, p)] = static_cast<float>(value);
  }
  std::array<float, kSize>& values() { return values_; }
  const std::array<float, kSize>& values() const { return values_; }

 private:
  std::array<float, kSize> values_{};
};

// -2 ln L of the blocks' gradients, up to a constant. The gradient of a block is its Hessian times
// the unknown error d of the relative pose and height, plus errors:
//   g = A d + e,  cov e = W + s^2 altitude^2 A_z R A_z' + A_xy (q^2 U + p^2 P) A_xy'
// with the correlations of heights R and of walks U, P. The restricted likelihood is free of d:
//   -2 ln L = ln |C| + ln |A' C^-1 A| + g' (C^-1 - C^-1 A (A' C^-1 A)^-1 A' C^-1) g.
// altitude_m: root of the sum of squares of the two altitudes. All zero where the overlap has too
// few blocks. Computed at every second value of both walks, cubic in their logarithms between.
LikelihoodTable RestrictedLikelihood(const std::vector<OverlapBlock>& blocks,
                                     const Eigen::Matrix2d& R_target_source,
                                     double altitude_m);

// Likelihood of the survey's components by one overlap, as -2 ln of a density bounded below.
// Components of one overlap are log-normal about the survey's (sigma 0.5 of the natural logarithm);
// one overlap in ten is an outlier. No pair dominates, however certain it is.
LikelihoodTable BoundedLikelihood(const LikelihoodTable& likelihood);

}  // namespace seastitch
