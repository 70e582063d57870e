#include "mapper/loops/loop_closer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tests/mapper/bumpy_submap.hpp"

namespace seastitch {
namespace {

// An outline alone.
Submap OutlineAt(int id, double x_m) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.T_map_submap = MakePose({x_m, 0.0, 10.0}, Eigen::Matrix3d::Identity());
  submap.covariance_from_previous = Eigen::Matrix3d::Zero();  // perfect navigation
  submap.footprint = {{-30.0, -12.0}, {30.0, -12.0}, {30.0, 12.0}, {-30.0, 12.0}};
  return submap;
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

TEST(LoopCloser, ExpectsTheNextLineWhereTheMountingThatWasFoundPutsIt) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  PoseGraph graph;
  graph.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  graph.mounting[0].sonar_m = {0.6, -0.2};
  graph.mounting[0].covariance = Eigen::Vector3d(0.01, 0.04, 0.0).asDiagonal();
  ASSERT_TRUE(closer.SetSolution(graph));
  closer.Add(At(1, 4.0, 10.0, kPi));  // the other way
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{1});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].prior.T_a_b.x, 4.0 - 1.2, 1e-9);
  EXPECT_NEAR(pairs[0].prior.T_a_b.y, 10.0 + 0.4, 1e-9);
  EXPECT_NEAR(pairs[0].prior.covariance(0, 0), 0.25 + 4.0 * 0.01, 0.01);
  EXPECT_NEAR(pairs[0].prior.covariance(1, 1), 0.25 + 4.0 * 0.04, 0.01);
  EXPECT_NEAR(closer.DeadReckoningEdge(SubmapId{1})[0].T_from_to.x, 4.0, 1e-9);  // as it was told
  graph.mounting[0].sonar_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(closer.SetSolution(graph));
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

// What navigation learnt of the way before the first of both moves the published pose of the
// second.
TEST(LoopCloser, TiesEachSubmapToTheOneBeforeByWhatIsKnownAtTheLaterOne) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  Submap later = At(1, 30.0, 4.0);
  later.T_previous_level = Pose2{30.0, 0.0, 0.0};
  later.dvl_yaw_rad = 0.01;
  closer.Add(later);
  const auto edges = closer.DeadReckoningEdge(SubmapId{1});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].T_from_to.y, 0.0);
  EXPECT_EQ(edges[0].dvl_yaw_rad, 0.01);
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

// Two dives: the second begins 3 m sure of its place, over the first.
TEST(LoopCloser, TiesNoTwoDivesButLooksForTheirClosures) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  closer.Add(At(1, 80.0, 0.0));
  const Eigen::Matrix3d start = Eigen::Vector3d(9.0, 9.0, 1e-4).asDiagonal();
  closer.Add(At(2, 5.0, 10.0), {1, start});
  closer.Add(At(3, 85.0, 10.0), {1, start});
  EXPECT_TRUE(closer.DeadReckoningEdge(SubmapId{2}).empty());
  EXPECT_EQ(closer.DeadReckoningEdge(SubmapId{3}).size(), 1u);
  PoseGraph graph;
  const Eigen::Matrix3d known = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
  graph.vertices = {{SubmapId{0}, {1.0, 0.0, 0.0}, known, known},
                    {SubmapId{1}, {81.0, 0.0, 0.0}, known, known}};
  ASSERT_TRUE(closer.SetSolution(graph));
  const auto first = closer.PairsFor(SubmapId{2});
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].target, SubmapId{0});
  EXPECT_NEAR(first[0].prior.T_a_b.x, 4.0, 1e-9);
  EXPECT_NEAR(first[0].prior.covariance(0, 0), 10.0, 0.05);  // both in the map, at 10 m
  // Before the solution knows of the second dive, by its dead reckoning from its start.
  const auto second = closer.PairsFor(SubmapId{3});
  ASSERT_FALSE(second.empty());
  const auto ahead = std::find_if(second.begin(), second.end(), [](const LoopPair& pair) {
    return pair.target == SubmapId{1};
  });
  ASSERT_NE(ahead, second.end());
  EXPECT_NEAR(ahead->prior.T_a_b.x, 4.0, 1e-9);
  EXPECT_NEAR(ahead->prior.covariance(0, 0), 10.25, 0.2);
}

