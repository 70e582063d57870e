#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "tests/optimizer/graph_fixtures.hpp"

// The optimizer with closures that are wrong, and dead reckoning that is off.
namespace seastitch {
namespace {

TEST(PoseGraphOptimizer, HonestClosuresKeepTheirWeight) {
  int closures = 0, kept = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const PoseGraph solution = SolveAll(SimulateSurvey({.seed = seed}).updates);
    closures += static_cast<int>(solution.loop_edges.size());
    for (const SolvedEdge& edge : solution.loop_edges) kept += edge.weight > 0.5 ? 1 : 0;
  }
  EXPECT_GT(closures, 1000);
  EXPECT_GE(kept, closures * 995 / 1000);
}

class WrongClosures : public ::testing::TestWithParam<unsigned> {};

TEST_P(WrongClosures, ThirtyPercentDoNoHarm) {
  const SurveyGraph clean = SimulateSurvey({.seed = GetParam()});
  const SurveyGraph spoilt = SimulateSurvey({.wrong_share = 0.3, .seed = GetParam()});
  ASSERT_GT(spoilt.wrong.size(), 150u);
  const PoseGraph of_clean = SolveAll(clean.updates);
  const PoseGraph of_spoilt = SolveAll(spoilt.updates);
  EXPECT_LE(PositionRms(of_spoilt, clean.truth), 1.2 * PositionRms(of_clean, clean.truth));
  int honest = 0, honest_kept = 0;
  for (const SolvedEdge& edge : of_spoilt.loop_edges) {
    if (spoilt.wrong.contains({edge.from, edge.to})) {
      EXPECT_LT(edge.weight, 0.5) << edge.from.value << " to " << edge.to.value;
    } else {
      ++honest;
      honest_kept += edge.weight > 0.5 ? 1 : 0;
    }
  }
  EXPECT_GE(honest_kept, honest * 99 / 100);
}

INSTANTIATE_TEST_SUITE_P(Seeds, WrongClosures, ::testing::Values(1u, 2u, 3u));

// Four lines of ten submaps, three closures each to the line before: sound, but for the last two
// submaps, whose closures, all that they have, are off by the same vector.
struct LastTwoOff {
  std::vector<GraphUpdate> updates;
  std::set<std::pair<SubmapId, SubmapId>> wrong;
  std::vector<GraphUpdate> without;
  std::vector<Pose2> truth;
};

LastTwoOff SurveyWithLastTwoOff(unsigned seed, double off_m) {
  const SurveyGraph sound = SimulateSurvey({.vertices = 40, .closures = 3, .seed = seed});
  LastTwoOff out{sound.updates, {}, sound.updates, sound.truth};
  for (const std::size_t k : {38u, 39u}) {
    std::erase_if(out.without[k].edges,
                  [](const GraphEdge& e) { return e.kind == EdgeKind::kLoopClosure; });
    for (GraphEdge& e : out.updates[k].edges) {
      if (e.kind != EdgeKind::kLoopClosure) continue;
      e.T_from_to.y += off_m;  // all begin on one line: the same vector of the map
      out.wrong.insert({e.from, e.to});
    }
  }
  return out;
}

// Surveys of 20 in which a closure that is wrong is believed.
int SurveysMisled(double off_m) {
  int misled = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const LastTwoOff survey = SurveyWithLastTwoOff(seed, off_m);
    EXPECT_EQ(survey.wrong.size(), 6u);
    const PoseGraph solution = SolveAll(survey.updates);
    misled += std::any_of(solution.loop_edges.begin(),
                          solution.loop_edges.end(),
                          [&](const SolvedEdge& edge) {
                            return edge.weight > 0.5 && survey.wrong.contains({edge.from, edge.to});
                          })
                  ? 1
                  : 0;
  }
  return misled;
}

// The last two submaps hang on one step of 0.4 m. Each for itself, their six closures would outvote
// ten of its sigmas; together they count as two.
TEST(PoseGraphOptimizer, ClosuresWrongAlikeSeldomOutvoteDeadReckoning) {
  EXPECT_EQ(SurveysMisled(12.0), 0);
  EXPECT_LE(SurveysMisled(5.0), 7);  // each for itself: 16
}

