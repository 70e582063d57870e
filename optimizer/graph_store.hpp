#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/information.hpp"

namespace seastitch {

struct StoredVertex {
  Pose2 dead_reckoned;
  std::optional<double> heading_sigma_rad;
  std::optional<Pose2> solved;  // in the last solution
  std::int32_t chain = 0;       // of dead reckoning: the dive
};

struct StoredEdge {
  GraphEdge edge;
  SqrtInformation root;
  std::optional<double> weight;  // in the last solution
  bool Pulls() const { return edge.verdict == LoopVerdict::kAccepted; }
};

// The mapper's graph up to the newest version received, checked.
class GraphStore {
 public:
  // Adds the next version. A repeated version is counted and ignored. False: an earlier version is
  // missing, and nothing is added. The usable part of a malformed update is added, the rest counted
  // by reason. A pair of submaps has one dead-reckoning edge and one loop closure: a later edge
  // replaces the earlier one.
  bool Add(const GraphUpdate& update);

  // True where a version is stored with other content: the sender has begun another graph.
  bool Contradicts(const GraphUpdate& update) const;

  std::int64_t version() const { return static_cast<std::int64_t>(fingerprints_.size()); }
  // Counts of refused and repeated input, by reason; a reason appears with its first count.
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

  using Pair = std::pair<SubmapId, SubmapId>;  // smaller id first
  const std::map<SubmapId, StoredVertex>& vertices() const { return vertices_; }
  const std::map<Pair, StoredEdge>& dead_reckoning() const { return dead_reckoning_; }
  const std::map<Pair, StoredEdge>& loops() const { return loops_; }
  const std::vector<StoredEdge>& fixes() const { return fixes_; }
  // Start edges: pose of the first vertex of a chain, by dead reckoning.
  const std::map<SubmapId, StoredEdge>& starts() const { return starts_; }
  const MountingSigmas& mounting() const { return mounting_; }
  bool EstimatesMounting() const { return !mounting_.AreAllZero(); }
  // Accepted position fixes and loop closures, in this order.
  std::vector<const StoredEdge*> RobustEdges() const;

  // Poses: one for each vertex by rising id, then, if there are more, the mounting. Weights: one
  // for each robust edge.
  void KeepSolution(const std::vector<Pose2>& T_map_vertex, const std::vector<double>& weights);

 private:
  void AddVertex(const GraphVertex& vertex);
  void AddEdge(const GraphEdge& edge);
  const char* WhyUnusable(const GraphEdge& edge) const;
  bool BeginsChain(SubmapId id) const;
  void SetMounting(const MountingSigmas& sigmas);

  std::map<SubmapId, StoredVertex> vertices_;
  std::map<Pair, StoredEdge> dead_reckoning_;
  std::map<Pair, StoredEdge> loops_;
  std::map<SubmapId, StoredEdge> starts_;
  std::vector<StoredEdge> fixes_;
  MountingSigmas mounting_;
  std::vector<std::size_t> fingerprints_;  // of every version, from 1
  std::map<std::string, std::int64_t> counters_;
};

}  // namespace seastitch
