#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "optimizer/optimizer_params.hpp"
#include "optimizer/solver/factor_graph.hpp"
#include "optimizer/solver/graph_covariance.hpp"

namespace seastitch {

// Initial values of a solution. Poses: one per vertex.
struct SolverStart {
  std::vector<Pose2> dead_reckoned;
  // Last solution; new vertices extrapolated from it by dead reckoning. Empty: there is none.
  std::vector<Pose2> T_map_vertex{};
  // Inlier weight of each factor in the last solution; absent where the factor is new.
  std::vector<std::optional<double>> weights{};
  // Squared normalised innovation of each new loop closure by the last solution (InnovationOf());
  // absent for all other factors, and where it is not known.
  std::vector<std::optional<double>> innovations{};
  bool contradicted = false;    // RobustSolution::contradicted of the last solution
  std::size_t judged_size = 0;  // number of factors at the last solution from dead reckoning
};

struct RobustSolution {
  std::vector<Pose2> T_map_vertex;
  std::vector<double> weights;  // inlier weight of each factor, 0 to 1
  bool converged = false;
  std::optional<GraphCovariance> covariance;  // absent where it could not be computed
  std::vector<double> innovations;            // NormalisedInnovation() of each factor; else empty
  bool from_dead_reckoning = true;            // false: continued from the last solution
  bool contradicted = true;                   // its outlier tests failed: see SolveRobustly()
  bool IsFinite() const;                      // all poses are finite
};

// Robust maximum a posteriori estimate of the poses (docs/graph.md).
//
// First solution: starts from dead reckoning, by graduated non-convexity from nearly squared to
// truncated losses. It can keep wrong closures: a single one bends dead reckoning until its own
// residual is small, and a few with a common error outweigh dead reckoning.
//
// Second solution, only where the first is contradicted (a normalised innovation fails its test, or
// more factors have weight 0 than by chance): starts from dead reckoning with those closures and
// fixes active that are within their gate of it. A group of correlated closures has an effective
// sample size of two there, or more where the a posteriori variance factor shows dead reckoning to
// be worse than stated. The result is the solution with the lower cost, computed with these
// effective sample sizes for both. It depends on the graph alone.
//
// With a last solution: continues from it; a new factor is active where it is within its gate. It
// solves from dead reckoning again where that changes which factors are inliers, or where the
// solution is contradicted and the graph has grown by 2 % since the last solution from dead
// reckoning.
//
// on_step is called after every iteration of the minimiser, so that the caller sees progress.
RobustSolution SolveRobustly(const FactorGraph& graph,
                             const SolverStart& start,
                             const OptimizerParams& params,
                             const std::function<void()>& on_step = {});

}  // namespace seastitch
