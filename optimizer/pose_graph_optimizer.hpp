#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "optimizer/optimizer_params.hpp"
#include "optimizer/solver/graph_covariance.hpp"
#include "optimizer/solver/graph_store.hpp"

namespace seastitch {

struct LastSolution;

// Initial values of the minimisation.
//
// kFromDeadReckoning: the dead-reckoned poses. The solution depends on the graph alone.
// kWarm: the last solution. It is quicker. The cost has several minima, and a warm start can stay
// in one that is not the lowest.
enum class SolveStart { kWarm, kFromDeadReckoning };

// Pose-graph optimizer: the maximum a posteriori estimate of x, y [m] and yaw [rad] of all submap
// frames (map axes) and of the mounting errors of each dive (MountingErrors). Its
// measurements are dead reckoning, headings, loop closures and position fixes. Its outputs include
// covariances and the inlier weight of each closure. The model is section III-B of the paper that
// docs/design.md names.
//
// Loop closures and position fixes have a robust loss, all other factors a squared one. Every
// solution estimates the inlier weights again, so a closure with weight 0 can become an inlier
// later. Not thread-safe: one call at a time.
class PoseGraphOptimizer {
 public:
  explicit PoseGraphOptimizer(const OptimizerParams& params) : params_(params) {}

  // Adds the next version of the mapper's graph. False: an earlier version is missing, and nothing
  // is added (GraphStore::Add).
  bool Add(const GraphUpdate& update);
  // Whether the graph is to be solved again: as IsSolutionDue() says, and at once when a mapper
  // has stopped or resumed, or a closure is beyond 2 sigma of what the last solution predicts.
  // Other solutions do no harm, and cost time.
  bool IsDue() const { return is_due_; }
  const GraphStore& store() const { return store_; }
  // The newest graph version that was added; 0: none.
  std::int64_t version() const { return store_.version(); }
  // Counts of refused input and failed solutions, by reason.
  std::map<std::string, std::int64_t> counters() const;

  // Solves the graph as added so far. The result has the vertices by rising id, and every loop
  // closure with its inlier weight; one that registration rejected has weight 0. Absent where no
  // finite solution was found: the last solution then stays the one that the functions below use.
  // on_step is called after every iteration of the minimiser, so that the caller sees progress.
  std::optional<PoseGraph> Solve(SolveStart start = SolveStart::kWarm,
                                 const std::function<void()>& on_step = {});
  // Whether the minimiser converged in the last call of Solve(); true before the first.
  bool converged() const { return converged_; }
  // True: the covariances of the last solution could not be computed. Its vertices then have the
  // diagonal covariance of unlinked_sigma_m and unlinked_sigma_yaw_rad.
  bool lacks_covariance() const { return solved_version_ > 0 && !covariance_; }

  // Covariances of the relative poses of pairs of submaps in the last solution, in the order of
  // `pairs`; axes and units: PairCovariance. A pair with a submap that the solution does not have
  // is left out. Empty where lacks_covariance().
  std::vector<PairCovariance> RelativeCovariances(
      const std::vector<std::pair<SubmapId, SubmapId>>& pairs) const;

 private:
  bool HasSurprise(const GraphUpdate& update) const;
  std::vector<Pose2> DeadReckoned() const;
  std::vector<Pose2> Predicted() const;  // initial values of a warm start
  std::vector<std::optional<double>> LastWeights(std::size_t num_factors) const;
  std::vector<std::optional<double>> NewInnovations(std::size_t num_factors) const;
  LastSolution Last() const;
  PoseGraph Published() const;

  OptimizerParams params_;
  GraphStore store_;
  // Of the last solution.
  std::map<std::int32_t, Pose2> solved_mounting_;  // by chain; its three numbers as x, y, yaw
  std::optional<GraphCovariance> covariance_;
  std::map<SubmapId, int> solved_number_;  // of the vertices in it
  bool is_due_ = false;
  bool converged_ = true;
  bool contradicted_ = false;  // RobustSolution::contradicted
  std::int64_t solved_version_ = 0;
  std::size_t judged_size_ = 0;  // number of factors at the last solution from dead reckoning
  std::map<std::string, std::int64_t> failures_;
};

}  // namespace seastitch
