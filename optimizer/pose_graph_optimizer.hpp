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

// Where a solution begins. The answer from dead reckoning depends on the graph alone. That from the
// last solution is found sooner, and is the same unless a robust minimum was missed on the way.
enum class SolveStart { kWarm, kFromDeadReckoning };

// The most probable x, y, yaw of all submap frames and errors of mounting, given dead reckoning,
// loop closures and position fixes (section III-B of the paper, with a robust loss), their
// covariances, and the weight of each closure. Dead reckoning is not robust (squares); closures and
// fixes earn their weight in every solution anew, so that one refused earlier comes back when later
// evidence speaks for it.
class PoseGraphOptimizer {
 public:
  explicit PoseGraphOptimizer(const OptimizerParams& params) : params_(params) {}

  // See GraphStore.
  bool Add(const GraphUpdate& update) { return store_.Add(update); }
  const GraphStore& store() const { return store_; }
  std::int64_t version() const { return store_.version(); }
  // Of everything refused, and of solutions that failed, by reason.
  std::map<std::string, std::int64_t> counters() const;

  // Solves for everything added. Vertices by rising id; every loop closure with its weight, 0 where
  // registration itself refused it. Nothing where no finite solution was found: the last one is
  // kept. on_step is called after every step, as a sign of life.
  std::optional<PoseGraph> Solve(SolveStart start = SolveStart::kWarm,
                                 const std::function<void()>& on_step = {});
  // Of the last solution. Without covariances it says unlinked_sigma_m and _yaw_rad of all.
  bool converged() const { return converged_; }
  bool lacks_covariance() const { return solved_version_ > 0 && !covariance_; }

  // How well the relative poses of these pairs are known under the last solution, exactly: those
  // whose vertices are in it, in their order. Nothing where vertices or edges came since, or the
  // covariance cannot be found.
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
