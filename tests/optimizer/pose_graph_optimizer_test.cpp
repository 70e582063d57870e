#include "optimizer/pose_graph_optimizer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "tests/optimizer/graph_fixtures.hpp"
#include "tests/optimizer/hostile_graph.hpp"

namespace seastitch {
namespace {

TEST(PoseGraphOptimizer, ClosesADriftingSquareAndSpreadsTheError) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  const PoseGraph open = SolveAll(updates);
  updates[4].edges.push_back(SquareClosure());
  const PoseGraph closed = SolveAll(updates);

  const auto gap = [](const PoseGraph& g) {
    return (Inverse(g.vertices[0].T_map_level) * g.vertices[4].T_map_level).Vector();
  };
  EXPECT_GT(gap(open).head<2>().norm(), 0.5);
  EXPECT_LT(gap(closed).head<2>().norm(), 0.01);
  EXPECT_LT(std::abs(gap(closed).z()), Deg2Rad(0.2));
  for (std::size_t k = 1; k < 5; ++k) {
    const Pose2 step = Inverse(closed.vertices[k - 1].T_map_level) * closed.vertices[k].T_map_level;
    EXPECT_NEAR(step.yaw, Deg2Rad(90.0), Deg2Rad(0.5)) << "corner " << k;
  }
  ASSERT_EQ(closed.loop_edges.size(), 1u);
  EXPECT_EQ(closed.loop_edges[0].weight, 1.0);
}

TEST(PoseGraphOptimizer, FirstSubmapStaysWhereItIs) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  const SolvedVertex first = SolveAll(updates).vertices[0];
  EXPECT_EQ(first.T_map_level.x, 100.0);
  EXPECT_EQ(first.T_map_level.y, 50.0);
  EXPECT_EQ(first.T_map_level.yaw, 0.3);
  EXPECT_EQ(first.covariance.norm(), 0.0);
}

TEST(PoseGraphOptimizer, WithoutClosuresTheSolutionIsDeadReckoning) {
  const SurveyGraph survey = SimulateSurvey({.closures = 0});
  const PoseGraph solution = SolveAll(survey.updates);
  for (std::size_t k = 0; k < survey.updates.size(); ++k) {
    const Pose2 difference =
        Inverse(survey.updates[k].vertices[0].dead_reckoned) * solution.vertices[k].T_map_level;
    EXPECT_LT(difference.Vector().norm(), 1e-9);
  }
}

// A straight line of 30 submaps whose shape closures hold to 1 mrad, so that only the way it is
// turned is open; the heading errors are given, and what the filter says of them.
double TurnOfTheMap(const std::vector<double>& errors_rad,
                    const std::function<std::optional<double>(int)>& heading_sigma_rad,
                    double step_sigma_rad) {
  std::vector<GraphUpdate> updates;
  for (int k = 0; k < static_cast<int>(errors_rad.size()); ++k) {
    const double error = errors_rad[static_cast<std::size_t>(k)];
    GraphUpdate update{
        k + 1, {{SubmapId{k}, {}, {10.0 * k, 0.0, error}, heading_sigma_rad(k)}}, {}};
    if (k > 0) {
      const double before = errors_rad[static_cast<std::size_t>(k - 1)];
      update.edges = {Edge(EdgeKind::kDeadReckoning,
                           k - 1,
                           k,
                           {10.0, 0.0, error - before},
                           100.0,
                           step_sigma_rad),
                      Edge(EdgeKind::kLoopClosure, k - 1, k, {10.0, 0.0, 0.0}, 0.01, 0.001)};
    }
    updates.push_back(update);
  }
  const std::vector<SolvedVertex> solved = SolveAll(updates).vertices;
  double mean = 0.0;
  for (const SolvedVertex& vertex : solved) mean += vertex.T_map_level.yaw;
  return mean / static_cast<double>(solved.size());
}

// First-order Gauss-Markov, as of a compass.
std::vector<double> WanderingHeading(double sigma_rad, double kept, std::mt19937_64* random) {
  std::normal_distribution<double> normal(0.0, sigma_rad);
  std::vector<double> errors = {normal(*random)};
  while (errors.size() < 30)
    errors.push_back(kept * errors.back() + std::sqrt(1.0 - kept * kept) * normal(*random));
  return errors;
}