TEST(LoopCloser, ADiveWithoutAPlaceMayBeAnywhere) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  closer.Add(At(1, 5.0, 10.0), {1, std::nullopt});
  PoseGraph graph;
  const Eigen::Matrix3d known = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
  graph.vertices = {{SubmapId{0}, {}, known, known}};
  ASSERT_TRUE(closer.SetSolution(graph));
  for (const LoopPair& pair : closer.PairsFor(SubmapId{1}))
    EXPECT_GT(pair.prior.covariance(0, 0), 1e5);
}

// Three swaths: 0 and 2 side by side, 1 far ahead. A solution of them as the optimizer gives it.
class LooksAgain : public ::testing::Test {
 protected:
  LooksAgain() {
    closer.Add(At(0, 0.0, 0.0));
    closer.Add(At(1, 100.0, 0.0));
    closer.Add(At(2, 0.0, dead_reckoned_y));
  }

  // What the solution makes of submap 2; the others stay.
  void Solve(double y, double sigma_m, double weight_of_0_2 = -1.0) {
    PoseGraph graph;
    graph.graph_version = ++version;
    graph.vertices = {
        Vertex(0, 0.0, 0.0, 0.0), Vertex(1, 100.0, 0.0, 0.5), Vertex(2, 0.0, y, sigma_m)};
    if (weight_of_0_2 >= 0.0) graph.loop_edges = {{SubmapId{0}, SubmapId{2}, weight_of_0_2}};
    ASSERT_TRUE(closer.SetSolution(graph));
  }
  static SolvedVertex Vertex(int id, double x, double y, double sigma_m) {
    SolvedVertex vertex{
        SubmapId{id}, {x, y, 0.0}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
    vertex.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 1e-6;
    return vertex;
  }
  // Every pair of every submap that moved, where an optimizer knows all that it is asked for this
  // well.
  std::vector<LoopPair> Again(int most = 6, double sigma_m = 0.7) {
    const CovarianceRequest request = closer.request();
    PairCovariances answer{"mapper", 0, request.graph_version, {}};
    for (const auto& [a, b] : request.pairs) {
      answer.pairs.push_back({a, b, Eigen::Matrix3d::Zero()});
      answer.pairs.back().covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 1e-5;
    }
    closer.SetCovariances(answer);
    std::vector<LoopPair> all;
    while (closer.HasMoved()) {
      for (const LoopPair& pair : closer.PairsToRetry(most)) all.push_back(pair);
    }
    return all;
  }
  static GraphEdge Edge(const LoopPair& pair, LoopVerdict verdict) {
    GraphEdge edge;
    edge.kind = EdgeKind::kLoopClosure;
    edge.from = pair.target;
    edge.to = pair.source;
    edge.T_from_to = pair.prior.T_a_b;
    edge.verdict = verdict;
    if (verdict == LoopVerdict::kAccepted) edge.information.diagonal() << 1e4, 1e4, 1e6;
    return edge;
  }
  std::vector<GraphEdge> Record(const LoopPair& pair, LoopVerdict verdict) {
    return closer.Record({pair}, {Edge(pair, verdict)});
  }

  const double dead_reckoned_y = 40.0;  // too far off, by dead reckoning, to meet submap 0
  LoopCloser closer{LoopCloserParams{}};
  std::int64_t version = 3;
};

TEST(LoopCloser, IsLessSureOfClosuresWhereAnOffsetOfTheSonarBendsASubmap) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  Submap turning = At(1, 0.0, 12.0);
  turning.heading_spread = 0.8;
  closer.Add(turning);
  PoseGraph graph;
  graph.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from = SubmapId{0};
  edge.to = SubmapId{1};
  edge.information.diagonal() << 100.0, 0.0, 1e6;  // nothing along y
  const LoopPair pair{edge.from, edge.to, {}, 0.0};
  ASSERT_TRUE(closer.SetSolution(graph));
  EXPECT_EQ(closer.Record({pair}, {edge})[0].information, edge.information);
  graph.mounting[0].sonar_m = {0.3, 0.4};
  graph.mounting[0].covariance = Eigen::Vector3d(0.01, 0.03, 0.0).asDiagonal();
  ASSERT_TRUE(closer.SetSolution(graph));
  const Eigen::Matrix3d information = closer.Record({pair}, {edge})[0].information;
  const double bend_m2 = 0.8 * 0.8 * 0.5 * (0.25 + 0.04);
  EXPECT_NEAR(information(0, 0), 1.0 / (1.0 / 100.0 + bend_m2), 1e-9);
  EXPECT_EQ(information(1, 1), 0.0);
  EXPECT_NEAR(information(2, 2), 1e6, 1e-3);
}

