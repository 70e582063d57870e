#include "mapper/position_edges.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

namespace seastitch {
namespace {

NavState StateAt(double x, double y, double yaw_rad) {
  NavState state;
  state.T_map_vehicle.translation() = Eigen::Vector3d(x, y, 5.0);
  state.T_map_vehicle.linear() =
      Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return state;
}

double SquaredMahalanobis(const GraphEdge& edge, const Pose2& T_map_submap) {
  const Eigen::Vector3d e = T_map_submap.Vector() - edge.T_from_to.Vector();
  return e.dot(edge.information * e);
}

constexpr double kYawRad = 0.6;
const NavState kFrame = StateAt(100.0, 50.0, kYawRad);
// 40 m ahead and 10 m to the right of it.
const Eigen::Vector2d kLever(40.0, 10.0);
NavState AtFix() {
  const Eigen::Vector2d p = Eigen::Vector2d(100.0, 50.0) + Eigen::Rotation2Dd(kYawRad) * kLever;
  return StateAt(p.x(), p.y(), 0.9);
}

GraphEdge EdgeOfFixAt(const Eigen::Vector2d& north_east_m, const Eigen::Matrix3d& covariance) {
  const MapFix fix{{}, north_east_m, 4.0 * Eigen::Matrix2d::Identity()};
  return FixEdge(SubmapId{3}, kFrame, fix, AtFix(), covariance);
}

TEST(FixEdge, IsContentWithEveryPoseThatPutsTheVehicleAtTheFix) {
  // The truth: the submap is turned by 1 degree against dead reckoning, and elsewhere.
  const double yaw_rad = kYawRad + Deg2Rad(1.0);
  const Eigen::Vector2d p(107.0, 46.0);
  const Eigen::Vector2d at_fix = p + Eigen::Rotation2Dd(yaw_rad) * kLever;
  const GraphEdge edge = EdgeOfFixAt(at_fix, Eigen::Matrix3d::Zero());
  EXPECT_EQ(edge.kind, EdgeKind::kPositionFix);
  EXPECT_EQ(edge.from, SubmapId{3});
  EXPECT_EQ(edge.to, SubmapId{3});
  // 6 mm of second order.
  EXPECT_LT(SquaredMahalanobis(edge, {p.x(), p.y(), yaw_rad}), 2e-5);
  // 2 m is its sigma.
  EXPECT_NEAR(SquaredMahalanobis(edge, {p.x() + 2.0, p.y(), yaw_rad}), 1.0, 1e-2);
  EXPECT_GT(SquaredMahalanobis(edge, {p.x(), p.y(), yaw_rad + 0.3}), 30.0);
}

TEST(FixEdge, InformsTwoDirections) {
  const GraphEdge edge = EdgeOfFixAt({0.0, 0.0}, Eigen::Matrix3d::Zero());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(edge.information);
  EXPECT_NEAR(eigen.eigenvalues()(0), 0.0, 1e-9);
  EXPECT_GT(eigen.eigenvalues()(1), 0.2);
}

TEST(FixEdge, KnowsAsMuchAsTheFixAndTheWayToItTogether) {
  // Dead reckoning to the fix: 3 m along the submap's own x, 1 m across.
  const Eigen::Matrix3d way = Eigen::Vector3d(9.0, 1.0, 1e-4).asDiagonal();
  const GraphEdge edge = EdgeOfFixAt({0.0, 0.0}, way);
  const Eigen::Vector2d ahead(std::cos(kYawRad), std::sin(kYawRad));
  const Eigen::Matrix2d covariance = edge.information.topLeftCorner<2, 2>().inverse();
  EXPECT_NEAR(ahead.dot(covariance * ahead), 4.0 + 9.0, 1e-9);
  EXPECT_NEAR(covariance.trace(), 4.0 + 9.0 + 4.0 + 1.0, 1e-9);
}

TEST(StartEdge, SaysHowWellThePlaceIsKnownAndNothingOfTheHeading) {
  NavState frame = kFrame;
  frame.covariance.topLeftCorner<2, 2>() << 4.0, 1.0, 1.0, 2.0;
  const GraphEdge edge = StartEdge(SubmapId{0}, frame);
  EXPECT_EQ(edge.kind, EdgeKind::kDeadReckoning);
  EXPECT_NEAR(edge.T_from_to.yaw, kYawRad, 1e-12);
  const Eigen::Matrix2d product =
      edge.information.topLeftCorner<2, 2>() * frame.covariance.topLeftCorner<2, 2>();
  EXPECT_LT((product - Eigen::Matrix2d::Identity()).norm(), 1e-12);
  EXPECT_EQ(edge.information.col(2).norm(), 0.0);
}

}  // namespace
}  // namespace seastitch
