#include "mapper/noise/overlap_likelihood.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <random>
#include <vector>

#include "mapper/noise/noise_estimator.hpp"
#include "tests/mapper/loops/simulated_overlap.hpp"

namespace seastitch {
namespace {

constexpr double kAltitudeM = 21.0;

// ---- blocks

struct Cells {
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 4> hessian = Eigen::Matrix<double, 3, 4>::Zero();
  Eigen::Matrix3d white = Eigen::Matrix3d::Zero();
  double count = 0.0;
};

// Cells of 0.5 m over an area of this size, with weights and slopes at random.
Cells AddCells(double length_m, double width_m, OverlapBlocks* blocks) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> unit(0.0, 1.0);
  Cells sum;
  for (double x = -0.5 * length_m + 0.25; x < 0.5 * length_m; x += 0.5) {
    for (double y = -0.5 * width_m + 0.25; y < 0.5 * width_m; y += 0.5) {
      const double weight = 500.0 + 100.0 * unit(random);
      const double variance = 0.3 + 0.02 * unit(random);
      const Eigen::Vector2d slope(0.2 + 0.1 * unit(random), -0.1 + 0.1 * unit(random));
      const Eigen::Vector4d J(-slope.x(), -slope.y(), slope.x() * y - slope.y() * x, 1.0);
      const Eigen::Vector3d apart(0.1 * unit(random), 0.1 * unit(random), unit(random));
      const Eigen::Vector4d gradient = unit(random) * J;
      blocks->Add({x, y}, weight, variance, J, apart, gradient);
      const Eigen::Vector3d u(J[0], J[1], 1.0);
      sum.gradient += Eigen::Vector3d(gradient[0], gradient[1], gradient[3]);
      sum.hessian += weight * u * J.transpose();
      sum.hessian.topLeftCorner<2, 3>() -= 0.25 * weight * apart.head<2>() * apart.transpose();
      sum.white += weight * weight * variance * u * u.transpose();
      sum.count += 1.0;
    }
  }
  return sum;
}

TEST(OverlapBlocks, KeepTheSumsOfTheirCellsInAtMost28Blocks) {
  for (const double length_m : {12.0, 40.0, 200.0}) {
    SCOPED_TRACE(length_m);
    OverlapBlocks collected(0.5);
    const Cells all = AddCells(length_m, 16.0, &collected);
    const Pose2 T{7.0, -3.0, 2.0};
    const Eigen::Vector2d center(14.0, 5.0);
    Eigen::Matrix4d white = Eigen::Matrix4d::Zero();  // after smoothing
    constexpr double kVariance = 0.04;
    white.diagonal().head<2>() = 0.9 * kVariance * all.white.diagonal().head<2>();
    const std::vector<OverlapBlock> blocks = collected.Finish(white, kVariance, T, center);
    EXPECT_LE(blocks.size(), OverlapBlocks::kMaxBlocks);
    EXPECT_GE(blocks.size(), 8u);
    OverlapBlock sum;
    double cells = 0.0;
    for (const OverlapBlock& b : blocks) {
      sum.gradient += b.gradient;
      sum.hessian += b.hessian;
      sum.white += b.white;
      cells += b.cells;
      EXPECT_LT((b.in_target - (T * center + b.arm)).norm(), 1e-9);
      EXPECT_LT((T * b.in_source - b.in_target).norm(), 1e-9);
    }
    EXPECT_EQ(cells, all.count);
    EXPECT_TRUE(sum.gradient.isApprox(all.gradient, 1e-9));
    EXPECT_TRUE(sum.hessian.isApprox(all.hessian, 1e-9));
    // 2 % for smoothing that blocks share. The heights' part is not smoothed away.
    EXPECT_NEAR(sum.white(2, 2), 1.02 * kVariance * all.white(2, 2), 1e-6 * sum.white(2, 2));
    EXPECT_NEAR(sum.white(0, 0) + sum.white(1, 1), 1.02 * white.trace(), 1e-6 * white.trace());
  }
}

// ---- walks

TEST(OverlapBlocks, HaveTheCovarianceOfSimulatedWalks) {
  const Pose2 T{4.0, -6.0, 2.8};  // the other line runs back, at an angle
  const Eigen::Matrix2d R = T.Rotation();
  std::vector<OverlapBlock> blocks;
  for (const Eigen::Vector2d& p :
       {Eigen::Vector2d(12, 5), Eigen::Vector2d(20, -7), Eigen::Vector2d(-9, 4)})
    blocks.push_back(BlockAt(T, p));
  // A cut of the track: x of one negative and of the other positive, in the source too.
  ASSERT_LT(blocks[0].in_source.x() * blocks[2].in_source.x(), 0.0);
  const auto n = static_cast<Eigen::Index>(blocks.size());
  Eigen::MatrixXd by_position = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  Eigen::MatrixXd by_heading = by_position;
  constexpr int kDraws = 10'000;
  std::mt19937_64 random(1);
  for (int draw = 0; draw < kDraws; ++draw) {
    const SimulatedDrift of_source(&random);
    const SimulatedDrift of_target(&random);
    Eigen::VectorXd position(2 * n);
    Eigen::VectorXd heading(2 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const OverlapBlock& b = blocks[static_cast<std::size_t>(i)];
      position.segment<2>(2 * i) =
          R * of_source.ByPosition(b.in_source) + of_target.ByPosition(b.in_target);
      heading.segment<2>(2 * i) =
          R * of_source.ByHeading(b.in_source) + of_target.ByHeading(b.in_target);
    }
    by_position += position * position.transpose() / kDraws;
    by_heading += heading * heading.transpose() / kDraws;
  }
  const auto check = [&](const Eigen::MatrixXd& simulated, auto covariance_of, const char* name) {
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
      for (Eigen::Index j = 0; j < 2 * n; ++j) {
        const Eigen::Matrix2d K = covariance_of(blocks[static_cast<std::size_t>(i / 2)],
                                                blocks[static_cast<std::size_t>(j / 2)]);
        const double size = std::sqrt(simulated(i, i) * simulated(j, j));
        // 4 sigma of the draws, and a step of the simulation.
        const double tolerance = size * (4.0 * std::sqrt(2.0 / kDraws) + 0.02);
        EXPECT_NEAR(K(i % 2, j % 2), simulated(i, j), tolerance) << name << " " << i << " " << j;
      }
    }
  };
  check(
      by_position,
      [](const OverlapBlock& a, const OverlapBlock& b) -> Eigen::Matrix2d {
        return PositionWalkCovariance(a, b) * Eigen::Matrix2d::Identity();
      },
      "position");
  check(
      by_heading,
      [&](const OverlapBlock& a, const OverlapBlock& b) { return HeadingWalkCovariance(a, b, R); },
      "heading");
}

