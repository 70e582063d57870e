#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "optimizer/pose_graph_optimizer.hpp"
#include "tests/optimizer/survey_graph.hpp"

// Edges and solutions for the tests of the optimizer.
namespace seastitch {

inline PoseGraph SolveAll(const std::vector<GraphUpdate>& updates) {
  PoseGraphOptimizer optimizer{OptimizerParams{}};
  for (const GraphUpdate& update : updates) EXPECT_TRUE(optimizer.Add(update));
  PoseGraph solution = *optimizer.Solve();
  EXPECT_TRUE(optimizer.counters().empty());
  return solution;
}

inline double PositionRms(const PoseGraph& solution, const std::vector<Pose2>& truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += (solution.vertices[k].T_map_level.Translation() - truth[k].Translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

inline double LargestDifference(const PoseGraph& a, const PoseGraph& b) {
  EXPECT_EQ(a.vertices.size(), b.vertices.size());
  double largest = 0.0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    const Pose2 difference = Inverse(a.vertices[k].T_map_level) * b.vertices[k].T_map_level;
    largest = std::max(largest, difference.Vector().cwiseAbs().maxCoeff());
  }
  return largest;
}

inline GraphEdge Edge(
    EdgeKind kind, int from, int to, const Pose2& T, double sigma_m, double sigma_rad) {
  GraphEdge edge;
  edge.kind = kind;
  edge.from = SubmapId{from};
  edge.to = SubmapId{to};
  edge.T_from_to = T;
  edge.information = DiagonalInformation(sigma_m, sigma_rad);
  return edge;
}

inline GraphEdge Fix(int vertex, double x, double y, double sigma_m) {
  GraphEdge fix = Edge(EdgeKind::kPositionFix, vertex, vertex, {x, y, 0.0}, sigma_m, 1.0);
  fix.information(2, 2) = 0.0;  // GPS knows no heading
  return fix;
}

// A square of 4 x 10 m walked once, dead reckoning turning 2 degrees too far at each corner: vertex
// 4 should come back to vertex 0 and does not.
inline std::vector<GraphUpdate> DriftingSquare() {
  const Pose2 step{10.0, 0.0, Deg2Rad(92.0)};
  std::vector<GraphUpdate> updates;
  Pose2 dead_reckoned{100.0, 50.0, 0.3};
  for (int k = 0; k < 5; ++k) {
    GraphUpdate update{k + 1, {{SubmapId{k}, Time(Duration(k + 1)), dead_reckoned}}, {}};
    if (k > 0) update.edges = {Edge(EdgeKind::kDeadReckoning, k - 1, k, step, 0.2, 0.03)};
    updates.push_back(update);
    dead_reckoned = dead_reckoned * step;
  }
  return updates;
}

inline GraphEdge SquareClosure() { return Edge(EdgeKind::kLoopClosure, 0, 4, {}, 0.02, 0.005); }

}  // namespace seastitch
