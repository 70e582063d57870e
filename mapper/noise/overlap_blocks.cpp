#include "mapper/noise/overlap_blocks.hpp"

#include <algorithm>
#include <cmath>

#include "mapper/noise/variance_components.hpp"

namespace seastitch {
namespace {

// Smallest block [m, cells]: several independent patches of smoothed cells, and more than one or
// two pings.
constexpr double kMinBlockM = 4.0;
constexpr double kMinBlockCells = 8.0;
// Factor of variance: cells in different blocks share smoothing, so that a sum over blocks is a
// little less certain than the blocks by themselves.
constexpr double kSharedSmoothing = 1.02;

// Covariance of two values, at a and b, of a random walk of unit rate that starts at 0.
double Shared(double a, double b) { return a * b > 0.0 ? std::min(std::abs(a), std::abs(b)) : 0.0; }

// Heading as a random walk of unit rate along x, from 0: E[yaw(x) times its integral from 0 to
// `to`].
double WalkTimesIntegral(double x, double to) {
  return to <= x ? 0.5 * to * to : 0.5 * x * x + x * (to - x);
}

// Covariance of the displacements at p and q by a heading error psi(x), x along the track. It
// displaces a point at (x, y) by (-y psi, integral of psi).
Eigen::Matrix2d HeadingWalkOfOne(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  if (!(p.x() * q.x() > 0.0)) return Eigen::Matrix2d::Zero();
  const double a = std::abs(p.x());
  const double b = std::abs(q.x());
  const double least = std::min(a, b);
  const double most = std::max(a, b);
  const double sign = p.x() > 0.0 ? 1.0 : -1.0;
  Eigen::Matrix2d K;
  K(0, 0) = p.y() * q.y() * least;
  K(0, 1) = -p.y() * sign * WalkTimesIntegral(a, b);
  K(1, 0) = -q.y() * sign * WalkTimesIntegral(b, a);
  K(1, 1) = least * least * (3.0 * most - least) / 6.0;
  return K;
}

void Merge(const OverlapBlock& from, OverlapBlock* into) {
  into->arm += from.arm;
  into->cells += from.cells;
  into->gradient += from.gradient;
  into->hessian += from.hessian;
  into->white += from.white;
}

int Divided(int a, int b) {
  return static_cast<int>(std::floor(static_cast<double>(a) / static_cast<double>(b)));
}

// Scales the blocks' white noise so that its sum is that of the whole overlap. Smoothing leaves the
// mean slope of a block unchanged; it reduces deviations from the mean, by the same factor in all
// blocks.
void SmoothWhite(const Eigen::Matrix4d& whole, std::vector<OverlapBlock>* blocks) {
  double shared = 0.0;
  double apart = 0.0;
  const auto mean_of = [](const OverlapBlock& b) {
    return Eigen::Vector3d(b.white.col(2) / b.white(2, 2));
  };
  for (const OverlapBlock& b : *blocks) {
    const double of_mean = b.white(2, 2) * mean_of(b).head<2>().squaredNorm();
    shared += of_mean;
    apart += b.white(0, 0) + b.white(1, 1) - of_mean;
  }
  const double left = whole(0, 0) + whole(1, 1) - shared;
  const double part = apart > 0.0 ? std::clamp(left / apart, 0.02, 1.0) : 1.0;
  for (OverlapBlock& b : *blocks) {
    const Eigen::Vector3d mean = mean_of(b);
    const Eigen::Matrix3d by_mean = b.white(2, 2) * mean * mean.transpose();
    b.white = by_mean + part * (b.white - by_mean);
    b.white.diagonal() *= kSharedSmoothing;
  }
}

}  // namespace

OverlapBlocks::OverlapBlocks(double cell_m)
    : block_m_(std::max(kMinBlockM, kMinBlockCells * cell_m)) {}

void OverlapBlocks::Add(const Eigen::Vector2d& arm,
                        double weight,
                        double variance,
                        const Eigen::Vector4d& J,
                        const Eigen::Vector3d& apart,
                        const Eigen::Vector4d& gradient) {
  const Key key{static_cast<int>(std::floor(arm.x() / block_m_)),
                static_cast<int>(std::floor(arm.y() / block_m_))};
  if (last_ == nullptr || key != last_key_) last_ = &blocks_[last_key_ = key];
  OverlapBlock& block = *last_;
  const Eigen::Vector3d u(J[0], J[1], 1.0);
  block.arm += arm;
  block.cells += 1.0;
  block.gradient += Eigen::Vector3d(gradient[0], gradient[1], gradient[3]);
  block.hessian.noalias() += (weight * u) * J.transpose();
  // Products of slopes of the two surfaces, as in the Hessian of the fit.
  block.hessian.topLeftCorner<2, 3>().noalias() -=
      (0.25 * weight * apart.head<2>()) * apart.transpose();
  block.white.noalias() += (weight * weight * variance * u) * u.transpose();
}

std::map<OverlapBlocks::Key, OverlapBlock> OverlapBlocks::Merged(int factor) const {
  std::map<Key, OverlapBlock> merged;
  for (const auto& [key, block] : blocks_)
    Merge(block, &merged[{Divided(key.first, factor), Divided(key.second, factor)}]);
  return merged;
}

std::vector<OverlapBlock> OverlapBlocks::Finish(const Eigen::Matrix4d& white,
                                                double sounding_variance,
                                                const Pose2& T_target_source,
                                                const Eigen::Vector2d& center_source) const {
  int factor = 1;
  std::map<Key, OverlapBlock> merged = Merged(factor);
  while (merged.size() > kMaxBlocks) merged = Merged(++factor);
  const Eigen::Matrix2d R = T_target_source.Rotation();
  const Eigen::Vector2d center_target = T_target_source * center_source;
  std::vector<OverlapBlock> blocks;
  for (auto& [key, block] : merged) {
    block.arm /= block.cells;
    block.white *= sounding_variance;
    block.in_target = center_target + block.arm;
    block.in_source = center_source + R.transpose() * block.arm;
    blocks.push_back(block);
  }
  SmoothWhite(white, &blocks);
  return blocks;
}

double PositionWalkCovariance(const OverlapBlock& a, const OverlapBlock& b) {
  return Shared(a.in_source.x(), b.in_source.x()) + Shared(a.in_target.x(), b.in_target.x());
}

Eigen::Matrix2d HeadingWalkCovariance(const OverlapBlock& a,
                                      const OverlapBlock& b,
                                      const Eigen::Matrix2d& R_target_source) {
  return R_target_source * HeadingWalkOfOne(a.in_source, b.in_source) *
             R_target_source.transpose() +
         HeadingWalkOfOne(a.in_target, b.in_target);
}

double HeightErrorCorrelation(const OverlapBlock& a, const OverlapBlock& b) {
  return std::exp(-(a.arm - b.arm).norm() / kErrorCorrelationLengthM);
}

GradientCovariance GradientCovarianceOf(const std::vector<OverlapBlock>& blocks,
                                        const Eigen::Matrix2d& R_target_source) {
  GradientCovariance sum;
  for (const OverlapBlock& a : blocks) {
    const Eigen::Matrix<double, 4, 2> displaced = a.hessian.topRows<2>().transpose();
    const Eigen::Vector4d lifted = a.hessian.row(2).transpose();
    // Sums over b first: a's part is then multiplied once.
    Eigen::Vector4d by_height = Eigen::Vector4d::Zero();
    Eigen::Matrix<double, 2, 4> by_position = Eigen::Matrix<double, 2, 4>::Zero();
    Eigen::Matrix<double, 2, 4> by_heading = Eigen::Matrix<double, 2, 4>::Zero();
    for (const OverlapBlock& b : blocks) {
      by_height += HeightErrorCorrelation(a, b) * b.hessian.row(2).transpose();
      by_position += PositionWalkCovariance(a, b) * b.hessian.topRows<2>();
      by_heading += HeadingWalkCovariance(a, b, R_target_source) * b.hessian.topRows<2>();
    }
    sum.correlated_error.noalias() += lifted * by_height.transpose();
    sum.position_walk.noalias() += displaced * by_position;
    sum.heading_walk.noalias() += displaced * by_heading;
  }
  return sum;
}

}  // namespace seastitch