TEST(PoseGraphOptimizer, AllHeadingsTogetherSayWhichWayTheMapIsTurned) {
  constexpr double kSigma = 0.02;
  constexpr double kKept = 0.8;
  const double step_sigma = kSigma * std::sqrt(2.0 * (1.0 - kKept));
  std::mt19937_64 random(5);
  double first_alone = 0.0, all = 0.0;
  constexpr int kRuns = 50;
  for (int run = 0; run < kRuns; ++run) {
    const std::vector<double> errors = WanderingHeading(kSigma, kKept, &random);
    first_alone += std::pow(TurnOfTheMap(
                                errors, [](int) { return std::optional<double>(); }, step_sigma),
                            2);
    all += std::pow(TurnOfTheMap(
                        errors, [](int) { return kSigma; }, step_sigma),
                    2);
  }
  EXPECT_NEAR(std::sqrt(first_alone / kRuns), kSigma, 0.25 * kSigma);
  // The variance of the best estimate from n samples: sigma^2 (1 + kept) / (n (1 - kept) + 2 kept).
  const double best = kSigma * std::sqrt((1.0 + kKept) / (30.0 * (1.0 - kKept) + 2.0 * kKept));
  EXPECT_NEAR(std::sqrt(all / kRuns), best, 0.25 * best);
}

TEST(PoseGraphOptimizer, HeadingsOfAFreeGyroSayNothingBeyondTheFirst) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0.0, 0.01);
  std::vector<double> errors = {0.03};
  while (errors.size() < 30) errors.push_back(errors.back() + normal(random));
  const auto sigma_rad = [](int k) { return std::sqrt(0.02 * 0.02 + k * 0.01 * 0.01); };
  EXPECT_NEAR(TurnOfTheMap(errors, sigma_rad, 0.01), 0.03, 1e-3);
}

TEST(PoseGraphOptimizer, AHeadingSigmaThatCannotBeCountsAsNotKnown) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  const PoseGraph without = SolveAll(updates);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double sigma : {-1.0, 1e-300, 1e-9, 100.0, 1e300, kInfinity, std::nan("")}) {
    for (GraphUpdate& update : updates) update.vertices[0].heading_sigma_rad = sigma;
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    for (const GraphUpdate& update : updates) EXPECT_TRUE(optimizer.Add(update));
    EXPECT_EQ(LargestDifference(*optimizer.Solve(), without), 0.0) << sigma;
    EXPECT_EQ(optimizer.counters().at("headings_unusable"), 5) << sigma;
  }
}

// What no inverse holds in a double must not reach the headings of the others.
TEST(PoseGraphOptimizer, AStepOfWhichNextToNothingIsKnownLeavesTheSolutionFinite) {
  for (const double information : {1e-12, 1e-60, 1e-120, 1e-300}) {
    std::vector<GraphUpdate> updates = DriftingSquare();
    updates[4].edges.push_back(SquareClosure());
    for (GraphUpdate& update : updates) update.vertices[0].heading_sigma_rad = 0.02;
    updates[2].edges[0].information = information * Eigen::Matrix3d::Identity();
    for (const SolvedVertex& vertex : SolveAll(updates).vertices) {
      EXPECT_TRUE(vertex.T_map_level.Vector().allFinite()) << information;
      EXPECT_TRUE(vertex.covariance.allFinite()) << information;
    }
  }
}

class BatchAndIncremental : public ::testing::TestWithParam<double> {};

TEST_P(BatchAndIncremental, GiveTheSameAnswer) {
  const SurveyGraph survey =
      SimulateSurvey({.vertices = 40, .per_line = 8, .wrong_share = GetParam(), .seed = 5});
  PoseGraphOptimizer incremental{OptimizerParams{}};
  PoseGraph last;
  for (const GraphUpdate& update : survey.updates) {
    ASSERT_TRUE(incremental.Add(update));
    last = *incremental.Solve();
  }
  // As good as the minimiser is: a thousandth of a sigma; and exact as delivered.
  const PoseGraph batch = SolveAll(survey.updates);
  EXPECT_LT(LargestDifference(last, batch), 1e-3);
  const PoseGraph delivered = *incremental.Solve(SolveStart::kFromDeadReckoning);
  EXPECT_EQ(LargestDifference(delivered, batch), 0.0);
  ASSERT_EQ(last.loop_edges.size(), batch.loop_edges.size());
  for (std::size_t k = 0; k < batch.loop_edges.size(); ++k) {
    EXPECT_NEAR(last.loop_edges[k].weight, batch.loop_edges[k].weight, 1e-2);
    EXPECT_EQ(delivered.loop_edges[k].weight, batch.loop_edges[k].weight);
  }
  EXPECT_LT((last.vertices[20].covariance - batch.vertices[20].covariance).norm(), 1e-4);
  EXPECT_EQ(delivered.vertices[20].covariance, batch.vertices[20].covariance);
}

