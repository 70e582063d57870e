#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <random>
#include <vector>

#include "common/core/pose.hpp"
#include "mapper/noise/overlap_blocks.hpp"
#include "mapper/noise/variance_components.hpp"

// Overlaps with errors drawn from the model of docs/noise-from-overlaps.md, step by step along the
// track: none of the covariances of the production code is used.
namespace seastitch {

// Random walk of unit rate along the track from x = 0, in both directions, and its integral.
class SimulatedWalk {
 public:
  static constexpr double kStepM = 0.2;
  static constexpr std::size_t kSteps = 360;

  explicit SimulatedWalk(std::mt19937_64* random) : forward_(random), backward_(random) {}
  // x: rounded to a step.
  double At(double x) const { return Side(x).value[IndexOf(x)]; }
  // From 0 to x.
  double IntegralTo(double x) const { return std::copysign(1.0, x) * Side(x).integral[IndexOf(x)]; }

 private:
  struct OneSide {
    explicit OneSide(std::mt19937_64* random) : value(kSteps, 0.0), integral(kSteps, 0.0) {
      std::normal_distribution<double> step(0.0, std::sqrt(kStepM));
      for (std::size_t i = 1; i < kSteps; ++i) {
        value[i] = value[i - 1] + step(*random);
        integral[i] = integral[i - 1] + 0.5 * kStepM * (value[i - 1] + value[i]);
      }
    }
    std::vector<double> value;
    std::vector<double> integral;
  };
  const OneSide& Side(double x) const { return x < 0.0 ? backward_ : forward_; }
  static std::size_t IndexOf(double x) {
    return static_cast<std::size_t>(std::llround(std::abs(x) / kStepM));
  }
  OneSide forward_;
  OneSide backward_;
};

// Errors of one submap inside it: x along the track.
class SimulatedDrift {
 public:
  explicit SimulatedDrift(std::mt19937_64* random) : x_(random), y_(random), heading_(random) {}
  // Displacement of a point [m], axes of the submap, for a walk of 1 m/sqrt(m).
  Eigen::Vector2d ByPosition(const Eigen::Vector2d& p) const {
    return {x_.At(p.x()), y_.At(p.x())};
  }
  // The same for a walk of the heading of 1 rad/sqrt(m): the track runs off to the side, and the
  // swath is turned about it.
  Eigen::Vector2d ByHeading(const Eigen::Vector2d& p) const {
    return {-p.y() * heading_.At(p.x()), heading_.IntegralTo(p.x())};
  }

 private:
  SimulatedWalk x_;
  SimulatedWalk y_;
  SimulatedWalk heading_;
};

inline OverlapBlock BlockAt(const Pose2& T_target_source, const Eigen::Vector2d& in_target) {
  OverlapBlock block;
  block.in_target = in_target;
  block.in_source =
      T_target_source.Rotation().transpose() * (in_target - T_target_source.Translation());
  return block;
}

// Blocks of 6 m over a seabed with slopes, without errors: gradients are zero.
inline std::vector<OverlapBlock> BlocksWithoutErrors(const Pose2& T_target_source,
                                                     const Eigen::Vector2d& center_target,
                                                     int along,
                                                     int across,
                                                     std::mt19937_64* random) {
  std::normal_distribution<double> unit(0.0, 1.0);
  std::vector<OverlapBlock> blocks;
  for (int i = 0; i < along * across; ++i) {
    const Eigen::Vector2d arm(6.0 * (i / across) - 3.0 * (along - 1),
                              6.0 * (i % across) - 3.0 * (across - 1));
    OverlapBlock block = BlockAt(T_target_source, center_target + arm);
    block.arm = arm;
    block.cells = 36.0;
    const Eigen::Vector2d mean(0.3 * unit(*random), 0.3 * unit(*random));
    for (int cell = 0; cell < 36; ++cell) {
      const double weight = 1000.0 + 300.0 * unit(*random);  // 1 / (3 cm)^2
      const Eigen::Vector3d u(
          -mean.x() + 0.1 * unit(*random), -mean.y() + 0.1 * unit(*random), 1.0);
      const double by_yaw = -u.x() * arm.y() + u.y() * arm.x();
      block.hessian += weight * u * Eigen::RowVector4d(u.x(), u.y(), by_yaw, 1.0);
      block.white += weight * u * u.transpose();
    }
    blocks.push_back(block);
  }
  return blocks;
}

// Draws the gradients of the blocks: of a wrong placement, of white noise, and of the three
// components that a likelihood has.
inline void DrawErrors(const VarianceComponents& truth,
                       double altitude_m,
                       const Eigen::Matrix2d& R_target_source,
                       std::vector<OverlapBlock>* blocks,
                       std::mt19937_64* random) {
  std::normal_distribution<double> unit(0.0, 1.0);
  const SimulatedDrift of_source(random);
  const SimulatedDrift of_target(random);
  const Eigen::Vector4d placement(
      0.2 * unit(*random), 0.2 * unit(*random), 0.01 * unit(*random), 0.2 * unit(*random));
  const auto n = static_cast<Eigen::Index>(blocks->size());
  Eigen::MatrixXd correlation(n, n);
  Eigen::VectorXd white(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    white[i] = unit(*random);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Eigen::Vector2d apart =
          (*blocks)[static_cast<std::size_t>(i)].arm - (*blocks)[static_cast<std::size_t>(j)].arm;
      correlation(i, j) = std::exp(-apart.norm() / 100.0);
    }
  }
  const Eigen::MatrixXd L = correlation.llt().matrixL();
  const Eigen::VectorXd heights = truth.correlated_error_ratio * altitude_m * (L * white);
  for (Eigen::Index i = 0; i < n; ++i) {
    OverlapBlock& b = (*blocks)[static_cast<std::size_t>(i)];
    const Eigen::Vector2d moved =
        truth.position_walk * (R_target_source * of_source.ByPosition(b.in_source) +
                               of_target.ByPosition(b.in_target)) +
        truth.heading_walk *
            (R_target_source * of_source.ByHeading(b.in_source) + of_target.ByHeading(b.in_target));
    const Eigen::Vector3d noise(unit(*random), unit(*random), unit(*random));
    const Eigen::Matrix3d root = b.white.llt().matrixL();
    b.gradient = b.hessian * placement + root * noise;
    b.gradient += b.hessian.col(3) * heights[i] + b.hessian.leftCols<2>() * moved;
  }
}

}  // namespace seastitch
