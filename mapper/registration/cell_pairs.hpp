#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mapper/registration/grid_alignment.hpp"
#include "mapper/registration/height_grid.hpp"
#include "mapper/registration/smoothing.hpp"

// Sums over the cells of an overlap.
namespace seastitch {

// Huber's bound in sigma. It affects 1 % of Gaussian residuals, and bounds the influence of a wreck
// or a shoal of fish that only one submap saw.
constexpr double kHuberSigma = 2.5;

inline const double kPatchCells = SmoothingKernel().PatchCells();

inline Eigen::Vector4d Row(const Eigen::Vector2d& slope, const Eigen::Vector2d& arm) {
  // Residual = source height + shift - target height; turning by dyaw moves arm by dyaw x arm.
  return {-slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x(), 1.0};
}

// One cell of the source over the target.
struct CellPair {
  int row;
  int col;
  CellsAround around;
  Eigen::Vector2d arm;  // from the source's centre, in the target's axes
  Eigen::Vector2d slope_target;
  Eigen::Vector2d slope_source;  // in the target's axes
  double height_target;
  double height_source;      // shifted
  double variance_both;      // of the residual, from soundings of unit variance where noise is 1
  double residual;           // [m]
  double expected_variance;  // of the residual [m2]
  double weight;             // inverse variance of an independent cell's share
  Eigen::Vector2d chance;    // mean of residual times slope that the noise of soundings makes [m]

  Eigen::Vector2d MeanSlope() const { return 0.5 * (slope_target + slope_source); }
  // The residual's part of the gradient, per weight. Where the soundings lie to one side of a cell,
  // at the rim of a submap, the errors of its height and of its slope are one error: left in, it
  // would pull every pair closer together. J: Row() of the mean slope.
  Eigen::Vector4d Pull(const Eigen::Vector4d& J) const {
    const Eigen::Vector4d by_chance(
        -chance.x(), -chance.y(), chance.x() * arm.y() - chance.y() * arm.x(), 0.0);
    return by_chance - residual * J;
  }
  // Row of the target less that of the source: of x, y and yaw, since they agree on the height.
  Eigen::Vector3d RowsApart() const {
    const Eigen::Vector2d slope = slope_target - slope_source;
    return {-slope.x(), -slope.y(), slope.x() * arm.y() - slope.y() * arm.x()};
  }
  double RobustWeight(double noise_scale) const {
    const double bound = kHuberSigma * kHuberSigma * noise_scale * expected_variance;
    return residual * residual <= bound ? 1.0 : std::sqrt(bound) / std::abs(residual);
  }
};

// Weighted mean and variance of values.
struct WeightedMoments {
  double weight = 0.0;
  double sum = 0.0;
  double square = 0.0;
  void Add(double w, double v) {
    weight += w;
    sum += w * v;
    square += w * v * v;
  }
  double Variance() const {
    return std::max(0.0, square / weight - (sum / weight) * (sum / weight));
  }
};

// The columns, of `cols` that begin at `start` and lie `step` apart, that come to lie on a grid,
// and at most one more on either side.
inline std::pair<int, int> ColumnsOver(const GridGeometry& g,
                                       const Eigen::Vector2d& start,
                                       const Eigen::Vector2d& step,
                                       int cols) {
  const Eigen::Vector2d size = g.cell_m * Eigen::Vector2d(g.rows, g.cols);
  double first = 0.0;
  double last = cols - 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = g.origin[axis] - start[axis];
    const double high = low + size[axis];
    if (std::abs(step[axis]) < 1e-9 * g.cell_m) {
      if (low > 0.0 || high < 0.0) return {0, -1};
      continue;
    }
    const auto [near, far] = std::minmax({low / step[axis], high / step[axis]});
    first = std::max(first, std::floor(near));
    last = std::min(last, std::ceil(far));
  }
  if (!(first <= last)) return {0, -1};
  return {static_cast<int>(first), static_cast<int>(last)};
}

