#include "mapper/loop_closer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "mapper/submaps/footprint.hpp"

namespace seastitch {
namespace {

double Bumps(double x, double y) {
  return 20.0 + 0.8 * std::sin(0.35 * x) * std::cos(0.3 * y) + 0.5 * std::sin(0.11 * x + 0.17 * y) +
         0.6 * std::sin(0.21 * x - 0.13 * y + 1.0);
}

// A swath of 60 x 24 m seen from 10 m above, with its frame believed to be at `believed`.
Submap Make(int id, const Pose2& truth, const Pose2& believed) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.start = submap.frame_time = submap.end = FromUtime(1'000'000 * (id + 1));
  submap.T_map_submap =
      MakePose({believed.x, believed.y, 10.0}, RotationFromRpy(0.0, 0.0, believed.yaw));
  submap.covariance_from_previous.diagonal() << 0.25, 0.25, 1e-5;
  std::mt19937_64 random(static_cast<std::uint64_t>(id));
  std::normal_distribution<double> noise(0.0, 0.02);
  std::uniform_real_distribution<double> side(-0.5, 0.5);
  for (int i = 0; i < 15'000; ++i) {
    const Eigen::Vector2d p(60.0 * side(random), 24.0 * side(random));
    const Eigen::Vector2d p_map = truth * p;
    submap.cloud.Add(
        Eigen::Vector3d(p.x(), p.y(), Bumps(p_map.x(), p_map.y()) - 10.0 + noise(random))
            .cast<float>());
  }
  submap.footprint = FootprintOf(submap.cloud, Eigen::Matrix3d::Identity());
  submap.predicted_information.diagonal() << 1000.0, 1000.0, 100'000.0;
  return submap;
}

Submap At(int id, double x, double y, double yaw = 0.0) {
  return Make(id, {x, y, yaw}, {x, y, yaw});
}

TEST(LoopCloser, ChainsDeadReckoningBeforeTheFirstSolution) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  closer.Add(At(1, 100.0, 0.0));
  closer.Add(At(2, 0.0, 12.0));
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{2});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].target.value, 0);
  EXPECT_NEAR(pairs[0].prior.T_a_b.y, 12.0, 1e-9);
  // Two steps of 0.5 m each, and the yaw of the first swings 100 m of lever arm.
  EXPECT_NEAR(pairs[0].prior.covariance(0, 0), 0.5, 0.02);
  EXPECT_NEAR(pairs[0].prior.covariance(1, 1), 0.5 + 1e-5 * 100.0 * 100.0, 0.03);
}

TEST(LoopCloser, TakesThePriorFromTheSolutionAndGoesOnByDeadReckoning) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  closer.Add(At(1, 100.0, 0.0));
  PoseGraph graph;
  graph.graph_version = 2;
  graph.vertices = {
      {SubmapId{0}, {0.0, 0.0, 0.0}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()},
      {SubmapId{1},
       {100.0, -3.0, 0.0},
       0.01 * Eigen::Matrix3d::Identity(),
       0.01 * Eigen::Matrix3d::Identity()}};
  graph.vertices[1].covariance(2, 2) = 1e-8;
  ASSERT_TRUE(closer.SetSolution(graph));
  EXPECT_EQ(closer.newest_solved().value, 1);
  closer.Add(At(2, 0.0, 12.0));
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{2});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].prior.T_a_b.y, 9.0, 1e-9);  // the solution moved by -3
  EXPECT_NEAR(pairs[0].prior.covariance(0, 0), 0.01 + 0.25, 0.01);
}

TEST(LoopCloser, RefusesASolutionOfAnotherGraph) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(4, 0.0, 0.0));
  PoseGraph graph;
  graph.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  EXPECT_FALSE(closer.SetSolution(graph));
  graph.vertices[0].id = SubmapId{4};
  graph.vertices[0].T_map_level.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(closer.SetSolution(graph));
  graph.vertices[0].T_map_level.x = 0.0;
  EXPECT_TRUE(closer.SetSolution(graph));
  graph.vertices.push_back(graph.vertices[0]);
  EXPECT_FALSE(closer.SetSolution(graph));
}

TEST(LoopCloser, MovesNothingWhereTheSolutionIsDeadReckoning) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  closer.Add(At(1, 80.0, 30.0, 1.0));
  closer.Add(At(2, 5.0, 10.0, 3.0));
  const auto before = closer.PairsFor(SubmapId{2});
  PoseGraph graph;
  // What an optimizer without a loop closure says: the chain, seen from vertex 0.
  const Eigen::Matrix3d step = Eigen::Vector3d(0.25, 0.25, 1e-5).asDiagonal();
  graph.vertices = {
      {SubmapId{0}, {0.0, 0.0, 0.0}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()},
      {SubmapId{1}, {80.0, 30.0, 1.0}, step, step}};
  ASSERT_TRUE(closer.SetSolution(graph));
  const auto after = closer.PairsFor(SubmapId{2});
  ASSERT_EQ(before.size(), 1u);
  ASSERT_EQ(after.size(), 1u);
  EXPECT_NEAR(after[0].prior.T_a_b.x, before[0].prior.T_a_b.x, 1e-9);
  EXPECT_LT((after[0].prior.covariance - before[0].prior.covariance).norm(), 1e-3);
}

TEST(LoopCloser, TiesEachSubmapToTheOneBefore) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(2, 0.0, 0.0, 0.5));
  closer.Add(At(7, 30.0, 40.0, 0.9));
  EXPECT_TRUE(closer.DeadReckoningEdge(SubmapId{2}).empty());
  const auto edges = closer.DeadReckoningEdge(SubmapId{7});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].from.value, 2);
  EXPECT_EQ(edges[0].kind, EdgeKind::kDeadReckoning);
  EXPECT_NEAR(edges[0].T_from_to.Translation().norm(), 50.0, 1e-9);
  EXPECT_NEAR(edges[0].T_from_to.yaw, 0.4, 1e-12);
  EXPECT_NEAR(edges[0].information(0, 0), 4.0, 0.01);
}

TEST(RegisterPairs, FindsWhereTheNewerSubmapLies) {
  const Submap target = At(0, 0.0, 0.0);
  // Dead reckoning puts it 1.2 m north and 0.9 m west of the truth.
  const Submap source = Make(1, {10.0, 12.0, 0.0}, {11.2, 11.1, 0.0});
  LoopCloser closer(LoopCloserParams{});
  closer.Add(target);
  closer.Add(source);
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{1});
  ASSERT_EQ(pairs.size(), 1u);
  const auto edges = RegisterPairs(
      source,
      pairs,
      [&](SubmapId) { return std::make_shared<const Submap>(target); },
      LoopCloserParams{});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].verdict, LoopVerdict::kAccepted) << ToString(edges[0].verdict);
  EXPECT_EQ(edges[0].from.value, 0);
  EXPECT_EQ(edges[0].to.value, 1);
  EXPECT_NEAR(edges[0].T_from_to.x, 10.0, 0.1);
  EXPECT_NEAR(edges[0].T_from_to.y, 12.0, 0.1);
}

TEST(RegisterPairs, LeavesOutWhatCannotBeLoaded) {
  const LoopPair pair{SubmapId{0}, SubmapId{1}, {}, 0.0};
  EXPECT_TRUE(RegisterPairs(
                  At(1, 0.0, 0.0), {pair}, [](SubmapId) { return nullptr; }, LoopCloserParams{})
                  .empty());
}

}  // namespace
}  // namespace seastitch