// ---- likelihood

// -2 ln of the density of the contrasts that no placement changes: K' g with K' A = 0. Differs from
// the restricted likelihood by a constant.
double OfContrasts(const std::vector<OverlapBlock>& blocks,
                   const Eigen::Matrix2d& R,
                   double s,
                   double q,
                   double p) {
  const auto n = static_cast<Eigen::Index>(blocks.size());
  Eigen::MatrixXd A(3 * n, 4);
  Eigen::VectorXd g(3 * n);
  Eigen::MatrixXd C(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const OverlapBlock& a = blocks[static_cast<std::size_t>(i)];
    A.middleRows<3>(3 * i) = a.hessian;
    g.segment<3>(3 * i) = a.gradient;
    for (Eigen::Index j = 0; j < n; ++j) {
      const OverlapBlock& b = blocks[static_cast<std::size_t>(j)];
      const double height_m2 =
          std::pow(s * kAltitudeM, 2) * std::exp(-(a.arm - b.arm).norm() / 100.0);
      const Eigen::Matrix2d moved =
          q * q * PositionWalkCovariance(a, b) * Eigen::Matrix2d::Identity() +
          p * p * HeadingWalkCovariance(a, b, R);
      C.block<3, 3>(3 * i, 3 * j) =
          height_m2 * a.hessian.col(3) * b.hessian.col(3).transpose() +
          a.hessian.leftCols<2>() * moved * b.hessian.leftCols<2>().transpose();
      if (i == j) C.block<3, 3>(3 * i, 3 * j) += a.white;
    }
  }
  const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(A).householderQ();
  const Eigen::MatrixXd K = Q.rightCols(3 * n - 4);
  const Eigen::LLT<Eigen::MatrixXd> llt(K.transpose() * C * K);
  const Eigen::VectorXd contrasts = K.transpose() * g;
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum() + contrasts.dot(llt.solve(contrasts));
}

TEST(RestrictedLikelihood, IsThatOfTheContrastsAtAndBetweenItsNodes) {
  std::mt19937_64 random(3);
  const Pose2 T{30.0, 2.0, 2.8};
  const VarianceComponents truth{1.0, 0.001, 0.004, 2e-4};
  std::vector<OverlapBlock> blocks = BlocksWithoutErrors(T, {18.0, 3.0}, 4, 3, &random);
  DrawErrors(truth, kAltitudeM, T.Rotation(), &blocks, &random);
  std::vector<OverlapBlock> with_crumbs = blocks;
  with_crumbs.push_back(blocks.front());
  with_crumbs.back().cells = 11.0;  // too few to be normal
  const LikelihoodTable table = RestrictedLikelihood(with_crumbs, T.Rotation(), kAltitudeM);
  const auto dense = [&](std::size_t s, std::size_t q, std::size_t p) {
    return OfContrasts(blocks,
                       T.Rotation(),
                       kErrorRatioAxis.At(s),
                       kPositionWalkAxis.At(q),
                       kHeadingWalkAxis.At(p));
  };
  const double reference = dense(0, 0, 0);
  double largest = 0.0;
  for (std::size_t s = 0; s < kErrorRatioAxis.size; ++s) {
    for (std::size_t q = 0; q < kPositionWalkAxis.size; ++q) {
      for (std::size_t p = 0; p < kHeadingWalkAxis.size; ++p) {
        const double expected = dense(s, q, p) - reference;
        largest = std::max(largest, std::abs(expected));
        // Every second value of both walks is a node; a cubic between them is within 1.3.
        const bool at_node = q % 2 == 0 && p % 2 == 0;
        EXPECT_NEAR(table(s, q, p), expected, at_node ? 1e-3 : 1.5) << s << " " << q << " " << p;
      }
    }
  }
  EXPECT_GT(largest, 15.0);
}

