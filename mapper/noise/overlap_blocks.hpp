#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "common/core/pose.hpp"

// The blocks of an overlap: contributions of their cells' residuals to the gradient of the fit, and
// the effect of the submaps' errors on them. Parameters of the fit are (x, y [m], yaw [rad], height
// [m]) of the source, about the centre of the overlap, axes of the target.
namespace seastitch {

// Sums over the cells of one block, each with its weight w [1/m2]; r is the residual [m], and
// u = (-slope x, -slope y, 1) its derivative with respect to a displacement or a lift of the
// source.
struct OverlapBlock {
  Eigen::Vector2d arm = Eigen::Vector2d::Zero();  // mean, from the centre of the overlap [m]
  double cells = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  // -w r u
  // Sum of w u J', with J the derivative of the residual with respect to the parameters.
  Eigen::Matrix<double, 3, 4> hessian = Eigen::Matrix<double, 3, 4>::Zero();
  // Covariance of `gradient` by white noise of the soundings.
  Eigen::Matrix3d white = Eigen::Matrix3d::Zero();
  // Where the block lies in the level frames [m].
  Eigen::Vector2d in_target = Eigen::Vector2d::Zero();
  Eigen::Vector2d in_source = Eigen::Vector2d::Zero();
};

// Collects the cells of an overlap by blocks.
class OverlapBlocks {
 public:
  explicit OverlapBlocks(double cell_m);

  // J: Jacobian row by the mean slope of both surfaces; apart: row by the target's slope minus row
  // by the source's, in (x, y, yaw). variance: of the residual, for soundings of unit variance.
  // gradient: of the log-likelihood with respect to the parameters.
  void Add(const Eigen::Vector2d& arm,
           double weight,
           double variance,
           const Eigen::Vector4d& J,
           const Eigen::Vector3d& apart,
           const Eigen::Vector4d& gradient);

  // Blocks of the whole overlap in order of place, at most kMaxBlocks: neighbours are merged where
  // it is large. white: covariance of the whole gradient by the soundings' noise, after smoothing;
  // sounding_variance: the variance of a sounding in it [m2].
  std::vector<OverlapBlock> Finish(const Eigen::Matrix4d& white,
                                   double sounding_variance,
                                   const Pose2& T_target_source,
                                   const Eigen::Vector2d& center_source) const;

  // Maximum number of blocks: the work of a likelihood grows with the cube of it.
  static constexpr std::size_t kMaxBlocks = 28;

 private:
  using Key = std::pair<int, int>;
  std::map<Key, OverlapBlock> Merged(int factor) const;

  double block_m_;
  std::map<Key, OverlapBlock> blocks_;  // `arm` is a sum until Finish()
  Key last_key_;
  // block of last_key_: most cells are in the same block as the cell before
  OverlapBlock* last_ = nullptr;
};

// Covariances of the displacements of two blocks, axes of the target, by the random walks of both
// submaps since their frames: for a walk of position of 1 m/sqrt(m), the same in x and y, and for a
// walk of heading of 1 rad/sqrt(m).
double PositionWalkCovariance(const OverlapBlock& a, const OverlapBlock& b);
Eigen::Matrix2d HeadingWalkCovariance(const OverlapBlock& a,
                                      const OverlapBlock& b,
                                      const Eigen::Matrix2d& R_target_source);
// Correlation of the correlated height errors (VarianceComponents) of two blocks.
double HeightErrorCorrelation(const OverlapBlock& a, const OverlapBlock& b);

// Covariance of the gradient of the whole overlap by source of error, each for one unit of it.
struct GradientCovariance {
  Eigen::Matrix4d white = Eigen::Matrix4d::Zero();             // soundings of variance 1 m2
  Eigen::Matrix4d correlated_error = Eigen::Matrix4d::Zero();  // 1 m
  Eigen::Matrix4d position_walk = Eigen::Matrix4d::Zero();     // 1 m/sqrt(m)
  Eigen::Matrix4d heading_walk = Eigen::Matrix4d::Zero();      // 1 rad/sqrt(m)
};
// Without `white`.
GradientCovariance GradientCovarianceOf(const std::vector<OverlapBlock>& blocks,
                                        const Eigen::Matrix2d& R_target_source);

}  // namespace seastitch
