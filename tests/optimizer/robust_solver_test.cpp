#include "optimizer/solver/robust_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/information.hpp"
#include "common/core/mounting.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/optimizer/survey_graph.hpp"

namespace seastitch {
namespace {

struct Problem {
  FactorGraph graph;
  std::vector<Pose2> dead_reckoned;
};

Problem SurveyProblem(bool estimate_mounting) {
  const SurveyGraph survey = SimulateSurvey({.vertices = 40, .per_line = 8, .seed = 11});
  Problem p{{40, 0, {}}, {}};
  for (const GraphUpdate& update : survey.updates) {
    p.dead_reckoned.push_back(update.vertices[0].dead_reckoned);
    for (const GraphEdge& e : update.edges) {
      Factor factor{e.from.value, e.to.value, e.T_from_to, FactorInformation(e.information)->W};
      if (e.kind == EdgeKind::kLoopClosure) factor.loss.c2 = 16.27;
      p.graph.factors.push_back(factor);
    }
  }
  if (!estimate_mounting) return p;
  // Two dives, of vertices 0 to 23 and 24 to 39.
  constexpr int kSecondDive = 24;
  const std::array<int, 2> of_dives{p.graph.num_vertices, p.graph.num_vertices + 1};
  p.graph.num_vertices += 2;
  p.graph.num_mountings = 2;
  p.dead_reckoned.resize(42);
  for (Factor& f : p.graph.factors) {
    const int of_i = of_dives[f.i >= kSecondDive], of_j = of_dives[f.j >= kSecondDive];
    const Eigen::Vector2d center = 0.5 * f.T_i_j.Translation();
    if (!f.IsRobust())
      f.mounting[0] = {of_j, DeadReckoningByMounting(f.T_i_j)};
    else if (of_i == of_j)
      f.mounting[0] = {of_j, LoopClosureByMounting(f.T_i_j, center)};
    else
      f.mounting = {MountingTerm{of_j, LoopClosureByMountingOfTo(f.T_i_j, center)},
                    MountingTerm{of_i, LoopClosureByMountingOfFrom(center)}};
  }
  const Eigen::Matrix3d W = Eigen::Vector3d(5.0, 5.0, 200.0).asDiagonal();
  for (const int vertex : of_dives) p.graph.factors.push_back({kMap, vertex, {}, W});
  return p;
}

// The residual as the formula has it, by nothing of ours but the numbers of the factor.
Eigen::Vector3d IndependentResidual(const Factor& f, const Eigen::VectorXd& x) {
  const Eigen::Vector3d a = f.i == kMap ? Eigen::Vector3d(0, 0, 0) : x.segment<3>(3 * f.i).eval();
  const Eigen::Vector3d b = x.segment<3>(3 * f.j);
  const double c = std::cos(a.z()), s = std::sin(a.z());
  Eigen::Vector3d e(c * (b.x() - a.x()) + s * (b.y() - a.y()) - f.T_i_j.x,
                    -s * (b.x() - a.x()) + c * (b.y() - a.y()) - f.T_i_j.y,
                    std::remainder(b.z() - a.z() - f.T_i_j.yaw, 2.0 * kPi));
  for (const MountingTerm& term : f.mounting)
    if (term.vertex != kMap) e -= term.by * x.segment<3>(3 * term.vertex);
  return f.W * e;
}

double IndependentCost(const Problem& p, const Eigen::VectorXd& x) {
  double cost = 0.0;
  for (const Factor& f : p.graph.factors) {
    const double s = IndependentResidual(f, x).squaredNorm();
    cost += f.IsRobust() ? f.loss.Value(s, GraduatedLoss::kFinalMu) : s;
  }
  return cost;
}

// Gauss-Newton on re-weighted squares, dense, derivatives by differences, vertex 0 held.
Eigen::VectorXd DenseNewton(const Problem& p, Eigen::VectorXd x) {
  constexpr double kStep = 1e-6;
  for (int n = 0; n < 200; ++n) {
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(x.size(), x.size());
    Eigen::VectorXd g = Eigen::VectorXd::Zero(x.size());
    for (const Factor& f : p.graph.factors) {
      const Eigen::Vector3d r = IndependentResidual(f, x);
      const double w = f.IsRobust() ? f.loss.Weight(r.squaredNorm(), GraduatedLoss::kFinalMu) : 1.0;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, x.size());
      for (const int v : {f.i, f.j, f.mounting[0].vertex, f.mounting[1].vertex}) {
        for (int c = 3 * v; v > 0 && c < 3 * v + 3; ++c) {
          Eigen::VectorXd up = x, down = x;
          up(c) += kStep;
          down(c) -= kStep;
          J.col(c) = (IndependentResidual(f, up) - IndependentResidual(f, down)) / 2e-6;
        }
      }
      H += w * J.transpose() * J;
      g += w * J.transpose() * r;
    }
    H.topLeftCorner<3, 3>().setIdentity();
    const Eigen::VectorXd step = H.ldlt().solve(g);
    x -= step;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  return x;
}

class DenseCheck : public ::testing::TestWithParam<bool> {};

TEST_P(DenseCheck, TheSolutionIsTheMinimumThatADenseNewtonFinds) {
  const Problem p = SurveyProblem(GetParam());
  const RobustSolution solution = SolveRobustly(p.graph, {p.dead_reckoned}, {});
  EXPECT_TRUE(solution.converged);
  Eigen::VectorXd x(3 * p.graph.num_vertices);
  for (int v = 0; v < p.graph.num_vertices; ++v)
    x.segment<3>(3 * v) = solution.T_map_vertex[static_cast<std::size_t>(v)].Vector();
  const Eigen::VectorXd dense = DenseNewton(p, x);
  EXPECT_NEAR(IndependentCost(p, x), IndependentCost(p, dense), 1e-5);
  ASSERT_TRUE(solution.covariance);
  for (int v = 1; v < p.graph.num_vertices; ++v) {
    const Eigen::Vector3d off = x.segment<3>(3 * v) - dense.segment<3>(3 * v);
    const Eigen::Vector3d sigma =
        solution.covariance->marginal()[static_cast<std::size_t>(v)].diagonal().cwiseSqrt();
    EXPECT_LT(off.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-3) << v;
  }
}

INSTANTIATE_TEST_SUITE_P(Mounting, DenseCheck, ::testing::Bool());

// Found by Newton's method on a block Cholesky of our own, which solved this graph before Ceres
// did.
struct GoldenVertex {
  int id;
  Pose2 pose;
  Eigen::Vector3d sigma;
};
struct Golden {
  SurveyOptions options;
  bool with_mounting_and_headings;
  int accepted;
  std::vector<GoldenVertex> vertices;
};

std::vector<Golden> GoldenSolutions() {
  return {{{.vertices = 40, .per_line = 8, .wrong_share = 0.0, .seed = 21},
           false,
           160,
           {{7, {280.111716, -0.686809, -0.00150298}, {0.18477755, 0.50976800, 2.72540e-03}},
            {19, {120.084372, 59.744783, -0.00095473}, {0.09890262, 0.18674061, 2.31919e-03}},
            {31, {0.109424, 89.884232, 3.14042450}, {0.12508663, 0.10717195, 2.75130e-03}},
            {39, {280.319790, 119.343290, 0.00089666}, {0.19119740, 0.50863479, 3.79994e-03}}}},
          {{.vertices = 40, .per_line = 8, .wrong_share = 0.3, .seed = 22},
           false,
           160,
           {{7, {280.025363, 0.258324, -0.00029705}, {0.17574700, 0.44976262, 2.38052e-03}},
            {19, {119.835618, 60.070606, 0.00184319}, {0.10934357, 0.16732743, 2.13808e-03}},
            {31, {0.021079, 89.822940, -3.13702191}, {0.11982832, 0.10749114, 2.47332e-03}},
            {39, {279.885632, 120.325572, -0.00146166}, {0.18341331, 0.44974077, 3.63823e-03}}}},
          {{.vertices = 40, .per_line = 8, .wrong_share = 0.1, .seed = 23},
           true,
           160,
           {{7, {279.982682, -2.597246, -0.00775656}, {0.21148841, 5.18962178, 1.81626e-02}},
            {19, {120.258722, 58.993482, -0.00622499}, {1.07803906, 2.23126688, 1.81534e-02}},
            {31, {0.581792, 90.239051, 3.13591365}, {1.64023447, 0.13431505, 1.81928e-02}},
            {39, {280.983830, 117.436497, -0.01055925}, {2.13187038, 5.20639147, 1.83496e-02}}}}};
}

TEST(RobustSolver, FindsWhatTheSolverBeforeItFound) {
  for (const Golden& golden : GoldenSolutions()) {
    SCOPED_TRACE(golden.options.seed);
    PoseGraphOptimizer optimizer{OptimizerParams{}};
    for (GraphUpdate update : SimulateSurvey(golden.options).updates) {
      if (golden.with_mounting_and_headings) {
        update.mounting = {0.3, 0.005};
        update.vertices[0].heading_sigma_rad = 0.02;
      }
      ASSERT_TRUE(optimizer.Add(update));
    }
    const PoseGraph solution = *optimizer.Solve();
    const auto accepted = std::count_if(solution.loop_edges.begin(),
                                        solution.loop_edges.end(),
                                        [](const SolvedEdge& e) { return e.weight >= 0.5; });
    EXPECT_EQ(accepted, golden.accepted);
    for (const GoldenVertex& expected : golden.vertices) {
      const SolvedVertex& vertex = solution.vertices[static_cast<std::size_t>(expected.id)];
      Eigen::Vector3d off = vertex.T_map_level.Vector() - expected.pose.Vector();
      off.z() = WrapAngle(off.z());
      EXPECT_LT(off.cwiseQuotient(expected.sigma).cwiseAbs().maxCoeff(), 1e-3) << expected.id;
      const Eigen::Vector3d sigma = vertex.covariance.diagonal().cwiseSqrt();
      EXPECT_LT((sigma - expected.sigma).cwiseQuotient(expected.sigma).cwiseAbs().maxCoeff(), 1e-3);
    }
  }
}

TEST(RobustSolver, OutOfIterationsIsNotConverged) {
  PoseGraphOptimizer optimizer{OptimizerParams{.max_iterations = 1}};
  const SurveyGraph survey = SimulateSurvey({.vertices = 40, .per_line = 8, .wrong_share = 0.3});
  for (const GraphUpdate& update : survey.updates) ASSERT_TRUE(optimizer.Add(update));
  ASSERT_TRUE(optimizer.Solve());
  EXPECT_FALSE(optimizer.converged());
  EXPECT_EQ(optimizer.counters().at("solves_not_converged"), 1);
}

}  // namespace
}  // namespace seastitch
