#include "optimizer/solver/graph_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "common/core/information.hpp"
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
          {e.from.value, e.to.value, e.T_from_to, FactorInformation(e.information)->W});
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k)
    p.weights.push_back(p.graph.factors[k].j == p.graph.factors[k].i + 1 ? 1.0
                        : k % 7 == 0                                     ? 0.0
                                                                         : 0.6);
  return p;
}

// The same with mounting errors of two dives. Each factor depends on them in its own way, and every
// third one on those of both.
Problem SurveyProblemWithMounting() {
  Problem p = SurveyProblem(0);
  const int first = p.graph.num_vertices, second = first + 1;
  p.graph.num_vertices += 2;
  p.graph.num_mountings = 2;
  p.poses.push_back({0.3, -0.2, 0.004});
  p.poses.push_back({-0.1, 0.5, -0.007});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-20.0, 20.0);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    if (k % 5 == 0) continue;
    std::array<MountingTerm, 2>& mounting = p.graph.factors[k].mounting;
    mounting[0].vertex = k % 2 == 0 ? first : second;
    if (k % 3 == 0) mounting[1].vertex = k % 2 == 0 ? second : first;
    for (MountingTerm& term : mounting)
      for (double& by : term.by.topRows<2>().reshaped()) by = within(random);
  }
  const Eigen::Matrix3d W = Eigen::Vector3d(5.0, 5.0, 200.0).asDiagonal();
  for (const int vertex : {first, second}) {
    p.graph.factors.push_back({kMap, vertex, {}, W});
    p.weights.push_back(1.0);
  }
  p.graph.factors.push_back({kMap, 4, p.poses[4], W});
  p.graph.factors.back().mounting[0] = {first, Eigen::Matrix3d::Zero()};
  p.graph.factors.back().mounting[0].by.topLeftCorner<2, 2>() = p.poses[4].Rotation();
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
        return Residual(p.graph.factors[k], poses);
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
    EndJacobians by_ends;
    Residual(f, p.poses, &by_ends);
    if (f.i != kMap) J.middleCols<3>(3 * f.i) = by_ends[0];
    J.middleCols<3>(3 * f.j) = by_ends[1];
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

std::optional<GraphCovariance> CovarianceOf(const Problem& p) {
  return GraphCovariance::At(p.graph, p.poses, p.weights);
}

void ExpectEqualsDense(const Problem& p, int newest) {
  const auto sparse = CovarianceOf(p);
  ASSERT_TRUE(sparse);
  const Eigen::MatrixXd dense = DenseCovariance(p);
  const std::vector<Eigen::Matrix3d> with_newest = sparse->WithVertex(newest);
  GraphCovariance::Pairs pairs(*sparse);
  for (int v = 0; v < p.graph.num_vertices; ++v) {
    const Eigen::Matrix3d marginal = dense.block<3, 3>(3 * v, 3 * v);
    const Eigen::Matrix3d cross = dense.block<3, 3>(3 * v, 3 * newest);
    const auto k = static_cast<std::size_t>(v);
    EXPECT_LT((sparse->marginal()[k] - marginal).norm(), 1e-7 * (1e-6 + marginal.norm())) << v;
    EXPECT_LT((with_newest[k] - cross).norm(), 1e-7 * (1e-6 + cross.norm())) << v;
    EXPECT_LT((pairs(v, newest) - cross).norm(), 1e-7 * (1e-6 + cross.norm())) << v;
  }
}

TEST(GraphCovariance, EqualsTheDenseInverseWithAFixedVertex) {
  ExpectEqualsDense(SurveyProblem(0), 29);
  ExpectEqualsDense(SurveyProblem(12), 5);
}

TEST(GraphCovariance, EqualsTheDenseInverseWithAPrior) {
  Problem p = SurveyProblem(-1);
  p.graph.factors.push_back({kMap, 3, p.poses[3], Eigen::Matrix3d::Identity()});
  p.weights.push_back(1.0);
  ExpectEqualsDense(p, 29);
}

TEST(GraphCovariance, CrossCovarianceOfTheNewestWithItselfIsItsMarginal) {
  const Problem p = SurveyProblem(0);
  const auto covariance = CovarianceOf(p);
  ASSERT_TRUE(covariance);
  EXPECT_LT((covariance->marginal()[29] - covariance->WithVertex(29)[29]).norm(), 1e-12);
}

TEST(GraphCovariance, KnowsTheOpenPartOfResidualsThatAreLeftOut) {
  const Problem p = SurveyProblem(0);
  const auto covariance = CovarianceOf(p);
  ASSERT_TRUE(covariance);
  const Eigen::MatrixXd dense = DenseCovariance(p);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Factor& f = p.graph.factors[k];
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, dense.rows());
    EndJacobians by_ends;
    Residual(f, p.poses, &by_ends);
    J.middleCols<3>(3 * f.i) = by_ends[0];
    J.middleCols<3>(3 * f.j) = by_ends[1];
    const Eigen::Matrix3d expected = J * dense * J.transpose();
    EXPECT_LT((covariance->of_residual()[k] - expected).norm(), 1e-7 * (1.0 + expected.norm()))
        << k;
  }
}

TEST(GraphCovariance, MountingErrorsOfEachDiveAreUnknownsOfAllTheirFactors) {
  const Problem p = SurveyProblemWithMounting();
  const auto sparse = CovarianceOf(p);
  ASSERT_TRUE(sparse);
  const int size = 3 * p.graph.num_vertices;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  H.topLeftCorner<3, 3>().setIdentity();  // the fixed vertex
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Eigen::MatrixXd J = DenseJacobian(p, k);
    H += p.weights[k] * J.transpose() * J;
  }
  Eigen::MatrixXd covariance = H.inverse();
  covariance.topLeftCorner<3, 3>().setZero();
  for (int v = 0; v < p.graph.num_vertices; ++v) {
    const Eigen::Matrix3d expected = covariance.block<3, 3>(3 * v, 3 * v);
    EXPECT_LT((sparse->marginal()[static_cast<std::size_t>(v)] - expected).norm(),
              1e-6 * (1e-6 + expected.norm()))
        << v;
  }
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k) {
    const Eigen::MatrixXd J = DenseJacobian(p, k);
    const Eigen::Matrix3d expected = J * covariance * J.transpose();
    EXPECT_LT((sparse->of_residual()[k] - expected).norm(), 1e-6 * (1.0 + expected.norm())) << k;
  }
}

TEST(GraphCovariance, ALoneFixedVertexIsKnown) {
  const Problem p{{1, 0, {}}, {Pose2{}}, {}};
  const auto covariance = CovarianceOf(p);
  ASSERT_TRUE(covariance);
  EXPECT_EQ(covariance->marginal()[0].norm(), 0.0);
}

TEST(GraphCovariance, SaysSoWhereAVertexIsTiedToNothing) {
  Problem p = SurveyProblem(0);
  for (std::size_t k = 0; k < p.graph.factors.size(); ++k)
    if (p.graph.factors[k].i == 7 || p.graph.factors[k].j == 7) p.weights[k] = 0.0;
  EXPECT_FALSE(CovarianceOf(p));
}

}  // namespace
}  // namespace seastitch
