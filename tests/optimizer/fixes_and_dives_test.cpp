#include <gtest/gtest.h>

#include <vector>

#include "tests/optimizer/graph_fixtures.hpp"

// Position fixes, starts and several dives in the graph.
namespace seastitch {
namespace {

TEST(PoseGraphOptimizer, PositionFixesMoveTheWholeSurvey) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  const PoseGraph before = SolveAll(updates);
  // The survey is 8 m further north than the start believed.
  for (const std::size_t k : {0u, 2u, 4u}) {
    const Pose2 pose = before.vertices[k].T_map_level;
    updates[k].edges.push_back(Fix(static_cast<int>(k), pose.x + 8.0, pose.y, 0.5));
  }
  const PoseGraph after = SolveAll(updates);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_NEAR(after.vertices[k].T_map_level.x - before.vertices[k].T_map_level.x, 8.0, 0.1);
    EXPECT_NEAR(after.vertices[k].T_map_level.y - before.vertices[k].T_map_level.y, 0.0, 0.1);
  }
  EXPECT_GT(after.vertices[0].covariance.norm(), 0.0);
  EXPECT_LT(after.vertices[0].covariance(0, 0), 0.5);
}

TEST(PoseGraphOptimizer, OneWrongPositionFixIsRefused) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  const PoseGraph before = SolveAll(updates);
  for (std::size_t k = 0; k < 5; ++k) {
    const Pose2 pose = before.vertices[k].T_map_level;
    const double error = k == 3 ? 300.0 : 0.0;
    updates[k].edges.push_back(Fix(static_cast<int>(k), pose.x + error, pose.y, 1.0));
  }
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_LT(LargestDifference(*optimizer.Solve(), before), 0.01);
  ASSERT_EQ(optimizer.store().fixes().size(), 5u);
  for (std::size_t k = 0; k < 5; ++k)
    EXPECT_EQ(optimizer.store().fixes()[k].weight, k == 3 ? 0.0 : 1.0) << k;
}

// Where the dive starts, and how well that is known.
GraphEdge Start(double sigma_m) {
  GraphEdge start = Edge(EdgeKind::kDeadReckoning, 0, 0, {100.0, 50.0, 0.3}, sigma_m, 1.0);
  start.information(2, 2) = 0.0;
  return start;
}

TEST(PoseGraphOptimizer, TheStartIsAsUncertainAsDeadReckoningSays) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[0].vertices[0].heading_sigma_rad = 0.02;
  updates[0].edges = {Start(2.0)};
  const SolvedVertex first = SolveAll(updates).vertices[0];
  EXPECT_NEAR(first.T_map_level.x, 100.0, 1e-9);
  EXPECT_NEAR(first.covariance(0, 0), 4.0, 1e-6);
  EXPECT_NEAR(first.covariance(2, 2), 4e-4, 1e-9);
}

TEST(PoseGraphOptimizer, ALoneFixIsWeighedAgainstTheStart) {
  for (const double off_m : {2.0, 30.0}) {
    std::vector<GraphUpdate> updates = DriftingSquare();
    updates[0].vertices[0].heading_sigma_rad = 0.02;
    updates[0].edges = {Start(2.0)};
    const PoseGraph before = SolveAll(updates);
    const Pose2 last = before.vertices[4].T_map_level;
    updates[4].edges.push_back(Fix(4, last.x + off_m, last.y, 1.0));
    const double moved = SolveAll(updates).vertices[4].T_map_level.x - last.x;
    if (off_m < 10.0)
      EXPECT_NEAR(moved, off_m * 4.0 / (4.0 + 1.0), 0.1);
    else
      EXPECT_NEAR(moved, 0.0, 1e-6);
  }
}

// Ten fixes of 1 m against a start that states 2 m.
TEST(PoseGraphOptimizer, AStartThatIsWrongRefusesNoFixesThatAgree) {
  SurveyGraph survey = SimulateSurvey({.vertices = 40, .per_line = 10, .closures = 3});
  survey.updates[0].edges = {Start(2.0)};
  survey.updates[0].edges[0].T_from_to = survey.truth[0] * Pose2{50.0, 0.0, 0.0};
  for (std::size_t k = 3; k < 40; k += 4)
    survey.updates[k].edges.push_back(
        Fix(static_cast<int>(k), survey.truth[k].x, survey.truth[k].y, 1.0));
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : survey.updates) ASSERT_TRUE(optimizer.Add(update));
  const PoseGraph solution = *optimizer.Solve();
  for (const StoredEdge& fix : optimizer.store().fixes()) EXPECT_GT(fix.weight.value(), 0.5);
  EXPECT_LT(PositionRms(solution, survey.truth), 3.0);
}

