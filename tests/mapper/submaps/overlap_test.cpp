#include "mapper/submaps/overlap.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mapper/submaps/footprint.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

Footprint Rectangle(double half_x, double half_y) {
  return {{-half_x, -half_y}, {half_x, -half_y}, {half_x, half_y}, {-half_x, half_y}};
}

Submap Flat(int id, const Footprint& footprint, double information) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.footprint = footprint;
  submap.predicted_information =
      Eigen::Matrix3d(Eigen::Vector3d(information, information, 100.0 * information).asDiagonal());
  return submap;
}

Eigen::Matrix3d Sigma(double xy_m, double yaw_rad) {
  return Eigen::Vector3d(xy_m * xy_m, xy_m * xy_m, yaw_rad * yaw_rad).asDiagonal();
}

TEST(OverlapArea, OfCrossingSwathsWithoutACornerInEachOther) {
  const Footprint swath = Rectangle(50.0, 10.0);
  EXPECT_NEAR(OverlapArea(swath, swath, {0.0, 0.0, 0.5 * kPi}), 400.0, 1e-6);
}

TEST(OverlapArea, OfContainedTouchingAndDistantOnes) {
  const Footprint large = Rectangle(50.0, 10.0);
  const Footprint small = Rectangle(5.0, 2.0);
  EXPECT_NEAR(OverlapArea(large, small, {3.0, 1.0, 0.4}), 40.0, 1e-6);
  EXPECT_NEAR(OverlapArea(small, large, Inverse(Pose2{3.0, 1.0, 0.4})), 40.0, 1e-6);
  EXPECT_NEAR(OverlapArea(large, large, {100.0, 0.0, 0.0}), 0.0, 1e-6);
  EXPECT_NEAR(OverlapArea(large, large, {0.0, 50.0, 0.0}), 0.0, 1e-6);
}

TEST(OverlapArea, FollowsAConcaveOutline) {
  // A U; what stands in its opening overlaps nothing, though the hull would say so.
  const Footprint u = {{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 20}, {30, 20}, {30, 30}, {0, 30}};
  EXPECT_NEAR(OverlapArea(u, Rectangle(4.0, 4.0), {20.0, 15.0, 0.0}), 0.0, 1e-6);
}

TEST(OverlapArea, OfWhatIsNoOutlineIsZero) {
  EXPECT_EQ(OverlapArea({}, Rectangle(5.0, 5.0), {}), 0.0);
  EXPECT_EQ(OverlapArea({{0.0, 0.0}, {1.0, 0.0}}, Rectangle(5.0, 5.0), {}), 0.0);
}

TEST(OverlapArea, IsTheSameFromBothSidesAndAtMostTheSmaller) {
  EXPECT_TRUE(rc::check([] {
    const auto number = [](int low, int high) {
      return 0.1 * *rc::gen::inRange(10 * low, 10 * high);
    };
    const Footprint a = Rectangle(number(5, 60), number(5, 20));
    const Footprint b = Rectangle(number(5, 60), number(5, 20));
    const Pose2 T_a_b{number(-60, 60), number(-60, 60), number(-3, 3)};
    const double ab = OverlapArea(a, b, T_a_b);
    RC_ASSERT(std::abs(ab - OverlapArea(b, a, Inverse(T_a_b))) < 1e-3);
    RC_ASSERT(ab >= 0.0);
    RC_ASSERT(ab <= std::min(Area(a), Area(b)) + 1e-3);
  }));
}

TEST(ExpectedOverlap, FindsAPairThatOnlyTheUncertaintyBringsTogether) {
  const Footprint swath = Rectangle(50.0, 10.0);
  RelativePose apart{{0.0, 25.0, 0.0}, Sigma(0.1, 0.0)};
  EXPECT_EQ(ExpectedOverlapArea(swath, swath, apart), 0.0);
  apart.covariance = Sigma(8.0, 0.0);
  EXPECT_GT(ExpectedOverlapArea(swath, swath, apart), 50.0);
}

