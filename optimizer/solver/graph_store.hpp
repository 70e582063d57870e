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

// A submap frame as the mapper sent it.
struct StoredVertex {
  Pose2 dead_reckoned;  // T_map_level
  // 1 sigma of its yaw against north, as GraphVertex states it; absent: not known.
  std::optional<double> heading_sigma_rad;
  std::optional<Pose2> solved;  // T_map_level of the last solution
  std::int32_t chain = 0;       // number of the dive; dead reckoning joins submaps of one dive only
};

struct StoredEdge {
  GraphEdge edge;
  SqrtInformation root;          // square root of edge.information
  std::optional<double> weight;  // inlier weight in the last solution
  // True: the edge becomes a factor. False: registration rejected it.
  bool Pulls() const { return edge.verdict == LoopVerdict::kAccepted; }
};

// Copy of the mapper's graph: all versions received, with every edge and vertex checked.
class GraphStore {
 public:
  // Adds the next version. False: an earlier version is missing, and nothing is added; ask for it.
  //
  // A repeated version is ignored. Of a malformed update the usable vertices and edges are added.
  // Both give true, and counters() names what was left out. A pair of submaps has at most one
  // dead-reckoning edge and at most one loop closure: a later edge replaces the earlier one, and
  // keeps its weight if only the covariance differs. A submap may have several position fixes.
  bool Add(const GraphUpdate& update);

  // True: this version is stored with other content. The sender has begun another graph, and the
  // caller has to start with an empty GraphStore.
  bool Contradicts(const GraphUpdate& update) const;

  std::int64_t version() const { return static_cast<std::int64_t>(fingerprints_.size()); }
  // Counts of refused and repeated input, by reason; a reason appears with its first count.
  const std::map<std::string, std::int64_t>& counters() const { return counters_; }

  using Pair = std::pair<SubmapId, SubmapId>;  // smaller id first
  const std::map<SubmapId, StoredVertex>& vertices() const { return vertices_; }
  const std::map<Pair, StoredEdge>& dead_reckoning() const { return dead_reckoning_; }
  const std::map<Pair, StoredEdge>& loops() const { return loops_; }
  const std::vector<StoredEdge>& fixes() const { return fixes_; }
  // Start edges: the pose in the map of the first vertex of a chain, by the navigation filter.
  const std::map<SubmapId, StoredEdge>& starts() const { return starts_; }
  // A priori sigmas of the mounting errors of each dive, by its chain number. A dive whose errors
  // the graph does not estimate is left out.
  const std::map<std::int32_t, MountingSigmas>& mounting() const { return mounting_; }
  // Angle of the DVL that navigation estimated for the newest submap of a dive: see MeasuredBy().
  // Absent: no dead reckoning states it, as in a dive of one submap.
  std::optional<double> newest_dvl_yaw_rad(std::int32_t chain) const;
  // Edges with a robust loss that registration or the filter accepted: position fixes in the order
  // received, then loop closures by the ids of their submaps.
  std::vector<const StoredEdge*> RobustEdges() const;

  // Stores a solution as the initial values of the next. Poses: one per vertex by rising id; those
  // of mounting vertices may follow them and are ignored. Weights: one per edge of RobustEdges().
  void KeepSolution(const std::vector<Pose2>& T_map_vertex, const std::vector<double>& weights);

 private:
  void AddVertex(const GraphVertex& vertex);
  void AddEdge(const GraphEdge& edge);
  void AddStep(const Pair& pair, const StoredEdge& step);
  // The counter's name; null: the edge is usable.
  const char* WhyUnusable(const GraphEdge& edge) const;
  bool BeginsChain(SubmapId id) const;
  void SetMounting(const GraphUpdate& update);

  std::map<SubmapId, StoredVertex> vertices_;
  std::map<Pair, StoredEdge> dead_reckoning_;
  std::map<Pair, StoredEdge> loops_;
  std::map<SubmapId, StoredEdge> starts_;
  std::vector<StoredEdge> fixes_;
  std::map<std::int32_t, MountingSigmas> mounting_;
  std::map<std::int32_t, std::pair<SubmapId, double>> newest_dvl_yaw_;  // by chain
  std::vector<std::size_t> fingerprints_;  // hash of each version; [0] is version 1
  std::map<std::string, std::int64_t> counters_;
};

}  // namespace seastitch
