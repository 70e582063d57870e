#include "mapper/loops/loop_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/submap.hpp"

namespace seastitch {
namespace {

constexpr double kPriorRatio = 0.0003;

VarianceComponents WithErrorRatio(double ratio) {
  VarianceComponents components;
  components.correlated_error_ratio = ratio;
  return components;
}

// A closure whose covariance is the square of the correlated error. best_ratio: where its
// likelihood, which is sharp, has its maximum; std::nullopt: nowhere.
ClosureStatistics StatisticsOf(const LoopPair& pair,
                               std::optional<double> best_ratio,
                               double registered_under) {
  ClosureStatistics closure;
  closure.target = pair.target;
  closure.source = pair.source;
  closure.altitude_m = 1.0;
  for (auto* matrix : {&closure.fixed,
                       &closure.white,
                       &closure.correlated_error,
                       &closure.position_walk,
                       &closure.heading_walk})
    matrix->setZero(3, 3);
  closure.correlated_error.setIdentity();
  closure.jacobian.setIdentity(3, 3);
  closure.registered_under = closure.stated_under = WithErrorRatio(registered_under);
  if (!best_ratio) return closure;
  for (std::size_t s = 0; s < kErrorRatioAxis.size; ++s)
    for (std::size_t q = 0; q < kPositionWalkAxis.size; ++q)
      for (std::size_t p = 0; p < kHeadingWalkAxis.size; ++p)
        closure.likelihood.Set(
            s, q, p, 1e4 * std::pow(std::log(kErrorRatioAxis.At(s) / *best_ratio), 2));
  return closure;
}

// Four submaps of which 0 overlaps the others.
class NoiseInLoopSearch : public testing::Test {
 protected:
  NoiseInLoopSearch() : search(Started()) {}

  static LoopSearch Started() {
    LoopCloserParams params;
    params.registration.noise = WithErrorRatio(kPriorRatio);
    LoopSearch search{params};
    for (int id = 0; id < 4; ++id) {
      Submap submap;
      submap.id = SubmapId{id};
      submap.T_map_submap = MakePose({4.0 * id, 0.0, 10.0}, Eigen::Matrix3d::Identity());
      submap.covariance_from_previous = 0.01 * Eigen::Matrix3d::Identity();
      submap.footprint = {{-30.0, -12.0}, {30.0, -12.0}, {30.0, 12.0}, {-30.0, 12.0}};
      submap.predicted_information = 1000.0 * Eigen::Matrix3d::Identity();
      search.Add(submap);
    }
    return search;
  }
  static LoopPair PairOf(int source) {
    return {SubmapId{0},
            SubmapId{source},
            {{4.0 * source, 0.1, 0.0}, 0.04 * Eigen::Matrix3d::Identity()},
            0.0};
  }
  static RegistrationResultSet Registered(const LoopPair& pair,
                                          std::optional<double> best_ratio,
                                          double registered_under) {
    RegistrationResultSet results = Refused(pair);
    results.edges[0].verdict = LoopVerdict::kAccepted;
    results.statistics = {StatisticsOf(pair, best_ratio, registered_under)};
    return results;
  }
  static RegistrationResultSet Refused(const LoopPair& pair) {
    GraphEdge edge;
    edge.kind = EdgeKind::kLoopClosure;
    edge.from = pair.target;
    edge.to = pair.source;
    edge.T_from_to = pair.prior.T_a_b;
    edge.verdict = LoopVerdict::kPoorFit;
    RegistrationResultSet results;
    results.job.pairs = {pair};
    results.edges = {edge};
    return results;
  }
  // Closures of 1 without a likelihood, and of 2 with all of it.
  static std::vector<RegistrationResultSet> TwoClosures(double best_ratio) {
    return {Registered(PairOf(1), std::nullopt, kPriorRatio),
            Registered(PairOf(2), best_ratio, best_ratio)};
  }
  static void Solve(LoopSearch* search) {
    PoseGraph graph;
    graph.graph_version = 1;
    for (int id = 0; id < 4; ++id)
      graph.vertices.push_back({SubmapId{id},
                                {4.0 * id, 0.0, 0.0},
                                0.01 * Eigen::Matrix3d::Identity(),
                                0.01 * Eigen::Matrix3d::Identity()});
    ASSERT_EQ(search->Take(graph, 1), LoopSearch::Verdict::kUsed);
  }
  // Every pair to be registered, where the optimizer answers no request.
  static std::vector<LoopPair> Again(LoopSearch* search) {
    std::vector<LoopPair> all;
    while (const auto step = search->LookAgain(std::nullopt))
      all.insert(all.end(), step->pairs.begin(), step->pairs.end());
    return all;
  }
  static std::vector<int> SourcesOf(const std::vector<GraphEdge>& edges) {
    std::vector<int> sources;
    for (const GraphEdge& edge : edges) sources.push_back(edge.to.value);
    return sources;
  }
  double Ratio() const { return search.noise().components().correlated_error_ratio; }

