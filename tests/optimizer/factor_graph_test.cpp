#include "optimizer/solver/factor_graph.hpp"

#include <gtest/gtest.h>

#include "common/core/information.hpp"
#include "common/core/mounting.hpp"
#include "optimizer/solver/robust_solver.hpp"
#include "tests/core/example_information.hpp"

namespace seastitch {
namespace {

Eigen::Vector3d ResidualAt(const Factor& factor,
                           const Pose2& T_map_i,
                           const Pose2& T_map_j,
                           EndJacobians* J = nullptr) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  return Residual(factor, EndPoses{T_map_i.Vector(), T_map_j.Vector(), none, none}, J);
}

TEST(Factor, SquaredResidualIsTheMahalanobisDistance) {
  const Eigen::Matrix3d information = CorrelatedInformation();
  const auto root = FactorInformation(information);
  ASSERT_TRUE(root);
  EXPECT_EQ(root->rank, 3);
  const Factor factor{0, 1, {1.0, 2.0, 0.3}, root->W};
  const Eigen::Vector3d e(0.4, -0.7, 0.05);
  const Pose2 T_map_i{10.0, -5.0, 2.0};
  const Pose2 T_map_j = T_map_i * Pose2{1.4, 1.3, 0.35};
  const double squared = ResidualAt(factor, T_map_i, T_map_j).squaredNorm();
  EXPECT_NEAR(squared, e.dot(information * e), 1e-9);

  // The Cholesky factor the wrong way round would have passed for a diagonal matrix only.
  const Eigen::Matrix3d L = information.llt().matrixL();
  EXPECT_GT(std::abs((L * e).squaredNorm() - squared), 1.0);
}

TEST(Factor, JacobiansAreTheNumericDerivatives) {
  const Factor factor{0, 1, {1.0, 2.0, 3.1}, FactorInformation(CorrelatedInformation())->W};
  const Pose2 T_map_i{10.0, -5.0, 2.0};
  const Pose2 T_map_j{13.0, -9.0, -1.2};
  EndJacobians J;
  ResidualAt(factor, T_map_i, T_map_j, &J);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 3; ++k) {
    const auto moved = [k](const Pose2& T, double by) {
      Eigen::Vector3d v = T.Vector();
      v(k) += by;
      return Pose2{v.x(), v.y(), v.z()};
    };
    const Eigen::Vector3d by_i = (ResidualAt(factor, moved(T_map_i, kStep), T_map_j) -
                                  ResidualAt(factor, moved(T_map_i, -kStep), T_map_j)) /
                                 (2.0 * kStep);
    const Eigen::Vector3d by_j = (ResidualAt(factor, T_map_i, moved(T_map_j, kStep)) -
                                  ResidualAt(factor, T_map_i, moved(T_map_j, -kStep))) /
                                 (2.0 * kStep);
    EXPECT_LT((J[0].col(k) - by_i).norm(), 1e-6);
    EXPECT_LT((J[1].col(k) - by_j).norm(), 1e-6);
  }
}

// A closure between two dives.
TEST(Factor, JacobiansByTheMountingErrorsOfTwoDivesAreTheNumericDerivatives) {
  Factor factor{0, 1, {4.0, 7.0, 2.9}, FactorInformation(CorrelatedInformation())->W};
  const Eigen::Vector2d center(-12.0, 30.0);
  factor.mounting = {MountingTerm{2, LoopClosureByMountingOfTo(factor.T_i_j, center)},
                     MountingTerm{3, LoopClosureByMountingOfFrom(center)}};
  EXPECT_EQ(factor.Ends(), (std::array<int, 4>{0, 1, 2, 3}));
  EndPoses at{Eigen::Vector3d(10.0, -5.0, 2.0),
              Eigen::Vector3d(13.0, -9.0, -1.2),
              Eigen::Vector3d(0.3, -0.2, 0.01),
              Eigen::Vector3d(-0.5, 0.1, -0.02)};
  EndJacobians J;
  Residual(factor, at, &J);
  EXPECT_GT(J[2].norm(), 1.0);
  EXPECT_GT(J[3].norm(), 1.0);
  constexpr double kStep = 1e-6;
  for (std::size_t end = 0; end < at.size(); ++end) {
    for (int k = 0; k < 3; ++k) {
      EndPoses up = at, down = at;
      up[end](k) += kStep;
      down[end](k) -= kStep;
      const Eigen::Vector3d by = (Residual(factor, up) - Residual(factor, down)) / (2.0 * kStep);
      EXPECT_LT((J[end].col(k) - by).norm(), 1e-5) << end;
    }
  }
}

TEST(Factor, HasNoVertexOfAMountingThatItDoesNotDependOn) {
  Factor factor{0, 1, {}, Eigen::Matrix3d::Identity()};
  EXPECT_EQ(factor.Ends(), (std::array<int, 4>{0, 1, kMap, kMap}));
  factor.mounting[0].vertex = 2;
  EXPECT_EQ(factor.Ends(), (std::array<int, 4>{0, 1, kMap, kMap}));
  factor.mounting[0].by(0, 0) = 1.0;
  EXPECT_EQ(factor.Ends(), (std::array<int, 4>{0, 1, 2, kMap}));
}

TEST(Factor, TakesYawTheShortWayRound) {
  const Factor factor{0, 1, {0.0, 0.0, kPi - 0.01}, Eigen::Matrix3d::Identity()};
  const Eigen::Vector3d e = ResidualAt(factor, {}, {0.0, 0.0, -kPi + 0.01});
  EXPECT_NEAR(e.z(), 0.02, 1e-12);
}

TEST(Factor, SingularInformationLeavesTheFreeDirectionAlone) {
  FactorGraph graph{2, 0, {}};
  graph.factors.push_back({0, 1, {5.0, 0.0, 0.0}, Eigen::Matrix3d::Identity()});
  // Says that 1 is 5 m further along (0.6, 0.8) and nothing else.
  graph.factors.push_back({0, 1, {5.0 + 3.0, 4.0, 1.0}, FactorInformation(RidgeInformation())->W});
  const auto solution = SolveRobustly(graph, {{{}, {}}}, {});
  const Pose2 moved = solution.T_map_vertex[1];
  const double along = (moved.x - 5.0) * 0.6 + moved.y * 0.8;
  const double across = -(moved.x - 5.0) * 0.8 + moved.y * 0.6;
  EXPECT_NEAR(along, 5.0, 0.02);  // 400 against 1
  EXPECT_NEAR(across, 0.0, 1e-4);
  EXPECT_NEAR(moved.yaw, 0.0, 1e-4);
}

}  // namespace
}  // namespace seastitch
