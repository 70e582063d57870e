#pragma once

#include <map>
#include <optional>

#include "common/core/graph.hpp"
#include "optimizer/solver/graph_covariance.hpp"
#include "optimizer/solver/graph_store.hpp"

namespace seastitch {

// The last solution of a graph that has grown since.
struct LastSolution {
  const GraphStore& store;                        // its solved poses, and all that came since
  const std::map<SubmapId, int>& number;          // of the vertices in the covariance
  const std::map<std::int32_t, Pose2>& mounting;  // by chain: x, y, DVL yaw
  const std::optional<GraphCovariance>& covariance;
};

// Squared normalised innovation of a loop closure: the squared Mahalanobis distance from its prior,
// which is what the last solution, and dead reckoning from its submaps on, predict of the relative
// pose. Absent where they predict nothing.
std::optional<double> InnovationOf(const StoredEdge& closure, const LastSolution& last);

// Whether a loop closure is beyond 2 sigma (95.4 %) of its prior. True where it has none.
bool IsBeyondPrior(const StoredEdge& closure, const LastSolution& last);

}  // namespace seastitch