TEST(RestrictedLikelihood, DoesNotDependOnThePlacementAndNeedsSixBlocks) {
  std::mt19937_64 random(4);
  const Pose2 T{30.0, 2.0, 2.8};
  std::vector<OverlapBlock> blocks = BlocksWithoutErrors(T, {18.0, 3.0}, 3, 2, &random);
  DrawErrors({}, kAltitudeM, T.Rotation(), &blocks, &random);
  const LikelihoodTable before = RestrictedLikelihood(blocks, T.Rotation(), kAltitudeM);
  EXPECT_NE(before(12, 6, 6), 0.0);
  for (OverlapBlock& b : blocks) b.gradient += b.hessian * Eigen::Vector4d(1.0, -2.0, 0.1, 3.0);
  const LikelihoodTable moved = RestrictedLikelihood(blocks, T.Rotation(), kAltitudeM);
  for (std::size_t i = 0; i < LikelihoodTable::kSize; ++i)
    EXPECT_NEAR(moved.values()[i], before.values()[i], 0.01);
  blocks.pop_back();
  const LikelihoodTable too_few = RestrictedLikelihood(blocks, T.Rotation(), kAltitudeM);
  for (const float value : too_few.values()) EXPECT_EQ(value, 0.0f);
}

// ---- the pool

ClosureStatistics Drawn(int number, const VarianceComponents& truth, std::mt19937_64* random) {
  std::uniform_real_distribution<double> side(-0.5, 0.5);
  const Pose2 T{50.0 + 10.0 * side(*random), 8.0 * side(*random), kPi + 0.4 * side(*random)};
  const Eigen::Vector2d center(25.0 + 10.0 * side(*random), 10.0 * side(*random));
  std::vector<OverlapBlock> blocks = BlocksWithoutErrors(T, center, 7, 4, random);
  DrawErrors(truth, kAltitudeM, T.Rotation(), &blocks, random);
  ClosureStatistics closure;
  closure.target = SubmapId{number};
  closure.source = SubmapId{number + 1};
  closure.likelihood = BoundedLikelihood(RestrictedLikelihood(blocks, T.Rotation(), kAltitudeM));
  return closure;
}

void ExpectNear(const ComponentEstimate& estimate, double truth, const char* name) {
  EXPECT_LT(estimate.log_sigma, 0.5) << name;
  EXPECT_LT(std::abs(std::log(estimate.value / truth)), 3.0 * estimate.log_sigma)
      << name << ": " << estimate.value << " for " << truth;
}

void ExpectFound(const NoiseEstimate& found, const VarianceComponents& truth) {
  ExpectNear(found.correlated_error_ratio, truth.correlated_error_ratio, "correlated error");
  ExpectNear(found.position_walk, truth.position_walk, "position walk");
  ExpectNear(found.heading_walk, truth.heading_walk, "heading walk");
}

TEST(NoiseEstimator, FindsTheComponentsFromWhichThirtyOverlapsWereDrawn) {
  for (const VarianceComponents& truth : {VarianceComponents{1.0, 0.0012, 0.008, 4e-4},
                                          VarianceComponents{1.0, 0.0006, 0.003, 6e-4},
                                          VarianceComponents{1.0, 0.004, 0.002, 3e-4}}) {
    SCOPED_TRACE(truth.correlated_error_ratio);
    std::mt19937_64 random(5);
    NoiseEstimator estimator{VarianceComponents()};
    for (int i = 0; i < 30; ++i) estimator.Add(Drawn(i, truth, &random));
    ExpectFound(estimator.estimate(), truth);
    // Two overlaps in thirty of another kind change little.
    const VarianceComponents far{1.0, 0.009, 0.016, 1.6e-3};
    for (int i = 100; i < 102; ++i) estimator.Add(Drawn(i, far, &random));
    ExpectFound(estimator.estimate(), truth);
  }
}

}  // namespace
}  // namespace seastitch