INSTANTIATE_TEST_SUITE_P(WrongShare, BatchAndIncremental, ::testing::Values(0.0, 0.05, 0.2, 0.4));

// As it comes, in lots, and after a restart in the middle of the dive.
TEST(PoseGraphOptimizer, WhatIsDeliveredDependsOnTheGraphAlone) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const SurveyGraph survey =
        SimulateSurvey({.vertices = 40, .per_line = 8, .wrong_share = 0.3, .seed = seed});
    const PoseGraph batch = SolveAll(survey.updates);
    for (const std::size_t lot : {1u, 7u}) {
      PoseGraphOptimizer optimizer{OptimizerParams{}};
      for (std::size_t k = 0; k < survey.updates.size(); ++k) {
        ASSERT_TRUE(optimizer.Add(survey.updates[k]));
        const bool is_running = seed % 2 == 0 || k > 20;
        if (k % lot == 0 && is_running) {
          ASSERT_TRUE(optimizer.Solve());
        }
      }
      const PoseGraph delivered = *optimizer.Solve(SolveStart::kFromDeadReckoning);
      EXPECT_EQ(LargestDifference(delivered, batch), 0.0) << seed;
      for (std::size_t k = 0; k < batch.loop_edges.size(); ++k)
        EXPECT_EQ(delivered.loop_edges[k].weight, batch.loop_edges[k].weight) << seed;
    }
  }
}

// All closures of a survey again, their sigmas 12 % larger. Where that changes no verdict (in four
// of these five surveys) the solution continues from the last one.
TEST(PoseGraphOptimizer, ClosuresWithAnotherCovarianceKeepTheirWeights) {
  const auto verdicts = [](const PoseGraph& solution) {
    std::vector<bool> accepted;
    for (const SolvedEdge& edge : solution.loop_edges)
      accepted.push_back(edge.weight >= kAcceptedWeight);
    return accepted;
  };
  int continued = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    SurveyGraph survey =
        SimulateSurvey({.vertices = 40, .per_line = 8, .wrong_share = 0.05, .seed = seed});
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    for (const GraphUpdate& update : survey.updates) ASSERT_TRUE(optimizer.Add(update));
    const PoseGraph before = *optimizer.Solve();
    GraphUpdate restated{optimizer.version() + 1, {}, {}};
    for (const auto& [pair, loop] : optimizer.store().loops()) {
      restated.edges.push_back(loop.edge);
      restated.edges.back().information /= 1.12 * 1.12;
    }
    survey.updates.push_back(restated);
    ASSERT_TRUE(optimizer.Add(restated));
    int steps = 0;
    const PoseGraph warm = *optimizer.Solve(SolveStart::kWarm, [&] { ++steps; });
    int steps_from_dead_reckoning = 0;
    const PoseGraph cold =
        *optimizer.Solve(SolveStart::kFromDeadReckoning, [&] { ++steps_from_dead_reckoning; });
    EXPECT_LT(LargestDifference(warm, cold), 1e-3);
    EXPECT_EQ(LargestDifference(cold, SolveAll(survey.updates)), 0.0);
    EXPECT_EQ(verdicts(warm), verdicts(cold));
    if (verdicts(cold) != verdicts(before)) continue;
    ++continued;
    EXPECT_LT(4 * steps, steps_from_dead_reckoning);
  }
  EXPECT_EQ(continued, 4);
}

TEST(GraphStore, AnotherPoseOrVerdictOfAClosureHasNoWeightYet) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  PoseGraphOptimizer solved{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(solved.Add(update));
  ASSERT_TRUE(solved.Solve());
  const auto weight_after = [&](const GraphEdge& edge) {
    GraphStore store = solved.store();
    EXPECT_TRUE(store.Add({6, {}, {edge}}));
    return store.loops().begin()->second.weight;
  };
  GraphEdge edge = SquareClosure();
  edge.information *= 0.5;
  const auto kept = weight_after(edge);
  ASSERT_TRUE(kept);
  EXPECT_GT(*kept, 0.9);
  edge.T_from_to.x += 0.01;
  EXPECT_FALSE(weight_after(edge));
  edge = SquareClosure();
  edge.verdict = LoopVerdict::kPoorFit;
  EXPECT_FALSE(weight_after(edge));
}

