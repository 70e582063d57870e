#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"
#include "optimizer/graph_covariance.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// Start of a solution. Poses: one for each vertex.
struct SolverStart {
  std::vector<Pose2> dead_reckoned;
  // Last solution, with new vertices placed by dead reckoning. Empty: there is none.
  std::vector<Pose2> T_map_vertex{};
  // Weight of each factor in the last solution; absent where it is new.
  std::vector<std::optional<double>> weights{};
  bool contradicted = false;    // the last solution
  std::size_t judged_size = 0;  // factors when it was last solved from dead reckoning
};

struct RobustSolution {
  std::vector<Pose2> T_map_vertex;
  std::vector<double> weights;  // one a factor, 0 to 1
  bool converged = false;
  std::optional<GraphCovariance> covariance;  // absent where it could not be computed
  std::vector<double> innovations;  // normalised, squared, one for each factor; else empty
  bool from_dead_reckoning = true;  // false: continued from the last solution
  bool contradicted = true;         // see SolveRobustly()
  bool IsFinite() const;            // the poses
};

// Robust maximum a posteriori estimate of the poses (docs/graph.md).
//
// First solution: from dead reckoning, by graduated non-convexity from nearly squared to truncated
// losses. It misses wrong closures that nothing contradicts: a lone one bends dead reckoning until
// its own residual is small, and a few with a common error outvote it.
//
// Second solution, only where the first is contradicted (a normalised innovation fails its test, or
// more factors are refused than by chance): starts with the active set of factors within their gate
// of dead reckoning. A group of correlated closures has an effective sample size of two there, or
// more where the a posteriori variance factor shows dead reckoning to be worse than stated. The
// solution with the lower cost by that count is the answer. It depends on the graph alone.
//
// With a last solution: continues from it, with new factors active within their gate. Solves from
// dead reckoning again where that changes a verdict, or where the solution is contradicted and the
// graph has grown by 2 % since it was last solved from there.
//
// on_step is called after every step of the minimiser, so that the caller sees progress.
RobustSolution SolveRobustly(const FactorGraph& graph,
                             const SolverStart& start,
                             const OptimizerParams& params,
                             const std::function<void()>& on_step = {});

}  // namespace seastitch