TEST(PoseGraphOptimizer, AMapWithoutAStartGoesWhereItsFirstFixIsHoweverFar) {
  for (const double off_m : {500.0, 5000.0, 20'000.0}) {
    std::vector<GraphUpdate> updates = DriftingSquare();
    for (GraphUpdate& update : updates) update.vertices[0].heading_sigma_rad = 0.02;
    const PoseGraph before = SolveAll(updates);
    const Pose2 last = before.vertices[4].T_map_level;
    updates[4].edges.push_back(Fix(4, last.x + off_m, last.y, 1.0));
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    // The map is solved before the fix comes.
    for (const GraphUpdate& update : updates) {
      ASSERT_TRUE(optimizer.Add(update));
      ASSERT_TRUE(optimizer.Solve(SolveStart::kWarm));
    }
    for (const SolveStart start : {SolveStart::kWarm, SolveStart::kFromDeadReckoning}) {
      const PoseGraph after = *optimizer.Solve(start);
      for (std::size_t k = 0; k < 5; ++k)
        EXPECT_NEAR(after.vertices[k].T_map_level.x - before.vertices[k].T_map_level.x, off_m, 1.0)
            << off_m << " " << k;
      EXPECT_EQ(optimizer.store().fixes()[0].weight, 1.0);
      EXPECT_NEAR(after.vertices[4].covariance(0, 0), 1.0, 0.1);
    }
  }
}

// Two dives of one survey: the second half of the submaps is a chain of its own, whose dead
// reckoning starts off by `off_m` to the north, 2 m as it says itself.
std::vector<GraphUpdate> InTwoDives(SurveyGraph survey, double off_m, bool closures) {
  std::vector<GraphUpdate> updates;
  const int second = static_cast<int>(survey.updates.size()) / 2;
  for (std::size_t k = 0; k < survey.updates.size(); ++k) {
    GraphUpdate update = survey.updates[k];
    update.version = static_cast<std::int64_t>(k) + 1;
    const bool of_second = static_cast<int>(k) >= second;
    for (GraphVertex& vertex : update.vertices) {
      vertex.chain = of_second ? 1 : 0;
      vertex.heading_sigma_rad = 0.01;
      if (of_second) vertex.dead_reckoned.x += off_m;
    }
    std::erase_if(update.edges, [&](const GraphEdge& e) {
      const bool between = (e.from.value < second) != (e.to.value < second);
      return between && (e.kind == EdgeKind::kDeadReckoning || !closures);
    });
    if (static_cast<int>(k) == 0 || static_cast<int>(k) == second) {
      GraphEdge start = Start(k == 0 ? 0.01 : 2.0);
      start.from = start.to = update.vertices[0].id;
      start.T_from_to = update.vertices[0].dead_reckoned;
      update.edges.push_back(start);
    }
    updates.push_back(update);
  }
  return updates;
}

TEST(PoseGraphOptimizer, ASecondDiveIsLaidOnTheFirstByClosures) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 40, .per_line = 10, .closures = 3});
  const PoseGraph joined = SolveAll(InTwoDives(survey, 3.0, true));
  const PoseGraph apart = SolveAll(InTwoDives(survey, 3.0, false));
  const auto off_m = [](const PoseGraph& solution, const PoseGraph& right) {
    double sum = 0.0;
    for (std::size_t k = 20; k < 40; ++k)
      sum += solution.vertices[k].T_map_level.x - right.vertices[k].T_map_level.x;
    return sum / 20.0;
  };
  const PoseGraph right = SolveAll(InTwoDives(survey, 0.0, true));
  EXPECT_NEAR(off_m(joined, right), 0.0, 0.3);
  EXPECT_NEAR(off_m(apart, SolveAll(InTwoDives(survey, 0.0, false))), 3.0, 0.01);
  // As well known as its own start alone, or by the first dive.
  EXPECT_NEAR(apart.vertices[20].covariance(0, 0), 4.0, 0.1);
  EXPECT_LT(joined.vertices[20].covariance(0, 0), 1.0);
}

TEST(PoseGraphOptimizer, DeadReckoningJoinsNoTwoDives) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  for (std::size_t k = 3; k < updates.size(); ++k) updates[k].vertices[0].chain = 1;
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_EQ(optimizer.counters().at("edges_between_chains"), 1);
  const PoseGraph solution = *optimizer.Solve();
  EXPECT_GT(solution.vertices[3].covariance(0, 0), 1e5);  // tied to nothing, and says so
}

TEST(PoseGraphOptimizer, ChainsRise) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[1].vertices[0].chain = 2;
  updates[2].vertices[0].chain = 1;
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_GE(optimizer.counters().at("vertices_malformed"), 1);
}

TEST(PoseGraphOptimizer, OnlyTheFirstSubmapHasAStart) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[2].edges.push_back(Start(1.0));
  updates[2].edges.back().from = updates[2].edges.back().to = SubmapId{2};
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_EQ(optimizer.counters().at("edges_start_not_first"), 1);
}

}  // namespace
}  // namespace seastitch