// 300 of what seastitch-bench-graphs --hostile draws more of.
TEST(PoseGraphOptimizer, NothingThatIsNoNumberComesOutOfAHostileGraph) {
  std::mt19937_64 random(9);
  int solved = 0;
  for (int n = 0; n < 300; ++n) {
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    optimizer.Add(HostileGraph(&random));
    for (const SolveStart start :
         {SolveStart::kWarm, SolveStart::kWarm, SolveStart::kFromDeadReckoning}) {
      const std::optional<PoseGraph> solution = optimizer.Solve(start);
      const std::map<std::string, std::int64_t> counted = optimizer.counters();
      if (!solution) {
        EXPECT_TRUE(counted.contains("solutions_not_finite")) << n;
        continue;
      }
      solved += optimizer.converged() ? 1 : 0;
      EXPECT_TRUE(optimizer.converged() || counted.contains("solves_not_converged")) << n;
      EXPECT_TRUE(!optimizer.lacks_covariance() || counted.contains("covariance_failed")) << n;
      EXPECT_TRUE(HasOnlyNumbers(*solution)) << n;
    }
  }
  EXPECT_GT(solved, 300);
}

TEST(PoseGraphOptimizer, TheSameGraphGivesTheSameBytes) {
  const SurveyGraph survey =
      SimulateSurvey({.vertices = 30, .per_line = 6, .wrong_share = 0.2, .seed = 7});
  const PoseGraph a = SolveAll(survey.updates);
  const PoseGraph b = SolveAll(survey.updates);
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    EXPECT_EQ(a.vertices[k].T_map_level.Vector(), b.vertices[k].T_map_level.Vector());
    EXPECT_EQ(a.vertices[k].covariance, b.vertices[k].covariance);
  }
}

TEST(PoseGraphOptimizer, CovariancesAreHonest) {
  double nees = 0.0;
  int count = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const SurveyGraph survey = SimulateSurvey({.vertices = 30, .per_line = 6, .seed = seed});
    const PoseGraph solution = SolveAll(survey.updates);
    for (const std::size_t k : {10u, 29u}) {
      const SolvedVertex& vertex = solution.vertices[k];
      Eigen::Vector3d e = vertex.T_map_level.Vector() - survey.truth[k].Vector();
      e.z() = WrapAngle(e.z());
      nees += e.dot(vertex.covariance.ldlt().solve(e)) / 3.0;
      ++count;
    }
  }
  EXPECT_GT(nees / count, 0.6);
  EXPECT_LT(nees / count, 1.5);
}

// The survey with the ids of submaps turned round so that `first` is the one that is held.
GraphUpdate HeldAt(int first, const SurveyGraph& survey) {
  const auto renamed = [first](SubmapId id) {
    return SubmapId{id.value == first ? 0 : id.value < first ? id.value + 1 : id.value};
  };
  GraphUpdate all{1, {}, {}};
  for (const GraphUpdate& update : survey.updates) {
    for (GraphVertex vertex : update.vertices) {
      vertex.id = renamed(vertex.id);
      all.vertices.push_back(vertex);
    }
    for (GraphEdge edge : update.edges) {
      edge.from = renamed(edge.from);
      edge.to = renamed(edge.to);
      all.edges.push_back(edge);
    }
  }
  return all;
}

TEST(PoseGraphOptimizer, KnowsARelativePoseAsWellAsThatOfTheOneWhereTheOtherIsHeld) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 30, .per_line = 6, .seed = 4});
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : survey.updates) optimizer.Add(update);
  ASSERT_TRUE(optimizer.Solve());
  const SubmapId a{11};
  const auto known =
      optimizer.RelativeCovariances({{a, SubmapId{3}}, {a, SubmapId{20}}, {a, SubmapId{29}}});
  ASSERT_EQ(known.size(), 3u);
  const PoseGraph held = SolveAll({HeldAt(a.value, survey)});
  ASSERT_EQ(held.vertices[0].covariance.norm(), 0.0);
  Eigen::Matrix3d into_axes_of_a = Eigen::Matrix3d::Identity();
  into_axes_of_a.topLeftCorner<2, 2>() = held.vertices[0].T_map_level.Rotation().transpose();
  for (const PairCovariance& pair : known) {
    const auto b = static_cast<std::size_t>(pair.b.value + (pair.b < a ? 1 : 0));
    const Eigen::Matrix3d expected =
        into_axes_of_a * held.vertices[b].covariance * into_axes_of_a.transpose();
    // A submap that the new names leave without a step before it is tied weakly to another.
    EXPECT_LT((pair.covariance - expected).norm(), 1e-3 * expected.norm()) << pair.b.value;
  }
}

