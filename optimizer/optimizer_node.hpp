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

// The node of the optimizer process: receives GRAPH_UPDATE, publishes POSE_GRAPH, and answers
// COVARIANCE_REQUEST with COVARIANCES ("Graph protocol" in docs/channels.md). It requests the whole
// graph from the mapper at the start, and missing versions later. It solves only a complete graph.
// It repeats the last solution to a mapper that requests it, and keeps nothing on disk. Solutions
// are computed on the worker; graph updates wait meanwhile, HEALTH and requests do not.
class OptimizerNode {
 public:
  // When to solve. kEachUpdate: after every update, in a replay. kWhenAsked: live; after every
  // update too, so that a replay gives the same solutions, but not at the start, nor while many
  // wait. What then waits is solved in SolveWaiting().
  enum class SolveOn { kEachUpdate, kWhenAsked };

  OptimizerNode(const OptimizerParams& params,
                Bus* bus,
                Worker* worker,
                SolveOn when = SolveOn::kEachUpdate);

  // Starts a solution on the worker if updates came since the last one and the worker is idle, and
  // publishes the result.
  void SolveWaiting();
  // To be called live, twice a second. At the start the mapper sends its graph; the first solution
  // waits until no update has come between two calls.
  void EndStart();
  // To be called live, every few seconds. Repeats the request for a missing version, since a
  // request or its answer may be lost. After three requests in vain the version is given up. Takes
  // up another graph whose updates came, if the mapper of the present one does not answer.
  void AskAgain();

  Health& health() { return health_; }

 private:
  void OnUpdate(const graph_update_t& msg);
  void Take(const graph_update_t& msg);
  std::optional<GraphUpdate> Usable(const graph_update_t& msg);
  bool IsBegin(const GraphUpdate& update) const;
  void OnAnotherGraph(const GraphUpdate& update);
  void HearOwnGraph();
  void WaitForOwnGraph();
  void StartOver();
  void Expect(std::int64_t version);
  void Ask();
  void AskFrom(std::int64_t have_version);
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
  std::shared_ptr<PoseGraphOptimizer> optimizer_;  // only the worker may use it if worker_busy_
  bool worker_busy_ = false;
  std::deque<graph_update_t> updates_;  // received while worker_busy_
  PoseGraph solution_;
  std::int64_t graph_id_ = 0;                // of the last update added
  bool has_ended_ = false;                   // that update was the last one of its mapper
  std::optional<std::int64_t> other_graph_;  // of updates since the present graph was last heard
  int ticks_unanswered_ = 0;                 // calls of AskAgain() since then
  int ticks_of_two_mappers_ = 0;             // for which both have been heard
  std::int64_t newest_version_ = 0;          // newest version that the mapper is known to have
  std::int64_t malformed_version_ = 0;       // requested again because a vertex was malformed
  std::int64_t submaps_lost_ = 0;            // malformed twice
  int asked_in_vain_ = 0;                    // requests since the last version was added
  bool starting_;                            // live: the first request may still be answered
  int taken_since_tick_ = 0;                 // updates added since the last AskAgain()
  int taken_while_starting_ = 0;             // updates added since the last EndStart()
  std::int64_t update_utime_ = 0;            // of the last update added
  bool waiting_ = false;                     // there are updates that no solution has
  SolveStart next_start_ = SolveStart::kWarm;
  bool solve_failed_ = false;
  std::int64_t solution_number_ = 0;
  std::int64_t solution_seq_ = 0;
  std::int64_t request_seq_ = 0;
  std::int64_t covariances_seq_ = 0;
};

}  // namespace seastitch