// A compass says which way the map is turned, of all submaps a little: it neither hides which
// closures are wrong alike nor makes others look so.
TEST(PoseGraphOptimizer, HeadingsThatAreKnownChangeNoVerdictOnClosuresWrongAlike) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    LastTwoOff survey = SurveyWithLastTwoOff(seed, 12.0);
    const PoseGraph unknown = SolveAll(survey.updates);
    for (GraphUpdate& update : survey.updates) update.vertices[0].heading_sigma_rad = 0.02;
    PoseGraphOptimizer incremental{OptimizerParams{}};
    PoseGraph last;
    for (const GraphUpdate& update : survey.updates) {
      ASSERT_TRUE(incremental.Add(update));
      last = *incremental.Solve();
    }
    const PoseGraph known = SolveAll(survey.updates);
    for (std::size_t k = 0; k < known.loop_edges.size(); ++k) {
      const SolvedEdge& edge = known.loop_edges[k];
      EXPECT_NEAR(edge.weight, unknown.loop_edges[k].weight, 0.2) << seed;
      if (survey.wrong.contains({edge.from, edge.to})) {
        EXPECT_EQ(edge.weight, 0.0) << seed;
      }
    }
    EXPECT_LT(LargestDifference(known, last), 1e-6) << seed;
    EXPECT_GT(known.vertices[0].covariance(2, 2), 0.0) << seed;
  }
}

class OneLoop : public ::testing::TestWithParam<int> {};

// Of steps alike, 0.2 m each, and five closures at its end that share an error of 20 sigma of the
// way round. Every step is as far from what the others say: it is no sign that all are bad.
TEST_P(OneLoop, ClosedWrongByOneClusterIsNotBelieved) {
  const int n = GetParam();
  const Pose2 step{10.0, 0.0, 2.0 * kPi / n};
  std::vector<Pose2> poses = {{}};
  std::vector<GraphUpdate> updates = {{1, {{SubmapId{0}, {}, {}}}, {}}};
  for (int k = 1; k <= n; ++k) {
    poses.push_back(poses.back() * step);
    updates.push_back({k + 1,
                       {{SubmapId{k}, {}, poses.back()}},
                       {Edge(EdgeKind::kDeadReckoning, k - 1, k, step, 0.2, 0.001)}});
  }
  const std::pair<int, int> cluster[] = {{1, n - 1}, {0, n - 1}, {2, n - 1}, {1, n - 2}, {1, n}};
  for (const auto& [from, to] : cluster) {
    Pose2 there = poses[static_cast<std::size_t>(to)];
    there.x += 20.0 * 0.2 * std::sqrt(n);
    const Pose2 T = Inverse(poses[static_cast<std::size_t>(from)]) * there;
    updates.back().edges.push_back(Edge(EdgeKind::kLoopClosure, from, to, T, 0.02, 0.001));
  }
  for (const SolvedEdge& edge : SolveAll(updates).loop_edges) EXPECT_EQ(edge.weight, 0.0);
}

INSTANTIATE_TEST_SUITE_P(Steps, OneLoop, ::testing::Values(7, 24));

class DeadReckoningOff : public ::testing::TestWithParam<unsigned> {};

// Of the step to the last two submaps; their closures are right.
TEST_P(DeadReckoningOff, ByThreeSigmaIsCorrected) {
  LastTwoOff survey = SurveyWithLastTwoOff(GetParam(), 0.0);
  survey.updates[38].edges[0].T_from_to = Inverse(survey.truth[37]) * survey.truth[38];
  survey.updates[38].edges[0].T_from_to.y += 3.0 * 0.4;
  const PoseGraph solution = SolveAll(survey.updates);
  for (const SolvedEdge& edge : solution.loop_edges)
    if (survey.wrong.contains({edge.from, edge.to})) {
      EXPECT_GT(edge.weight, 0.5);
    }
}

// All lines after it say so, too.
TEST_P(DeadReckoningOff, ByTwentySigmaIsCorrectedWhereManyClosuresAgree) {
  LastTwoOff survey = SurveyWithLastTwoOff(GetParam(), 0.0);
  survey.updates[25].edges[0].T_from_to.y += 20.0 * 0.4;
  const PoseGraph solution = SolveAll(survey.updates);
  std::size_t kept = 0;
  for (const SolvedEdge& edge : solution.loop_edges) kept += edge.weight > 0.5 ? 1 : 0;
  EXPECT_GE(kept, solution.loop_edges.size() - 6);
}

