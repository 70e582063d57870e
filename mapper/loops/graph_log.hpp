#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/mounting.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// One version of the graph, as it is sent.
struct GraphStep {
  GraphUpdate update;
  Time submap_time;  // time of the newest submap's frame in the graph
};

// Log of the graph's versions, from 1 without a gap; each fits one message. A version never
// changes, so that a receiver that missed some gets the same again. Pure.
class GraphLog {
 public:
  explicit GraphLog(const MountingSigmas& mounting) : mounting_(mounting) {}

  // A priori sigmas of the mounting errors of the dive whose vertices are appended from now on.
  void SetMounting(const MountingSigmas& mounting) { mounting_ = mounting; }

  // Names the graph; the first call counts. Without one, the first submap's time names it.
  void SetId(std::int64_t graph_id);

  // Appends vertices and edges in as many versions as they need; an edge never precedes its
  // vertices. No version is made of nothing. final: the mapper has stopped, and the last of these
  // versions (an empty one, if there are none) is marked. A graph ends once: later versions are not
  // marked.
  void Append(std::vector<GraphVertex> vertices,
              std::vector<GraphEdge> edges,
              Time submap_time,
              bool final = false);
  // After a restart: the next version in its place, once sent or about to be. False where it is not
  // the next.
  bool Restore(GraphStep step);
  // Called after a restart when all is restored. The next version is marked as resumed, and the
  // graph may end again.
  void Resume();
  bool HasEnded() const { return ended_; }

  // The first version that one with 1..have_version lacks. Null where there is none; valid until
  // the next Append.
  const GraphStep* After(std::int64_t have_version) const;
  std::int64_t version() const { return static_cast<std::int64_t>(steps_.size()); }
  bool empty() const { return steps_.empty(); }
  std::int64_t graph_id() const { return graph_id_.value_or(0); }
  Time submap_time() const { return steps_.back().submap_time; }  // not of an empty graph

 private:
  void AppendStep(GraphUpdate update, Time submap_time);

  MountingSigmas mounting_;
  std::optional<std::int64_t> graph_id_;
  bool ended_ = false;
  bool resumed_ = false;          // and no version yet since
  std::vector<GraphStep> steps_;  // version n at n - 1
};

}  // namespace seastitch
