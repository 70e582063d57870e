#include "optimizer/normal_equations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <random>

#include "common/core/information.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/optimizer/survey_graph.hpp"

namespace seastitch {
namespace {

struct Problem {
  FactorGraph graph;
  std::vector<Pose2> poses;
  std::vector<double> weights;
};

Problem SurveyProblem(int fixed_vertex) {
  SurveyOptions options;
  options.vertices = 30;
  options.per_line = 6;
  const SurveyGraph survey = SimulateSurvey(options);
  Problem p{{options.vertices, fixed_vertex, {}}, survey.truth, {}};
  for (const GraphUpdate& update : survey.updates)
    for (const GraphEdge& e : update.edges)
      p.graph.factors.push_back(
          {e.from.value, e.to.value, {e.T_from_to, FactorInformation(e.information)->W}, {}});
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k)
    p.weights.push_back(p.graph.factors[k].j == p.graph.factors[k].i + 1 ? 1.0
                        : k % 7 == 0                                     ? 0.0
                                                                         : 0.6);
  return p;
}

// The same with errors of mounting, each factor by its own.
Problem SurveyProblemWithMounting() {
  Problem p = SurveyProblem(0);
  p.graph.mounting_vertex = p.graph.num_vertices++;
  p.poses.push_back({0.3, -0.2, 0.004});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-20.0, 20.0);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    if (k % 5 == 0) continue;
    for (double& by : p.graph.factors[k].by_mounting.topRows<2>().reshaped()) by = within(random);
  }
  const Eigen::Matrix3d W = Eigen::Vector3d(5.0, 5.0, 200.0).asDiagonal();
  p.graph.factors.push_back({kMap, p.graph.mounting_vertex, {{}, W}, {}});
  p.weights.push_back(1.0);
  p.graph.factors.push_back({kMap, 4, {p.poses[4], W}, {}, 1, false, Eigen::Matrix3d::Zero()});
  p.graph.factors.back().by_mounting.topLeftCorner<2, 2>() = p.poses[4].Rotation();
  p.weights.push_back(1.0);
  return p;
}

// Of the residual of one factor by all unknowns, by differences.
Eigen::MatrixXd DenseJacobian(const Problem& p, std::size_t k) {
  constexpr double kStep = 1e-5;
  Eigen::MatrixXd J(3, 3 * p.graph.num_vertices);
  for (int v = 0; v < p.graph.num_vertices; ++v) {
    for (int c = 0; c < 3; ++c) {
      const auto moved = [&](double by) {
        std::vector<Pose2> poses = p.poses;
        Pose2& pose = poses[static_cast<std::size_t>(v)];
        (c == 0 ? pose.x : c == 1 ? pose.y : pose.yaw) += by;
        return Residual(p.graph, k, poses);
      };
      J.col(3 * v + c) = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
    }
  }
  if (p.graph.fixed_vertex >= 0) J.middleCols<3>(3 * p.graph.fixed_vertex).setZero();
  return J;
}

// Rows and columns of the fixed vertex are left at zero.
Eigen::MatrixXd DenseCovariance(const Problem& p) {
  const int size = 3 * p.graph.num_vertices;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Factor& f = p.graph.factors[k];
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, size);
    Eigen::Matrix3d J_i, J_j;
    const Pose2 T_i = f.i == kMap ? Pose2{} : p.poses[static_cast<std::size_t>(f.i)];
    f.cost.Evaluate(T_i, p.poses[static_cast<std::size_t>(f.j)], &J_i, &J_j);
    if (f.i != kMap) J.middleCols<3>(3 * f.i) = J_i;
    J.middleCols<3>(3 * f.j) = J_j;
    H += p.weights[k] * J.transpose() * J;
  }
  const int fixed = p.graph.fixed_vertex;
  if (fixed >= 0) {
    H.middleRows<3>(3 * fixed).setZero();
    H.middleCols<3>(3 * fixed).setZero();
    H.block<3, 3>(3 * fixed, 3 * fixed).setIdentity();
  }
  Eigen::MatrixXd covariance = H.inverse();
  if (fixed >= 0) covariance.block<3, 3>(3 * fixed, 3 * fixed).setZero();
  return covariance;
}

std::optional<GraphCovariance> ComputeCovariance(const Problem& p, int newest) {
  NormalEquations equations(p.graph);
  equations.Linearise(p.poses);
  if (!equations.Factorize(p.weights)) return std::nullopt;
  return equations.Covariance(newest);
}

