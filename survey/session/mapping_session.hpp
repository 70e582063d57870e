#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "products/survey_collector.hpp"
#include "survey/session/computation_beside.hpp"
#include "survey/session/local_mapper.hpp"

namespace seastitch {

// Mapper and optimizer of one map, joined by calls. What they exchange is answered in its order,
// as on the vehicle. The graph is solved when it is due, beside the samples that follow: the
// mapper gets the solution some seconds of the dive later, or when a submap closes.
class MappingSession {
 public:
  // collector: gets the results. stopped: ends Settle() early. on_event: gets every event of the
  // mapper before it has an effect.
  MappingSession(const MapperConfig& mapper,
                 const OptimizerParams& optimizer,
                 SurveyCollector* collector,
                 std::function<bool()> stopped,
                 std::function<void(const MapperEvent&)> on_event);
  MappingSession(const MappingSession&) = delete;
  MappingSession& operator=(const MappingSession&) = delete;

  void Add(const Received& received);
  // Adds a submap and settles.
  void AddSubmap(Submap submap, std::optional<Mapper::OfDive> of_dive = std::nullopt);
  // Ends the dive, and settles.
  void Finish();

  LocalMapper& mapper() { return mapper_; }
  // Faults of the optimizer that hold now; valid after AddSubmap() and Finish().
  std::vector<Condition> optimizer_faults() const;
  // Results that are malformed and were left out, by reason.
  const Counters& refused() const { return refused_; }

 private:
  // What mapper and optimizer exchange.
  using Exchanged = std::variant<GraphUpdate, PoseGraph, CovarianceRequest, PairCovariances>;

  void On(const MapperEvent& event);
  template <class Result>
  void Collect(const Result& result);
  template <class Result>
  void Queue(const Result& result);
  // A malformed edge is left out. An update with a malformed vertex becomes empty, so that the
  // versions after it can be added.
  GraphUpdate Usable(GraphUpdate update);
  // Until all is answered, but for a graph that is being solved.
  void Exchange();
  // Until the solution is there and no pair is left for a retry.
  void Settle();
  void TakeSolution();
  void Deliver(const GraphUpdate& update);
  void Deliver(const PoseGraph& solution);
  void Deliver(const CovarianceRequest& request);
  void Deliver(const PairCovariances& answer);

  SurveyCollector* const collector_;
  const std::function<bool()> stopped_;
  const std::function<void(const MapperEvent&)> on_event_;
  LocalMapper mapper_;
  PoseGraphOptimizer optimizer_;
  PoseGraph solution_;
  bool solve_failed_ = false;
  std::int64_t submaps_lost_ = 0;  // updates that became empty
  std::deque<Exchanged> queue_;
  Counters refused_;
  // Last: its thread uses the optimizer.
  ComputationBeside<std::optional<PoseGraph>> solving_;
};

}  // namespace seastitch
