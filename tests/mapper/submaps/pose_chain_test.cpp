#include "mapper/submaps/pose_chain.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

RelativePose Step(double x_m, double sigma_m, double sigma_yaw_rad = 1e-4) {
  RelativePose step;
  step.T_a_b.x = x_m;
  step.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, sigma_yaw_rad * sigma_yaw_rad;
  return step;
}

TEST(ChainsTo, GoTheWayOfTheLeastError) {
  // 0 to 3 by three good steps, or at once by a bad one.
  const std::vector<PoseLink> links = {{0, 1, Step(10.0, 0.1)},
                                       {1, 2, Step(10.0, 0.1)},
                                       {2, 3, Step(10.0, 0.1)},
                                       {0, 3, Step(31.0, 1.0)}};
  auto chains = ChainsTo(3, 4, links, 10.0);
  ASSERT_TRUE(chains[0].has_value());
  EXPECT_NEAR(chains[0]->T_a_b.x, 30.0, 1e-9);
  EXPECT_NEAR(chains[0]->covariance(0, 0), 0.03, 1e-4);
  EXPECT_NEAR(chains[3]->covariance.norm(), 0.0, 1e-12);
  // A good one at once.
  chains = ChainsTo(3, 4, {links[0], links[1], links[2], {0, 3, Step(30.1, 0.05)}}, 10.0);
  EXPECT_NEAR(chains[0]->T_a_b.x, 30.1, 1e-9);
  // And submap 1 is nearer by submap 0 than by submap 2.
  EXPECT_NEAR(chains[1]->T_a_b.x, 20.1, 1e-9);
  EXPECT_NEAR(chains[1]->covariance(0, 0), 0.01 + 0.0025, 1e-4);
}

TEST(ChainsTo, LeadFromBothEndsOfALink) {
  const std::vector<PoseLink> links = {{0, 1, Step(10.0, 0.1, 0.02)}};
  const auto forward = ChainsTo(1, 2, links, 10.0);
  const auto back = ChainsTo(0, 2, links, 10.0);
  EXPECT_NEAR(forward[0]->T_a_b.x, 10.0, 1e-12);
  EXPECT_NEAR(back[1]->T_a_b.x, -10.0, 1e-12);
  // Seen from 1, where 0 stands across hangs on the yaw of 1.
  EXPECT_NEAR(back[1]->covariance(1, 1), 0.01 + 0.02 * 0.02 * 100.0, 1e-12);
  EXPECT_NEAR(forward[0]->covariance(1, 1), 0.01, 1e-12);
}

TEST(ChainsTo, AreMissingWhereNoLinkLeads) {
  const auto chains = ChainsTo(0, 3, {{0, 1, Step(10.0, 0.1)}}, 10.0);
  EXPECT_TRUE(chains[0].has_value());
  EXPECT_TRUE(chains[1].has_value());
  EXPECT_FALSE(chains[2].has_value());
}

TEST(RelativePoses, TurnedTwiceAreTheSame) {
  RelativePose pose = Step(7.0, 0.3, 0.02);
  pose.T_a_b = {7.0, -3.0, 0.8};
  pose.covariance(0, 1) = pose.covariance(1, 0) = 0.01;
  const RelativePose twice = Inverse(Inverse(pose));
  EXPECT_LT((twice.T_a_b.Vector() - pose.T_a_b.Vector()).norm(), 1e-12);
  EXPECT_LT((twice.covariance - pose.covariance).norm(), 1e-12);
}

}  // namespace
}  // namespace seastitch