void ExpectEqualsDense(const Problem& p, int newest) {
  const auto sparse = ComputeCovariance(p, newest);
  ASSERT_TRUE(sparse);
  const Eigen::MatrixXd dense = DenseCovariance(p);
  for (int v = 0; v < p.graph.num_vertices; ++v) {
    const Eigen::Matrix3d marginal = dense.block<3, 3>(3 * v, 3 * v);
    const Eigen::Matrix3d cross = dense.block<3, 3>(3 * v, 3 * newest);
    const auto k = static_cast<std::size_t>(v);
    EXPECT_LT((sparse->marginal[k] - marginal).norm(), 1e-8 * (1e-6 + marginal.norm())) << v;
    EXPECT_LT((sparse->with_newest[k] - cross).norm(), 1e-8 * (1e-6 + cross.norm())) << v;
  }
}

TEST(NormalEquations, EqualsTheDenseInverseWithAFixedVertex) {
  ExpectEqualsDense(SurveyProblem(0), 29);
  ExpectEqualsDense(SurveyProblem(12), 5);
}

TEST(NormalEquations, EqualsTheDenseInverseWithAPrior) {
  Problem p = SurveyProblem(-1);
  p.graph.factors.push_back({kMap, 3, {p.poses[3], Eigen::Matrix3d::Identity()}, {}});
  p.weights.push_back(1.0);
  ExpectEqualsDense(p, 29);
}

TEST(NormalEquations, CrossCovarianceOfTheNewestWithItselfIsItsMarginal) {
  const Problem p = SurveyProblem(0);
  const auto covariance = ComputeCovariance(p, 29);
  ASSERT_TRUE(covariance);
  EXPECT_LT((covariance->marginal[29] - covariance->with_newest[29]).norm(), 1e-12);
}

TEST(NormalEquations, KnowsTheOpenPartOfResidualsThatAreLeftOut) {
  const Problem p = SurveyProblem(0);
  const auto covariance = ComputeCovariance(p, 29);
  ASSERT_TRUE(covariance);
  const Eigen::MatrixXd dense = DenseCovariance(p);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Factor& f = p.graph.factors[k];
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, dense.rows());
    Eigen::Matrix3d J_i, J_j;
    f.cost.Evaluate(
        p.poses[static_cast<std::size_t>(f.i)], p.poses[static_cast<std::size_t>(f.j)], &J_i, &J_j);
    J.middleCols<3>(3 * f.i) = J_i;
    J.middleCols<3>(3 * f.j) = J_j;
    const Eigen::Matrix3d expected = J * dense * J.transpose();
    EXPECT_LT((covariance->of_residual[k] - expected).norm(), 1e-7 * (1.0 + expected.norm())) << k;
  }
}

TEST(NormalEquations, ErrorsOfMountingAreUnknownsOfAllTheirFactors) {
  const Problem p = SurveyProblemWithMounting();
  NormalEquations equations(p.graph);
  equations.Linearise(p.poses);
  ASSERT_TRUE(equations.Factorize(p.weights));
  const int size = 3 * p.graph.num_vertices;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
  H.topLeftCorner<3, 3>().setIdentity();  // the fixed vertex
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Eigen::MatrixXd J = DenseJacobian(p, k);
    H += p.weights[k] * J.transpose() * J;
    g += p.weights[k] * J.transpose() * Residual(p.graph, k, p.poses);
  }
  const Eigen::VectorXd step = -H.ldlt().solve(g);
  EXPECT_LT((equations.Step(p.weights).by - step).norm(), 1e-6 * step.norm());
  const std::vector<double> no_bends(p.weights.size(), 0.0);
  const NewtonStep iterated = equations.IteratedStep(p.weights, no_bends, 3);
  EXPECT_LT((iterated.by - step).norm(), 1e-6 * step.norm());

  Eigen::MatrixXd covariance = H.inverse();
  covariance.topLeftCorner<3, 3>().setZero();
  const GraphCovariance sparse = equations.Covariance(29);
  for (int v = 0; v < p.graph.num_vertices; ++v) {
    const Eigen::Matrix3d expected = covariance.block<3, 3>(3 * v, 3 * v);
    EXPECT_LT((sparse.marginal[static_cast<std::size_t>(v)] - expected).norm(),
              1e-6 * (1e-6 + expected.norm()))
        << v;
  }
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Eigen::MatrixXd J = DenseJacobian(p, k);
    const Eigen::Matrix3d expected = J * covariance * J.transpose();
    EXPECT_LT((sparse.of_residual[k] - expected).norm(), 1e-6 * (1.0 + expected.norm())) << k;
  }
}