// With closures that are refused, fixes, and errors of mounting sought.
TEST(PoseGraphOptimizer, SaysOfAnyPairWithTheNewestWhatTheSolutionSays) {
  SurveyGraph survey =
      SimulateSurvey({.vertices = 30, .per_line = 6, .wrong_share = 0.2, .seed = 4});
  survey.updates[20].edges.push_back(Fix(20, survey.truth[20].x, survey.truth[20].y, 0.5));
  for (GraphUpdate& update : survey.updates) update.mounting = {0.3, 0.005};
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : survey.updates) optimizer.Add(update);
  const PoseGraph solution = *optimizer.Solve();
  const SubmapId newest{29};
  const auto known = optimizer.RelativeCovariances({{SubmapId{7}, newest},
                                                    {SubmapId{7}, SubmapId{99}},
                                                    {SubmapId{0}, newest},
                                                    {newest, newest}});
  ASSERT_EQ(known.size(), 2u) << "99 is not there, and of one submap nothing is relative";
  for (const PairCovariance& pair : known) {
    const SolvedVertex& a = solution.vertices[static_cast<std::size_t>(pair.a.value)];
    const SolvedVertex& b = solution.vertices[29];
    const Eigen::Matrix3d expected = RelativeCovariance(
        a.T_map_level, b.T_map_level, a.covariance, b.covariance, a.covariance_with_newest);
    EXPECT_LT((pair.covariance - expected).norm(), 1e-9) << pair.a.value;
  }
  EXPECT_TRUE(optimizer.RelativeCovariances({}).empty());
  // Of the last solution, also when the graph has grown.
  optimizer.Add({31, {{SubmapId{30}, Time(Duration(1)), {}}}, {}});
  EXPECT_EQ(optimizer.RelativeCovariances({{SubmapId{7}, newest}}).size(), 1u);
  EXPECT_TRUE(optimizer.RelativeCovariances({{SubmapId{7}, SubmapId{30}}}).empty());
}

TEST(PoseGraphOptimizer, OnlyAcceptedEdgesPull) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  const PoseGraph open = SolveAll(updates);
  updates[4].edges.push_back(SquareClosure());
  updates[4].edges.back().verdict = LoopVerdict::kAmbiguous;
  const PoseGraph solution = SolveAll(updates);
  EXPECT_LT(LargestDifference(solution, open), 1e-9);
  ASSERT_EQ(solution.loop_edges.size(), 1u);
  EXPECT_EQ(solution.loop_edges[0].weight, 0.0);
}

TEST(PoseGraphOptimizer, APairRegisteredAgainCountsOnce) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[4].edges.push_back(SquareClosure());
  const PoseGraph once = SolveAll(updates);
  GraphEdge same_from_the_other_end = SquareClosure();
  std::swap(same_from_the_other_end.from, same_from_the_other_end.to);
  updates.push_back({6, {}, {same_from_the_other_end}});
  const PoseGraph again = SolveAll(updates);
  EXPECT_EQ(again.loop_edges.size(), 1u);
  EXPECT_LT((again.vertices[2].covariance - once.vertices[2].covariance).norm(), 1e-6);
}

TEST(PoseGraphOptimizer, AHoleInTheVersionsIsReportedAndNothingTaken) {
  const std::vector<GraphUpdate> updates = DriftingSquare();
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  EXPECT_TRUE(optimizer.Add(updates[0]));
  EXPECT_FALSE(optimizer.Add(updates[2]));
  EXPECT_EQ(optimizer.version(), 1);
  EXPECT_EQ(optimizer.Solve()->vertices.size(), 1u);
  EXPECT_TRUE(optimizer.Add(updates[1]));
  EXPECT_TRUE(optimizer.Add(updates[2]));
  EXPECT_EQ(optimizer.version(), 3);
}