TEST(ExpectedOverlap, WithoutDoubtIsTheOverlap) {
  const Footprint swath = Rectangle(50.0, 10.0);
  const RelativePose sure{{5.0, 8.0, 0.3}, Eigen::Matrix3d::Zero()};
  EXPECT_NEAR(ExpectedOverlapArea(swath, swath, sure), OverlapArea(swath, swath, sure.T_a_b), 1e-6);
}

TEST(Pairs, PreferWhatTellsMost) {
  const Footprint swath = Rectangle(50.0, 10.0);
  const SubmapOutline source = OutlineOf(Flat(9, swath, 1000.0));
  const RelativePose half{{50.0, 0.0, 0.0}, Sigma(1.0, 0.01)};
  const RelativePose quarter{{75.0, 0.0, 0.0}, Sigma(1.0, 0.01)};
  const RelativePose well_known{{50.0, 0.0, 0.0}, Sigma(0.01, 0.0001)};
  OverlapParams params;
  params.max_pairs = 3;
  const auto chosen =
      ChoosePairs({JudgePair(OutlineOf(Flat(1, swath, 1000.0)), source, quarter, 0.25),
                   JudgePair(OutlineOf(Flat(2, swath, 1000.0)), source, half, 0.25),
                   JudgePair(OutlineOf(Flat(3, swath, 1.0)), source, half, 0.25),
                   JudgePair(OutlineOf(Flat(4, swath, 1000.0)), source, well_known, 0.25)},
                  params);
  ASSERT_EQ(chosen.size(), 3u);
  EXPECT_EQ(chosen[0].target.value, 2);
  EXPECT_EQ(chosen[1].target.value, 1);
  EXPECT_EQ(chosen[2].target.value, 3);
}

TEST(Pairs, NeedARealOverlapAndNothingElse) {
  const Footprint swath = Rectangle(50.0, 10.0);
  const SubmapOutline source = OutlineOf(Flat(5, swath, 1000.0));
  const auto candidate = [&](double x, double y, double sigma) {
    return JudgePair(
        OutlineOf(Flat(4, swath, 1000.0)), source, {{x, y, 0.0}, Sigma(sigma, 0.001)}, 0.25);
  };
  // The neighbour before it on the same line, touching; and the same with a common half.
  EXPECT_TRUE(ChoosePairs({candidate(99.0, 0.0, 0.1)}, OverlapParams{}).empty());
  EXPECT_EQ(ChoosePairs({candidate(50.0, 0.0, 0.1)}, OverlapParams{}).size(), 1u);
  EXPECT_TRUE(ChoosePairs({candidate(500.0, 0.0, 5.0)}, OverlapParams{}).empty());
}

TEST(Pairs, OfAFlatSeabedComeLastButCome) {
  const Footprint swath = Rectangle(50.0, 10.0);
  const auto c = JudgePair(OutlineOf(Flat(1, swath, 0.0)),
                           OutlineOf(Flat(2, swath, 0.0)),
                           {{0.0, 10.0, 0.0}, Sigma(1.0, 0.01)},
                           0.25);
  EXPECT_EQ(c.gain_nats, 0.0);
  EXPECT_EQ(ChoosePairs({c}, OverlapParams{}).size(), 1u);
}

TEST(RelativePoses, ComposeAsTheirErrorsDo) {
  const RelativePose a_b{{10.0, 2.0, 0.5}, Sigma(0.1, 0.01)};
  const RelativePose b_c{{7.0, -3.0, -0.2}, Sigma(0.2, 0.02)};
  const RelativePose a_c = Compose(a_b, b_c);
  // By differences: how T_a_c moves with each of the six numbers.
  constexpr double kStep = 1e-6;
  Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 6; ++i) {
    Pose2 first = a_b.T_a_b;
    Pose2 second = b_c.T_a_b;
    Pose2& moved = i < 3 ? first : second;
    (i % 3 == 0 ? moved.x : (i % 3 == 1 ? moved.y : moved.yaw)) += kStep;
    const Eigen::Vector3d d = ((first * second).Vector() - a_c.T_a_b.Vector()) / kStep;
    expected += d * (i < 3 ? a_b : b_c).covariance(i % 3, i % 3) * d.transpose();
  }
  EXPECT_LT((expected - a_c.covariance).norm(), 1e-5);
}

}  // namespace
}  // namespace seastitch
