#pragma once

#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"
#include "optimizer/graph_covariance.hpp"

namespace seastitch {

struct SolverParams {
  double graduation_step = 4.0;
  int max_iterations = 100;
};

struct RobustSolution {
  std::vector<Pose2> quadratic;     // minimum with every loss a plain square: the next warm start
  std::vector<Pose2> T_map_vertex;  // the robust minimum
  std::vector<double> weights;      // one a factor, 0 to 1
  bool converged = false;           // of the last stage
  std::optional<GraphCovariance> covariance;  // nothing where it could not be found
};

// Minimises sum loss(|W e|^2) with Ceres (Gauss-Newton steps in a trust region, sparse Cholesky,
// one thread) by graduated non-convexity: from the minimum of the plain squares, which `start` only
// makes quicker to find, the losses are sharpened step by step; then the weights are held and the
// answer is found to the last digits. The same graph gives the same answer whatever it was before.
//
// That way nothing is refused that nothing contradicts: a lone wrong closure bends dead reckoning
// until its own residual is small. So every believed factor is then tested against the graph
// without it (Baarda's test: the leave-one-out innovation). Where one fails badly, a second minimum
// is sought from dead reckoning alone with what lies within its chi-square gate, and the lower of
// the two is the answer.
RobustSolution SolveRobust(const FactorGraph& graph,
                           const std::vector<Pose2>& start,
                           int newest,
                           const SolverParams& params);

}  // namespace seastitch