TEST(NormalEquations, ALoneFixedVertexIsKnown) {
  const auto covariance = ComputeCovariance({{1, 0, {}}, {Pose2{}}, {}}, 0);
  ASSERT_TRUE(covariance);
  EXPECT_EQ(covariance->marginal[0].norm(), 0.0);
}

TEST(NormalEquations, SaysSoWhereAVertexIsTiedToNothing) {
  Problem p = SurveyProblem(0);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k)
    if (p.graph.factors[k].i == 7 || p.graph.factors[k].j == 7) p.weights[k] = 0.0;
  EXPECT_FALSE(ComputeCovariance(p, 29));
}

void MoveBy(const Eigen::VectorXd& by, std::vector<Pose2>* poses) {
  for (std::size_t v = 0; v < poses->size(); ++v) {
    const auto d = by.segment<3>(3 * static_cast<Eigen::Index>(v));
    (*poses)[v] = {(*poses)[v].x + d.x(), (*poses)[v].y + d.y(), (*poses)[v].yaw + d.z()};
  }
}

TEST(NormalEquations, IteratedStepIsThatOfAFactorOfItsOwn) {
  const Problem p = SurveyProblem(0);
  NormalEquations equations(p.graph);
  equations.Linearise(p.poses);
  ASSERT_TRUE(equations.Factorize(std::vector<double>(p.weights.size(), 1.0)));
  std::vector<Pose2> elsewhere = p.poses;
  for (std::size_t v = 1; v < elsewhere.size(); ++v) elsewhere[v].yaw += v % 2 == 0 ? 0.05 : -0.05;
  equations.Linearise(elsewhere);
  const std::vector<double> no_bends(p.weights.size(), 0.0);
  const NewtonStep few = equations.IteratedStep(p.weights, no_bends, 1);
  const NewtonStep iterated = equations.IteratedStep(p.weights, no_bends, 50);
  ASSERT_TRUE(equations.Factorize(p.weights));
  const NewtonStep exact = equations.Step(p.weights);
  EXPECT_EQ(few.iterations, 1);
  EXPECT_GT(iterated.iterations, 1);
  EXPECT_LT(iterated.iterations, 50);
  // Of conjugate gradients, the square of the error in standard deviations.
  const double squared_error = std::pow(exact.sigmas, 2) - std::pow(iterated.sigmas, 2);
  EXPECT_GE(squared_error, 0.0);
  EXPECT_LT(squared_error, std::pow(0.02 * exact.sigmas, 2));
}

TEST(NormalEquations, HeadingsThenPositionsFindTheGraphFromAnywhere) {
  Problem p = SurveyProblem(0);
  for (Factor& f : p.graph.factors)
    f.cost.T_i_j =
        Inverse(p.poses[static_cast<std::size_t>(f.i)]) * p.poses[static_cast<std::size_t>(f.j)];
  std::vector<Pose2> poses = p.poses;
  for (std::size_t v = 1; v < poses.size(); ++v)
    poses[v] = {100.0 * std::sin(3.0 * static_cast<double>(v)),
                -50.0,
                poses[v].yaw + 0.05 * static_cast<double>(v)};
  NormalEquations equations(p.graph);
  for (const auto unknowns :
       {NormalEquations::Unknowns::kHeadings, NormalEquations::Unknowns::kPositions}) {
    equations.Linearise(poses, unknowns);
    ASSERT_TRUE(equations.Factorize(p.weights));
    MoveBy(equations.Step(p.weights).by, &poses);
  }
  for (std::size_t v = 0; v < poses.size(); ++v) {
    EXPECT_NEAR(poses[v].x, p.poses[v].x, 1e-6) << v;
    EXPECT_NEAR(poses[v].y, p.poses[v].y, 1e-6) << v;
    EXPECT_NEAR(WrapAngle(poses[v].yaw - p.poses[v].yaw), 0.0, 1e-9) << v;
  }
}

}  // namespace
}  // namespace seastitch
