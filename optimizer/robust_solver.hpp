#pragma once

#include <optional>
#include <vector>

#include "optimizer/factor_graph.hpp"
#include "optimizer/normal_equations.hpp"

namespace seastitch {

struct SolverParams {
  double graduation_step = 4.0;
  int max_iterations = 100;
  double inlier_probability = 0.999;  // of an honest robust factor, to lie within its threshold
};

// Poses: one a vertex.
struct SolverStart {
  std::vector<Pose2> dead_reckoned;
  // The last solution, new vertices where dead reckoning puts them, and what it made of each factor
  // (no weight of a new one). Empty: there is none.
  std::vector<Pose2> T_map_vertex;
  std::vector<std::optional<double>> weights;
  // Of that and each before it back to the last that was found from dead reckoning: see below.
  std::vector<double> doubts;
  double scale_when_chosen = 1.0;
};

struct RobustSolution {
  std::vector<Pose2> T_map_vertex;
  std::vector<double> weights;  // one a factor, 0 to 1
  bool converged = false;
  std::optional<GraphCovariance> covariance;  // nothing where it could not be found
  // By how much dead reckoning's squared errors exceed what it says of them; at least 1.
  double dead_reckoning_scale = 1.0;
  double scale_when_chosen = 1.0;  // the same, when the graph was last solved from dead reckoning
  // One a factor, 0 or above 1: how far a believed one lies beyond what would strain it, and how
  // well a refused one would fit all others.
  std::vector<double> doubts;
};

// Minimises sum loss(|W e|^2) by graduated non-convexity: from dead reckoning to near the minimum
// of the plain squares; from there the losses are sharpened step by step; then Newton's method
// finds the answer to the last digits.
//
// That way nothing is refused that nothing contradicts: a lone wrong closure bends dead reckoning
// until its own residual is small, and a few that share one error outvote it. So every factor,
// dead reckoning too, is then tested against the graph without it (Baarda's test: the leave-one-out
// innovation). Where one fails badly, or more is refused than chance does, a second minimum is
// sought from dead reckoning alone with what lies within its chi-square gate, and a closure shares
// two votes with its neighbours at both ends: what they have in common they pay for about once.
// Where dead reckoning is worse than it says, the votes are more. The lower of the two by that
// count is the answer.
//
// All that is left out while new evidence contradicts nothing: where the minimum next to the last
// solution believes every new factor, revises no verdict, leaves each as much in doubt as at the
// last full solve (to 2 %), and dead reckoning looks as good as it did, it is the answer.
RobustSolution SolveRobust(const FactorGraph& graph,
                           const SolverStart& start,
                           int newest,
                           const SolverParams& params);

}  // namespace seastitch