  LoopSearch search;
};

TEST_F(NoiseInLoopSearch, StatesAClosureAnewWhereASigmaChangesByMoreThanATenth) {
  using Ids = std::vector<int>;
  auto edges = search.Record(Registered(PairOf(1), std::nullopt, kPriorRatio));
  EXPECT_EQ(SourcesOf(edges), Ids{1});
  edges = search.Record(Registered(PairOf(2), 1.09 * kPriorRatio, kPriorRatio));
  EXPECT_NEAR(Ratio(), 1.09 * kPriorRatio, 1e-3 * kPriorRatio);
  EXPECT_EQ(SourcesOf(edges), Ids{2});
  edges = search.Record(Registered(PairOf(3), 1.2 * kPriorRatio, kPriorRatio));
  EXPECT_GT(Ratio(), 1.12 * kPriorRatio);
  EXPECT_LT(Ratio(), 1.17 * kPriorRatio);
  // 1 was stated under the prior, 2 under 1.09 times it.
  ASSERT_EQ(SourcesOf(edges), (Ids{3, 1}));
  EXPECT_NEAR(edges[1].information(0, 0) * Ratio() * Ratio(), 1.0, 1e-9);
  EXPECT_EQ(edges[1].T_from_to.x, PairOf(1).prior.T_a_b.x);
  EXPECT_EQ(edges[1].verdict, LoopVerdict::kAccepted);
  // Downwards likewise, from what was last stated.
  edges = search.Record(Registered(PairOf(3), kPriorRatio / 1.2, kPriorRatio));
  EXPECT_GT(Ratio(), 0.93 * kPriorRatio);
  EXPECT_EQ(SourcesOf(edges), (Ids{3, 1, 2}));
}

TEST_F(NoiseInLoopSearch, KeepsTheNoiseOfARegistrationThatExpectedFourTimesTooMuch) {
  auto results = TwoClosures(kPriorRatio / 3.9);
  search.Record(results[0]);
  auto edges = search.Record(results[1]);
  ASSERT_EQ(edges.size(), 2u) << "less than four times: stated under the estimate";
  EXPECT_NEAR(edges[1].information(0, 0) * Ratio() * Ratio(), 1.0, 1e-9);
  Solve(&search);
  EXPECT_TRUE(Again(&search).empty());

  LoopSearch outdated = Started();
  results = TwoClosures(kPriorRatio / 4.2);
  outdated.Record(results[0]);
  EXPECT_EQ(SourcesOf(outdated.Record(results[1])), std::vector<int>{2});
  EXPECT_TRUE(Again(&outdated).empty()) << "before a solution";
  Solve(&outdated);
  const std::vector<LoopPair> again = Again(&outdated);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].source, SubmapId{1});
  EXPECT_EQ(again[0].prior.T_a_b.y, PairOf(1).prior.T_a_b.y) << "not the solution's";
  const double now = outdated.noise().components().correlated_error_ratio;
  edges = outdated.Record(Registered(again[0], std::nullopt, now));
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_NEAR(edges[0].information(0, 0) * now * now, 1.0, 1e-6);
}

TEST_F(NoiseInLoopSearch, RegistersAnOutdatedClosureAgainOnce) {
  for (const auto& results : TwoClosures(kPriorRatio / 5.0)) search.Record(results);
  Solve(&search);
  const std::vector<LoopPair> again = Again(&search);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_TRUE(Again(&search).empty()) << "while it is registered";
  search.Record(Registered(again[0], std::nullopt, kPriorRatio / 5.0));
  EXPECT_TRUE(Again(&search).empty());
  // The estimate falls again, below a quarter of what both were registered with.
  search.Record(Registered(PairOf(3), kPriorRatio / 1000.0, kPriorRatio / 1000.0));
  ASSERT_LT(Ratio(), kPriorRatio / 25.0);
  const std::vector<LoopPair> others = Again(&search);
  ASSERT_EQ(others.size(), 1u);
  EXPECT_EQ(others[0].source, SubmapId{2});
}

TEST_F(NoiseInLoopSearch, KeepsAClosureWhoseSecondRegistrationIsRefused) {
  for (const auto& results : TwoClosures(kPriorRatio / 5.0)) search.Record(results);
  Solve(&search);
  const std::vector<LoopPair> again = Again(&search);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_TRUE(search.Record(Refused(again[0])).empty());
  EXPECT_EQ(search.accepted(), 2);
  EXPECT_NE(search.noise().Find(SubmapId{0}, SubmapId{1}), nullptr);
  EXPECT_TRUE(Again(&search).empty());
  // A retry under another prior has the last word.
  LoopPair retry = PairOf(1);
  retry.prior.T_a_b.y += 0.3;
  EXPECT_EQ(SourcesOf(search.Record(Refused(retry))), std::vector<int>{1});
  EXPECT_EQ(search.accepted(), 1);
  EXPECT_EQ(search.noise().Find(SubmapId{0}, SubmapId{1}), nullptr);
}

TEST_F(NoiseInLoopSearch, RegistersAgainOnceOverARestart) {
  const auto results = TwoClosures(kPriorRatio / 5.0);
  for (const bool accepted : {true, false}) {
    SCOPED_TRACE(accepted);
    LoopSearch resumed = Started();
    for (const auto& result : results) resumed.Restore(result);
    LoopSearch waiting = Started();  // stopped before the second registration
    for (const auto& result : results) waiting.Restore(result);
    Solve(&waiting);
    EXPECT_EQ(Again(&waiting).size(), 1u);
    resumed.Restore(accepted ? Registered(PairOf(1), std::nullopt, kPriorRatio)
                             : Refused(PairOf(1)));
    Solve(&resumed);
    EXPECT_TRUE(Again(&resumed).empty());
  }
}

}  // namespace
}  // namespace seastitch
