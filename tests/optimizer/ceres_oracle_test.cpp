#include <gtest/gtest.h>

#include "common/core/information.hpp"
#include "common/core/mounting.hpp"
#include "optimizer/robust_solver.hpp"
#include "tests/optimizer/ceres_solver.hpp"
#include "tests/optimizer/survey_graph.hpp"

namespace seastitch {
namespace {

void ExpectTheMinimumThatCeresFinds(bool seek_mounting) {
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
  if (seek_mounting) {
    graph.mounting_vertex = graph.num_vertices++;
    start.dead_reckoned.emplace_back();
    for (Factor& f : graph.factors)
      f.by_mounting = f.j == f.i + 1
                          ? DeadReckoningByMounting(f.cost.T_i_j)
                          : LoopClosureByMounting(f.cost.T_i_j, 0.5 * f.cost.T_i_j.Translation());
    const Eigen::Matrix3d W = Eigen::Vector3d(5.0, 5.0, 200.0).asDiagonal();
    graph.factors.push_back({kMap, graph.mounting_vertex, {{}, W}, {}});
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

TEST(RobustSolver, FindsTheMinimumThatCeresFinds) { ExpectTheMinimumThatCeresFinds(false); }

TEST(RobustSolver, FindsTheErrorsOfMountingThatCeresFinds) { ExpectTheMinimumThatCeresFinds(true); }

}  // namespace
}  // namespace seastitch