TEST(LoopCloser, IsLessSureOfClosuresFarAlongASubmapThatDriftedWithoutBottomLock) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  Submap drifted = At(1, 0.0, 12.0);
  drifted.drift_per_m = 0.02;
  closer.Add(drifted);
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from = SubmapId{0};
  edge.to = SubmapId{1};
  edge.T_from_to = {4.0, 12.0, 0.0};
  edge.information.diagonal() << 100.0, 0.0, 1e6;
  // Place of the overlap along the drifted submap, and how far from its frame that counts as.
  for (const auto& [x_m, arm_m] :
       {std::pair{14.0, 10.0}, std::pair{-6.0, 10.0}, std::pair{4.0, 3.0}}) {
    edge.overlap_center_m = {x_m, 6.0};
    const Eigen::Matrix3d information =
        closer.Record({LoopPair{edge.from, edge.to, {}, 0.0}}, {edge})[0].information;
    EXPECT_NEAR(information(0, 0), 1.0 / (0.01 + std::pow(0.02 * arm_m, 2)), 1e-9) << x_m;
    EXPECT_EQ(information(1, 1), 0.0);
  }
}

// Two dives: only the sonar of the second is off its place.
TEST(LoopCloser, ExpectsEachDiveWhereItsOwnMountingPutsIt) {
  LoopCloser closer(LoopCloserParams{});
  Submap straight = At(0, 0.0, 0.0), turning = At(1, 0.0, 12.0);
  straight.heading_spread = turning.heading_spread = 0.8;
  closer.Add(straight, {0, std::nullopt, {0.3, 0.0}});
  Chain second{1, Eigen::Matrix3d(Eigen::Vector3d(0.04, 0.04, 1e-6).asDiagonal()), {0.3, 0.0}};
  closer.Add(turning, second);
  PoseGraph graph;
  graph.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  graph.mounting[0] = {};
  graph.mounting[1].sonar_m = {0.6, -0.2};
  ASSERT_TRUE(closer.SetSolution(graph));
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{1});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].prior.T_a_b.x, 0.6, 1e-9);
  EXPECT_NEAR(pairs[0].prior.T_a_b.y, 12.0 - 0.2, 1e-9);
  EXPECT_NEAR(pairs[0].prior.covariance(0, 0), 0.04 + 0.09, 1e-3);
  // Of the closure's two submaps only the second bends.
  GraphEdge edge;
  edge.kind = EdgeKind::kLoopClosure;
  edge.from = SubmapId{0};
  edge.to = SubmapId{1};
  edge.information.diagonal() << 100.0, 0.0, 1e6;
  const Eigen::Matrix3d information =
      closer.Record({LoopPair{edge.from, edge.to, {}, 0.0}}, {edge})[0].information;
  const double bend_m2 = 0.8 * 0.8 * 0.5 * (0.36 + 0.04);
  EXPECT_NEAR(information(0, 0), 1.0 / (1.0 / 100.0 + bend_m2), 1e-9);
  // The next submap of the second dive, the other way.
  closer.Add(At(2, 4.0, 22.0, kPi), second);
  graph.vertices.push_back({SubmapId{1},
                            {0.6, 11.8, 0.0},
                            Eigen::Matrix3d::Identity() * 1e-4,
                            Eigen::Matrix3d::Identity() * 1e-4});
  ASSERT_TRUE(closer.SetSolution(graph));
  const std::vector<LoopPair> next = closer.PairsFor(SubmapId{2});
  const auto of_first = std::find_if(
      next.begin(), next.end(), [](const LoopPair& pair) { return pair.target == SubmapId{1}; });
  ASSERT_NE(of_first, next.end());
  EXPECT_NEAR(of_first->prior.T_a_b.x, 4.0 - 1.2, 1e-9);
}

