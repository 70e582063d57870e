#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "common/core/pose.hpp"

// An overlap in blocks: what the residuals of their cells add to the gradient of the fit, and how
// the errors of submaps add to it. Parameters of the fit are (x, y [m], yaw [rad], height [m]) of
// the source, about the centre of the overlap, axes of the target.
namespace seastitch {

// Sums over the cells of one block, each by its weight w [1/m2]; r is the residual [m] and
// u = (-slope x, -slope y, 1) what a displacement or a lift of the source adds to it.
struct OverlapBlock {
  Eigen::Vector2d arm = Eigen::Vector2d::Zero();  // mean, from the centre of the overlap [m]
  double cells = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  // -w r u
  // w u J', with J what the parameters add to the residual.
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

  // J: row of the mean slope of both surfaces; apart: that of the target less that of the source
  // in (x, y, yaw). variance: of the residual, from soundings of unit variance. gradient: of the
  // parameters.
  void Add(const Eigen::Vector2d& arm,
           double weight,
           double variance,
           const Eigen::Vector4d& J,
           const Eigen::Vector3d& apart,
           const Eigen::Vector4d& gradient);

  // Of the whole overlap, by rising place: at most kMaxBlocks, neighbours merged where it is
  // large. white: covariance of the whole gradient by the soundings, as it is after smoothing;
  // sounding_variance [m2]: that it was made with.
  std::vector<OverlapBlock> Finish(const Eigen::Matrix4d& white,
                                   double sounding_variance,
                                   const Pose2& T_target_source,
                                   const Eigen::Vector2d& center_source) const;

  // The work of a likelihood grows with the cube of their number.
  static constexpr std::size_t kMaxBlocks = 28;

 private:
  using Key = std::pair<int, int>;
  std::map<Key, OverlapBlock> Merged(int factor) const;

  double block_m_;
  std::map<Key, OverlapBlock> blocks_;  // `arm`: a sum, until they are finished
  Key last_key_;
  OverlapBlock* last_ = nullptr;  // of last_key_: most cells lie in the block of the one before
};

// Covariances of the displacements of two blocks, axes of the target, by what both submaps walked
// from their frames on: of a position that walks 1 m/sqrt(m), which is the same in x and y, and of
// a heading that walks 1 rad/sqrt(m).
double PositionWalkCovariance(const OverlapBlock& a, const OverlapBlock& b);
Eigen::Matrix2d HeadingWalkCovariance(const OverlapBlock& a,
                                      const OverlapBlock& b,
                                      const Eigen::Matrix2d& R_target_source);
// Correlation of the height errors that soundings share.
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