TEST(PoseGraphOptimizer, ARepeatedVersionIsIgnored) {
  const std::vector<GraphUpdate> updates = DriftingSquare();
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  EXPECT_FALSE(optimizer.store().Contradicts(updates[2]));
  EXPECT_TRUE(optimizer.Add(updates[2]));
  EXPECT_EQ(optimizer.counters().at("updates_repeated"), 1);
  EXPECT_EQ(optimizer.version(), 5);
  GraphUpdate other = updates[2];
  other.edges[0].T_from_to.x += 1e-9;
  EXPECT_TRUE(optimizer.store().Contradicts(other));
}

TEST(PoseGraphOptimizer, MalformedPartsAreCountedAndTheRestIsTaken) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<GraphUpdate> updates = DriftingSquare();
  const PoseGraph good = SolveAll(updates);
  GraphUpdate& last = updates[4];
  last.vertices.push_back({SubmapId{3}, {}, {}});
  last.vertices.push_back({SubmapId{9}, {}, {nan, 0.0, 0.0}});
  last.edges.push_back(Edge(EdgeKind::kLoopClosure, 0, 77, {}, 1.0, 1.0));
  last.edges.push_back(Edge(EdgeKind::kLoopClosure, 2, 2, {}, 1.0, 1.0));
  last.edges.push_back(Edge(EdgeKind::kLoopClosure, 0, 2, {0.0, nan, 0.0}, 1.0, 1.0));
  last.edges.push_back(Edge(EdgeKind::kLoopClosure, 0, 2, {}, 1.0, 1.0));
  last.edges.back().information(0, 0) = -1.0;
  last.edges.push_back(Edge(EdgeKind::kLoopClosure, 0, 2, {}, 1.0, 1.0));
  last.edges.back().information.setZero();
  last.edges.push_back(Edge(EdgeKind::kPositionFix, 0, 2, {}, 1.0, 1.0));
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) EXPECT_TRUE(optimizer.Add(update));
  const PoseGraph solution = *optimizer.Solve();
  EXPECT_LT(LargestDifference(solution, good), 1e-9);
  EXPECT_TRUE(solution.loop_edges.empty());
  const std::map<std::string, std::int64_t> expected{{"vertices_duplicate", 1},
                                                     {"vertices_malformed", 1},
                                                     {"edges_unknown_vertex", 1},
                                                     {"edges_self_loop", 2},
                                                     {"edges_malformed", 1},
                                                     {"edges_bad_information", 2}};
  EXPECT_EQ(optimizer.counters(), expected);
}

TEST(PoseGraphOptimizer, ASubmapWithoutDeadReckoningEdgeStaysNearItsPredecessor) {
  std::vector<GraphUpdate> updates = DriftingSquare();
  const PoseGraph whole = SolveAll(updates);
  updates[2].edges.clear();
  const PoseGraph solution = SolveAll(updates);
  EXPECT_LT(LargestDifference(solution, whole), 1e-6);
  EXPECT_GT(solution.vertices[2].covariance(0, 0), 50.0 * 50.0);
}

TEST(PoseGraphOptimizer, CovariancesThatCannotBeFoundAreSaidToBeLarge) {
  OptimizerParams params;
  params.unlinked_sigma_m = 1e12;  // beside an edge of 0.1 mm, nothing a double can hold
  PoseGraphOptimizer optimizer{params};
  std::vector<GraphUpdate> updates = DriftingSquare();
  updates[3].edges.clear();
  for (GraphUpdate& update : updates)
    for (GraphEdge& edge : update.edges) edge.information = DiagonalInformation(1e-4, 1e-4);
  for (const GraphUpdate& update : updates) ASSERT_TRUE(optimizer.Add(update));
  const PoseGraph solution = *optimizer.Solve();
  EXPECT_TRUE(solution.vertices[4].covariance.allFinite());
  EXPECT_GE(solution.vertices[4].covariance(0, 0), 1e8);
  EXPECT_TRUE(optimizer.lacks_covariance());
  EXPECT_EQ(optimizer.counters().at("covariance_failed"), 1);
}

TEST(PoseGraphOptimizer, AnEmptyGraphHasAnEmptySolution) {
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  const PoseGraph solution = *optimizer.Solve();
  EXPECT_EQ(solution.graph_version, 0);
  EXPECT_TRUE(solution.vertices.empty());
}

}  // namespace
}  // namespace seastitch
