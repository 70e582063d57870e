#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "optimizer/graph_covariance.hpp"
#include "optimizer/graph_store.hpp"
#include "optimizer/optimizer_params.hpp"

namespace seastitch {

// Start of a solution. kFromDeadReckoning: the answer depends on the graph alone. kWarm: from the
// last solution, which is quicker and gives the same answer unless another robust minimum was
// missed.
enum class SolveStart { kWarm, kFromDeadReckoning };

// Maximum a posteriori estimate of x, y, yaw of all submap frames and of the errors of mounting
// from dead reckoning, loop closures and position fixes (section III-B of the paper, with a robust
// loss), with covariances and the inlier weight of each closure. Dead reckoning has squared losses.
// The weights are estimated in every solution anew: a refused closure is accepted again when later
// evidence supports it.
class PoseGraphOptimizer {
 public:
  explicit PoseGraphOptimizer(const OptimizerParams& params) : params_(params) {}

  // See GraphStore.
  bool Add(const GraphUpdate& update) { return store_.Add(update); }
  const GraphStore& store() const { return store_; }
  std::int64_t version() const { return store_.version(); }
  // Counts of refused input and failed solutions, by reason.
  std::map<std::string, std::int64_t> counters() const;

  // Solves for everything added. Vertices by rising id; every loop closure with its weight, 0 where
  // registration itself refused it. Absent where no finite solution was found; the last one is then
  // kept. on_step is called after every step, so that the caller sees progress.
  std::optional<PoseGraph> Solve(SolveStart start = SolveStart::kWarm,
                                 const std::function<void()>& on_step = {});
  // State of the last solution. Without covariances, it gives unlinked_sigma_m and _yaw_rad for
  // all.
  bool converged() const { return converged_; }
  bool lacks_covariance() const { return solved_version_ > 0 && !covariance_; }

  // Covariances of the relative poses of these pairs in the last solution, for those whose vertices
  // are in it, in their order. Empty where vertices or edges were added since, or the covariance
  // cannot be computed.
  std::vector<PairCovariance> RelativeCovariances(
      const std::vector<std::pair<SubmapId, SubmapId>>& pairs) const;

 private:
  std::vector<Pose2> DeadReckoned() const;
  std::vector<Pose2> Predicted() const;
  std::vector<std::optional<double>> LastWeights(std::size_t num_factors) const;
  PoseGraph Published() const;

  OptimizerParams params_;
  GraphStore store_;
  // Of the last solution.
  Pose2 solved_mounting_;
  std::optional<GraphCovariance> covariance_;
  bool converged_ = true;
  bool contradicted_ = false;
  std::int64_t solved_version_ = 0;
  std::size_t judged_size_ = 0;  // factors when it was last solved from dead reckoning
  std::map<std::string, std::int64_t> failures_;
};

}  // namespace seastitch