TEST_F(LooksAgain, AtAPairThatOnlyTheSolutionBroughtTogether) {
  EXPECT_TRUE(closer.PairsFor(SubmapId{2}).empty());
  Solve(12.0, 0.5);
  const std::vector<LoopPair> pairs = Again();
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].target.value, 0);
  EXPECT_EQ(pairs[0].source.value, 2);
  EXPECT_NEAR(pairs[0].prior.T_a_b.y, 12.0, 1e-9);
  EXPECT_NEAR(pairs[0].prior.covariance(0, 0), 0.49, 0.01);  // as the optimizer says
  EXPECT_FALSE(closer.HasMoved());
}

TEST_F(LooksAgain, OnlyAtWhatTheOptimizerAnswered) {
  Solve(12.0, 0.5);
  const CovarianceRequest& request = closer.request();
  EXPECT_EQ(request.graph_version, version);
  // 1 is a hundred metres from both others, which are known to half a metre.
  using Pair = std::pair<SubmapId, SubmapId>;
  EXPECT_EQ(request.pairs, (std::vector<Pair>{{SubmapId{0}, SubmapId{2}}}));
  EXPECT_FALSE(closer.HasMoved()) << "no answer yet";
  PairCovariances answer{
      "mapper", 0, version - 1, {{SubmapId{0}, SubmapId{2}, Eigen::Matrix3d::Identity()}}};
  closer.SetCovariances(answer);
  EXPECT_FALSE(closer.HasMoved()) << "of another solution";
  // Of submaps that are not there, the wrong way round, of no matrix that a covariance can be.
  answer = {"mapper",
            0,
            version,
            {{SubmapId{7}, SubmapId{2}, Eigen::Matrix3d::Identity()},
             {SubmapId{2}, SubmapId{0}, Eigen::Matrix3d::Identity()},
             {SubmapId{2}, SubmapId{2}, Eigen::Matrix3d::Identity()},
             {SubmapId{0}, SubmapId{2}, Eigen::Matrix3d::Ones()}}};
  answer.pairs[3].covariance(0, 1) = answer.pairs[3].covariance(1, 0) = 5.0;
  closer.SetCovariances(answer);
  EXPECT_TRUE(closer.HasMoved());
  EXPECT_TRUE(closer.request().pairs.empty()) << "answered";
  while (closer.HasMoved()) EXPECT_TRUE(closer.PairsToRetry(6).empty());
}

TEST_F(LooksAgain, AskingForNoPairThatPulls) {
  Solve(12.0, 0.5);
  Record(Again().at(0), LoopVerdict::kAccepted);
  for (const double weight : {1.0, 0.1}) {
    Solve(12.0, 0.01, weight);
    EXPECT_TRUE(closer.request().pairs.empty()) << "its own pull would be in its prior";
  }
}

TEST_F(LooksAgain, AtARefusedPairOnlyWhereItsPriorHasNews) {
  Solve(12.0, 0.5);
  const LoopPair pair = Again().at(0);
  EXPECT_EQ(Record(pair, LoopVerdict::kAmbiguous).size(), 1u);
  EXPECT_EQ(closer.rejected(), 1);
  Solve(12.0, 0.5);
  EXPECT_TRUE(Again().empty()) << "nothing has changed";
  Solve(12.2, 0.5);
  EXPECT_TRUE(Again().empty()) << "moved by a quarter of its sigma";
  Solve(13.5, 0.5);
  ASSERT_EQ(Again().size(), 1u) << "moved by two sigma";
  EXPECT_TRUE(Record(pair, LoopVerdict::kAmbiguous).empty()) << "the graph knows";
  EXPECT_EQ(Record(pair, LoopVerdict::kAccepted).size(), 1u);
  EXPECT_EQ(closer.rejected(), 0);
  EXPECT_EQ(closer.accepted(), 1);
}

