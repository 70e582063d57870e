#include <gtest/gtest.h>

#include "tests/optimizer/graph_fixtures.hpp"

// When the graph is to be solved again.
namespace seastitch {
namespace {

TEST(IsSolutionDue, WithEachVersionAtFirstAndThenMoreRarely) {
  EXPECT_TRUE(IsSolutionDue(1, 0));
  EXPECT_TRUE(IsSolutionDue(100, 100)) << "only closures were added";
  EXPECT_FALSE(IsSolutionDue(101, 100));
  EXPECT_TRUE(IsSolutionDue(102, 100));
  EXPECT_FALSE(IsSolutionDue(3030, 3000));
  EXPECT_TRUE(IsSolutionDue(3031, 3000));
  EXPECT_TRUE(IsSolutionDue(3000, 0));
}

class LongGraph : public ::testing::Test {
 protected:
  static constexpr std::size_t kSolved = 150;
  LongGraph() {
    for (std::size_t k = 0; k < kSolved; ++k) optimizer_.Add(survey_.updates[k]);
    EXPECT_TRUE(optimizer_.IsDue());
    optimizer_.Solve();
    EXPECT_FALSE(optimizer_.IsDue());
  }
  GraphUpdate& next() { return survey_.updates[kSolved]; }
  bool IsDueWithNext() {
    optimizer_.Add(next());
    return optimizer_.IsDue();
  }
  void MoveClosure(double by_m) {
    GraphEdge& closure = next().edges.back();
    ASSERT_EQ(closure.kind, EdgeKind::kLoopClosure);
    closure.T_from_to.x += by_m;
  }

  SurveyGraph survey_ = SimulateSurvey({.vertices = kSolved + 5, .closures = 1, .seed = 2});
  PoseGraphOptimizer optimizer_{OptimizerParams{}};
};

TEST_F(LongGraph, WaitsWhereAClosureIsAsPredicted) {
  EXPECT_FALSE(IsDueWithNext());
  optimizer_.Add(survey_.updates[kSolved + 1]);
  EXPECT_TRUE(optimizer_.IsDue()) << "a 100th part is new";
}

TEST_F(LongGraph, IsSolvedAtOnceByAClosureBeyondItsPrior) {
  MoveClosure(3.0);
  EXPECT_TRUE(IsDueWithNext());
}

TEST_F(LongGraph, HeedsNoClosureThatWasRejected) {
  MoveClosure(30.0);
  next().edges.back().verdict = LoopVerdict::kPoorFit;
  EXPECT_FALSE(IsDueWithNext());
}

TEST_F(LongGraph, IsSolvedAtOnceWhereNothingPredictsAClosure) {
  ASSERT_EQ(next().edges.front().kind, EdgeKind::kDeadReckoning);
  next().edges.erase(next().edges.begin());
  EXPECT_TRUE(IsDueWithNext());
}

TEST_F(LongGraph, IsSolvedAtOnceAtTheEndAndAfterARestart) {
  next().edges.clear();
  next().final = true;
  EXPECT_TRUE(IsDueWithNext());
}

TEST_F(LongGraph, IsNotDueByARepetition) {
  optimizer_.Add(survey_.updates[kSolved - 1]);
  EXPECT_FALSE(optimizer_.IsDue());
}

}  // namespace
}  // namespace seastitch