template <class Visit>
void GridAligner::ForEachCell(const Hypothesis& at, Visit visit) const {
  const GridGeometry& g = source_.grid.geometry();
  const Eigen::Matrix2d R = at.T_target_source.Rotation();
  const Eigen::Vector2d center_target = at.T_target_source * center_source_;
  const double shift = prior_.z_m + at.shift_m;
  const double patch_variance = sounding_variance_ / kPatchCells;
  HeightSample sample;
  CellPair pair;
  const Eigen::Vector2d along_row = R.col(1) * g.cell_m;
  for (pair.row = 0; pair.row < g.rows; ++pair.row) {
    const Eigen::Vector2d first_arm = R * (g.Center(pair.row, 0) - center_source_);
    const auto [first, last] =
        ColumnsOver(target_.grid.geometry(), center_target + first_arm, along_row, g.cols);
    for (pair.col = first; pair.col <= last; ++pair.col) {
      const RegistrationSubmap::Cell& cell = source_.grid(pair.row, pair.col);
      if (!(cell.variance > 0.0f)) continue;
      pair.arm = first_arm + pair.col * along_row;
      if (!Interpolate(target_.grid, center_target + pair.arm, &pair.around, &sample)) continue;
      pair.slope_target = sample.slope;
      pair.slope_source = R.col(0) * cell.slope_x + R.col(1) * cell.slope_y;
      pair.height_target = sample.height_m;
      pair.height_source = cell.height_m + shift;
      pair.variance_both = cell.variance + sample.variance;
      pair.residual = pair.height_source - pair.height_target;
      pair.expected_variance = patch_variance * pair.variance_both + shared_variance_;
      pair.weight = 1.0 / (kPatchCells * pair.expected_variance);
      pair.chance =
          0.5 * patch_variance *
          (R.col(0) * cell.covariance_x + R.col(1) * cell.covariance_y - sample.covariance);
      visit(pair);
    }
  }
}

// Normal equations of the height residuals, by position of the centre [m], yaw [rad], shift [m].
struct GridAligner::NormalEquations {
  Eigen::Matrix4d hessian_mean = Eigen::Matrix4d::Zero();
  Eigen::Matrix3d hessian_apart = Eigen::Matrix3d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  double cells = 0.0;
  double radius_m = 0.0;  // root mean square of the arms
  double noise_scale = 1.0;
  double expected_variance = 0.0;
  WeightedMoments target;
  WeightedMoments source;
  WeightedMoments difference;

  // Symmetric part of the rows of one surface times those of the other.
  Eigen::Matrix4d HessianCross() const {
    Eigen::Matrix4d cross = hessian_mean;
    cross.topLeftCorner<3, 3>() -= 0.25 * hessian_apart;
    return cross;
  }
};

template <class Also>
GridAligner::NormalEquations GridAligner::Accumulate(const Hypothesis& at,
                                                     double noise_scale,
                                                     Also also) const {
  NormalEquations n;
  double arms = 0.0;
  double robust = 0.0;
  ForEachCell(at, [&](const CellPair& p) {
    const double psi = p.RobustWeight(noise_scale);
    const double w = p.weight * psi;
    const Eigen::Vector4d J = Row(p.MeanSlope(), p.arm);
    const Eigen::Vector3d apart = p.RowsApart();
    const Eigen::Vector4d pull = w * p.Pull(J);
    n.hessian_mean.noalias() += (w * J) * J.transpose();
    n.hessian_apart.noalias() += (w * apart) * apart.transpose();
    n.gradient += pull;
    arms += p.arm.squaredNorm();
    robust += psi;
    n.cells += 1.0;
    n.target.Add(p.weight, p.height_target);
    n.source.Add(p.weight, p.height_source);
    n.difference.Add(w, p.residual);
    also(p, psi, J, apart, pull);
  });
  if (n.cells == 0.0) return n;
  n.radius_m = std::sqrt(arms / n.cells);
  n.noise_scale = std::max(kPatchCells * n.difference.square / robust, 0.01);
  n.expected_variance = n.cells / (kPatchCells * n.target.weight);
  return n;
}

}  // namespace seastitch