TEST_F(LooksAgain, AtARefusedPairThatAnotherClosureNarrowed) {
  Solve(12.0, 0.5);
  Record(Again().at(0), LoopVerdict::kAmbiguous);
  Solve(12.0, 0.3);
  const std::vector<LoopPair> again = Again(6, 0.3);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_NEAR(again[0].prior.covariance(0, 0), 0.09, 0.01);
}

TEST_F(LooksAgain, AtAnAcceptedPairWhereTheSolutionDoesNotBelieveItAndItHasMoved) {
  Solve(12.0, 0.5);
  const LoopPair pair = Again().at(0);
  Record(pair, LoopVerdict::kAccepted);
  Solve(12.0, 0.01, 1.0);
  EXPECT_TRUE(Again().empty()) << "believed: its own narrowing is no news";
  Solve(15.0, 0.5, 0.0);
  const std::vector<LoopPair> again = Again();
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(Record(again[0], LoopVerdict::kOutsideWindow).size(), 1u);
  EXPECT_EQ(closer.accepted(), 0);
}

TEST_F(LooksAgain, WithinTheBudget) {
  Solve(12.0, 0.5);
  EXPECT_TRUE(Again(0).empty());
}

TEST(LoopCloser, LooksAtABoundedNumberOfSubmapsAndPairsASolution) {
  LoopCloser closer(LoopCloserParams{});
  PoseGraph graph;
  graph.graph_version = 1;
  for (int id = 0; id < 80; ++id) {
    Submap submap = OutlineAt(id, 0.1 * id);  // every one on all others
    closer.Add(submap);
    graph.vertices.push_back(
        {submap.id, {0.1 * id, 0.0, 0.0}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()});
  }
  ASSERT_TRUE(closer.SetSolution(graph));
  const CovarianceRequest& request = closer.request();
  EXPECT_EQ(request.pairs.size(), LoopCloser::kMaxPairsAsked);
  PairCovariances answer{"mapper", 0, 1, {}};
  for (const auto& [a, b] : request.pairs)
    answer.pairs.push_back({a, b, Eigen::Matrix3d::Identity()});
  closer.SetCovariances(answer);
  std::size_t looked_at = 0;
  for (; closer.HasMoved(); ++looked_at) EXPECT_TRUE(closer.PairsToRetry(0).empty());
  EXPECT_EQ(looked_at, LoopCloser::kMaxRetried);
}

TEST(LoopCloser, LooksPastSubmapsThatNoOtherCanMeet) {
  LoopCloser closer(LoopCloserParams{});
  PoseGraph graph;
  graph.graph_version = 1;
  for (int id = 0; id < 30; ++id) {
    const double x_m = id < 2 ? 0.0 : 1000.0 * id;  // the first two on each other, all others alone
    const Submap submap = OutlineAt(id, x_m);
    closer.Add(submap);
    graph.vertices.push_back(
        {submap.id, {x_m, 0.0, 0.0}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()});
  }
  ASSERT_TRUE(closer.SetSolution(graph));
  ASSERT_EQ(closer.request().pairs.size(), 1u);
  EXPECT_EQ(closer.request().pairs[0].second, SubmapId{1});
}

TEST(LoopCloser, TakesAnUnknownCovarianceForNoKnowledgeAtAll) {
  LoopCloser closer(LoopCloserParams{});
  closer.Add(At(0, 0.0, 0.0));
  Submap lost = At(1, 5.0, 0.0);
  lost.covariance_from_previous.reset();
  closer.Add(lost);
  const std::vector<GraphEdge> edges = closer.DeadReckoningEdge(SubmapId{1});
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_GT(edges[0].information(0, 0), 0.0) << "the graph stays in one piece";
  EXPECT_LT(edges[0].information(0, 0), 1e-5);
  EXPECT_LT(edges[0].information(2, 2), 0.11);
  // And the prior of what comes after it is as wide.
  closer.Add(At(2, 5.0, 10.0));
  for (const LoopPair& pair : closer.PairsFor(SubmapId{2})) {
    if (pair.target == SubmapId{0}) {
      EXPECT_GT(pair.prior.covariance(0, 0), 1e5);
    }
  }
}

}  // namespace
}  // namespace seastitch
