#include <gtest/gtest.h>

#include "common/core/information.hpp"
#include "optimizer/robust_solver.hpp"
#include "tests/optimizer/ceres_solver.hpp"
#include "tests/optimizer/survey_graph.hpp"

namespace seastitch {
namespace {

TEST(RobustSolver, FindsTheMinimumThatCeresFinds) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "Eigen aligns memory otherwise under AddressSanitizer than in Debian's Ceres";
#endif
  const SurveyGraph survey = SimulateSurvey({.vertices = 80, .per_line = 8, .seed = 11});
  FactorGraph graph{80, 0, {}};
  SolverStart start;
  for (const GraphUpdate& update : survey.updates) {
    start.dead_reckoned.push_back(update.vertices[0].dead_reckoned);
    for (const GraphEdge& e : update.edges)
      graph.factors.push_back(
          {e.from.value, e.to.value, {e.T_from_to, FactorInformation(e.information)->W}, {}});
  }
  const RobustSolution ours = SolveRobust(graph, start, 79, {});
  EXPECT_TRUE(ours.converged);
  const std::vector<Pose2> theirs = SolveWithCeres(graph, start.dead_reckoned, 1e-14);
  for (std::size_t v = 0; v < theirs.size(); ++v) {
    EXPECT_NEAR(ours.T_map_vertex[v].x, theirs[v].x, 1e-6);
    EXPECT_NEAR(ours.T_map_vertex[v].y, theirs[v].y, 1e-6);
    EXPECT_NEAR(WrapAngle(ours.T_map_vertex[v].yaw - theirs[v].yaw), 0.0, 1e-8);
  }
}

}  // namespace
}  // namespace seastitch