INSTANTIATE_TEST_SUITE_P(Seeds, DeadReckoningOff, ::testing::Range(1u, 6u));

// The first submaps after the step that is wrong look as if their closures were; those of the next
// ones tell.
TEST(PoseGraphOptimizer, AClusterRefusedComesBackWhenLaterEvidenceSpeaksForIt) {
  std::vector<GraphUpdate> updates = SurveyWithLastTwoOff(1, 0.0).updates;
  updates[25].edges[0].T_from_to.y += 20.0 * 0.4;
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  const auto refused = [](const PoseGraph& solution) {
    return std::count_if(solution.loop_edges.begin(),
                         solution.loop_edges.end(),
                         [](const SolvedEdge& edge) { return edge.weight < 0.5; });
  };
  std::int64_t most = 0;
  PoseGraph solution;
  for (const GraphUpdate& update : updates) {
    ASSERT_TRUE(optimizer.Add(update));
    solution = *optimizer.Solve();
    most = std::max<std::int64_t>(most, refused(solution));
  }
  EXPECT_GE(most, 3);
  EXPECT_EQ(refused(solution), 0);
  EXPECT_LT(LargestDifference(solution, SolveAll(updates)), 1e-6);
}

// The limit: what agrees with itself, outnumbers the truth and lies within what dead reckoning
// allows wins. The mapper's window and the do-no-harm check stand against this, not the optimizer.
TEST(PoseGraphOptimizer, AClusterOfAgreeingWrongClosuresInTheMajorityIsBelieved) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  const Pose2 wrong{1.0, 0.5, 0.0};
  updates[4].edges = {updates[4].edges[0],
                      Edge(EdgeKind::kLoopClosure, 0, 4, wrong, 0.05, 0.005),
                      Edge(EdgeKind::kLoopClosure, 0, 3, {1.0, 10.5, -kPi / 2.0}, 0.05, 0.005),
                      Edge(EdgeKind::kLoopClosure, 1, 4, {0.5, 9.0, -kPi / 2.0}, 0.05, 0.005)};
  const PoseGraph solution = SolveAll(updates);
  for (const SolvedEdge& edge : solution.loop_edges) EXPECT_GT(edge.weight, 0.5);
}

// A straight line of steps of 10 m, 0.2 m each; `closures` say that they were 9.3 m.
std::vector<GraphUpdate> ShortenedLine(const std::vector<std::pair<int, int>>& closures) {
  std::vector<GraphUpdate> updates;
  for (int k = 0; k < 5; ++k) {
    updates.push_back({k + 1, {{SubmapId{k}, Time(Duration(k + 1)), {10.0 * k, 0.0, 0.0}}}, {}});
    if (k > 0)
      updates.back().edges = {
          Edge(EdgeKind::kDeadReckoning, k - 1, k, {10.0, 0.0, 0.0}, 0.2, 0.01)};
  }
  for (const auto& [from, to] : closures)
    updates.back().edges.push_back(
        Edge(EdgeKind::kLoopClosure, from, to, {9.3 * (to - from), 0.0, 0.0}, 0.05, 0.005));
  return updates;
}

TEST(PoseGraphOptimizer, ALoneClosureSevenSigmaFromDeadReckoningIsRefused) {
  const PoseGraph solution = SolveAll(ShortenedLine({{0, 4}}));
  EXPECT_EQ(solution.loop_edges[0].weight, 0.0);
  EXPECT_NEAR(solution.vertices[4].T_map_level.x, 40.0, 1e-6);
}

TEST(PoseGraphOptimizer, ARefusedClosureComesBackWhenLaterEvidenceSpeaksForIt) {
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : ShortenedLine({{0, 4}})) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_EQ(optimizer.Solve()->loop_edges[0].weight, 0.0);
  GraphUpdate later = ShortenedLine({{0, 2}, {0, 3}, {1, 4}}).back();
  later.version = 6;
  later.vertices.clear();
  ASSERT_TRUE(optimizer.Add(later));
  const PoseGraph solution = *optimizer.Solve();
  ASSERT_EQ(solution.loop_edges.size(), 4u);
  for (const SolvedEdge& edge : solution.loop_edges)
    EXPECT_GT(edge.weight, 0.5) << edge.from.value << " to " << edge.to.value;
  EXPECT_NEAR(solution.vertices[4].T_map_level.x, 37.2, 0.1);
}

}  // namespace
}  // namespace seastitch
