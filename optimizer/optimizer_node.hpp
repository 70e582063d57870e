#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "common/runtime/worker.hpp"
#include "optimizer/pose_graph_optimizer.hpp"
#include "seastitch/covariance_request_t.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/graph_update_t.hpp"

namespace seastitch {

// The optimizer's process: GRAPH_UPDATE in, POSE_GRAPH out, COVARIANCES on request ("Graph
// protocol" in docs/channels.md). Asks the mapper for the whole graph at the start, and for missing
// versions; solves only a complete graph. Sends the last solution again to a mapper that asks.
// Keeps nothing on disk. Solves on the worker; updates wait meanwhile, HEALTH and requests do not.
class OptimizerNode {
 public:
  // kEachUpdate: in replay, so that the same log gives the same solutions. kWhenAsked: live; a
  // solution that takes longer than the next update is then made once for all that wait.
  enum class SolveOn { kEachUpdate, kWhenAsked };

  OptimizerNode(const OptimizerParams& params,
                Bus* bus,
                Worker* worker,
                SolveOn when = SolveOn::kEachUpdate);

  // Starts a solution on the worker if updates came since the last one and the worker is idle, and
  // publishes the result.
  void SolveWaiting();
  // Ends the start, in which the mapper answers the first request, where no update came since the
  // last call; solves what has come. To be called live, twice a second.
  void EndStart();
  // Repeats the request for a missing version, since a request or its answer may be lost; gives a
  // version up that never comes. To be called live, every few seconds.
  void AskAgain();

  Health& health() { return health_; }

 private:
  void OnUpdate(const graph_update_t& msg);
  void Take(const graph_update_t& msg);
  std::optional<GraphUpdate> Checked(const graph_update_t& msg);
  std::optional<GraphUpdate> WithoutBadEdges(const graph_update_t& msg) const;
  bool IsOfLeftGraph(const GraphUpdate& update) const;
  void StartOver();
  void Expect(std::int64_t version);
  void Ask();
  bool IsMissing() const { return newest_version_ > optimizer_->version(); }
  bool Post(Worker::Job job);
  void OnSolved(std::optional<PoseGraph> solution, double solve_s);
  void TakeWaiting();
  void OnRequest(const graph_request_t& msg);
  void OnCovarianceRequest(const covariance_request_t& msg);
  void OnCovariances(const PairCovariances& answer);
  void PublishSolution();
  void ReportSolution(double solve_s);
  void ReportState();

  const OptimizerParams params_;
  const SolveOn when_;
  Bus* const bus_;
  Worker* const worker_;
  Health health_{"optimizer"};
  std::shared_ptr<PoseGraphOptimizer> optimizer_;  // the worker's alone while worker_busy_
  bool worker_busy_ = false;
  std::deque<graph_update_t> updates_;  // that came meanwhile
  PoseGraph solution_;
  std::int64_t graph_id_ = 0;               // of the update taken last
  std::optional<std::int64_t> left_graph_;  // that the mapper had before
  std::int64_t newest_version_ = 0;         // that the mapper is known to have
  std::int64_t malformed_version_ = 0;      // that was asked for again, since a vertex is malformed
  std::int64_t submaps_lost_ = 0;           // malformed again
  int asked_in_vain_ = 0;                   // since the last version came
  bool starting_;                           // live: the answer to the first request may be coming
  int taken_since_tick_ = 0;                // updates
  int taken_while_starting_ = 0;            // since the last EndStart()
  std::int64_t update_utime_ = 0;           // of the newest update taken
  bool waiting_ = false;                    // updates, to be solved
  SolveStart next_start_ = SolveStart::kWarm;
  bool solve_failed_ = false;
  std::int64_t solution_number_ = 0;
  std::int64_t solution_seq_ = 0;
  std::int64_t request_seq_ = 0;
  std::int64_t covariances_seq_ = 0;
};

}  // namespace seastitch
