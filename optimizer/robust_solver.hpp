#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"
#include "optimizer/graph_covariance.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// Where a solution begins; poses: one a vertex.
struct SolverStart {
  std::vector<Pose2> dead_reckoned;
  // The last solution, new vertices where dead reckoning puts them. Empty: there is none.
  std::vector<Pose2> T_map_vertex{};
  // One a factor: its weight there; nothing where it is new.
  std::vector<std::optional<double>> weights{};
  bool contradicted = false;    // the last solution
  std::size_t judged_size = 0;  // factors when it was last solved from dead reckoning
};

struct RobustSolution {
  std::vector<Pose2> T_map_vertex;
  std::vector<double> weights;  // one a factor, 0 to 1
  bool converged = false;
  std::optional<GraphCovariance> covariance;  // nothing where it could not be found
  std::vector<double> innovations;            // normalised and squared, one a factor; empty there
  bool from_dead_reckoning = true;            // or on from the last solution
  bool contradicted = true;                   // see SolveRobustly()
  bool IsFinite() const;                      // the poses
};

// The robust maximum a posteriori estimate, from dead reckoning: graduated non-convexity from near
// the minimum of the squares to truncated losses.
//
// That way nothing is refused that nothing contradicts: a lone wrong closure bends dead reckoning
// until its own residual is small, and a few that share one error outvote it. So where the solution
// is contradicted (a normalised innovation fails its test, or more is refused than by chance) there
// is a second one. It begins with the active set of those within their gate of dead reckoning
// alone, and a group of correlated closures counts there as an effective sample size of two, or
// more where the a posteriori variance factor shows dead reckoning to be worse than it states. The
// cheaper of both by that count is the answer. It depends on the graph alone.
//
// Where there is a last solution: on from it, new factors active if they are within their gate.
// Where that changes a verdict, or the solution is contradicted and the graph has grown by 2 %
// since it was last solved from dead reckoning, from there.
//
// on_step is called after every step of the minimiser, as a sign of life.
RobustSolution SolveRobustly(const FactorGraph& graph,
                             const SolverStart& start,
                             const OptimizerParams& params,
                             const std::function<void()>& on_step = {});

}  // namespace seastitch
