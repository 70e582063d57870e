#include "optimizer/optimizer_node.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

// Updates kept while the worker solves, at most 38 kB each. The mapper still has the others.
constexpr std::size_t kMaxUpdates = 1000;
// Up to so many waiting updates each get the solution that a replay gives it. Of more, one solution
// serves all but the last of them.
constexpr std::size_t kMostInTurn = 16;
// So many updates between two calls of AskAgain() show that the mapper is resending its graph: no
// survey closes submaps that fast.
constexpr int kUpdatesWhenCatchingUp = 10;
// Requests for a missing version before it is given up. The mapper answers within seconds.
constexpr int kMaxAskedInVain = 3;
// Calls of AskAgain(), 5 s apart.
constexpr int kTicksUntilLeft = 2;     // without an answer of the present graph's mapper
constexpr int kTicksOfTwoMappers = 6;  // that the condition holds

std::int64_t Accepted(const PoseGraph& solution) {
  return std::count_if(solution.loop_edges.begin(),
                       solution.loop_edges.end(),
                       [](const SolvedEdge& edge) { return edge.weight >= kAcceptedWeight; });
}

}  // namespace

OptimizerNode::OptimizerNode(const OptimizerParams& params, Bus* bus, Worker* worker, SolveOn when)
    : params_(params),
      when_(when),
      bus_(bus),
      worker_(worker),
      optimizer_(std::make_shared<PoseGraphOptimizer>(params)),
      starting_(when == SolveOn::kWhenAsked) {
  bus_->Subscribe<graph_update_t>(channels::kGraphUpdate,
                                  QueueOf(channels::kGraphUpdate),
                                  [this](const graph_update_t& msg) { OnUpdate(msg); });
  bus_->Subscribe<graph_request_t>(channels::kGraphRequest,
                                   QueueOf(channels::kGraphRequest),
                                   [this](const graph_request_t& msg) { OnRequest(msg); });
  bus_->Subscribe<covariance_request_t>(
      channels::kCovarianceRequest,
      QueueOf(channels::kCovarianceRequest),
      [this](const covariance_request_t& msg) { OnCovarianceRequest(msg); });
  Ask();
  health_.SetStarting("waiting for the mapper's graph");
}

void OptimizerNode::OnUpdate(const graph_update_t& msg) {
  health_.Tick("graph_update");
  if (!worker_busy_) {
    Take(msg);
  } else if (updates_.size() < kMaxUpdates) {
    updates_.push_back(msg);
  } else {
    health_.Count("updates_dropped_busy");
    newest_version_ = std::max(newest_version_, msg.version);  // asked for again
  }
}

void OptimizerNode::Take(const graph_update_t& msg) {
  const std::optional<GraphUpdate> update = Usable(msg);
  if (!update) return;
  const bool another_graph = newest_version_ > 0 && update->graph_id != graph_id_;
  if (another_graph && !IsBegin(*update) && !has_ended_) return OnAnotherGraph(*update);
  if (!another_graph) HearOwnGraph();
  if (another_graph || optimizer_->store().Contradicts(*update)) StartOver();
  graph_id_ = update->graph_id;
  const bool is_new = update->version > optimizer_->version();
  if (!optimizer_->Add(*update)) return Expect(update->version);
  if (!is_new) return;
  has_ended_ = update->final;
  if (update->final || update->resumed) next_start_ = SolveStart::kFromDeadReckoning;
  update_utime_ = msg.utime;
  waiting_ = waiting_ || optimizer_->IsDue();
  ++taken_since_tick_;
  ++taken_while_starting_;
  newest_version_ = std::max(newest_version_, update->version);
  if (when_ == SolveOn::kEachUpdate || updates_.size() < kMostInTurn) SolveWaiting();
}

// In a replay another graph begins with its version 1; later versions are late ones of the graph
// before.
bool OptimizerNode::IsBegin(const GraphUpdate& update) const {
  return when_ == SolveOn::kEachUpdate && update.version == 1;
}

// Live, the mapper of the present graph may have been killed, or another mapper may have begun
// beside it. (A graph that has ended is left at once.) Its last version is requested: if it
// answers, its graph goes on.
void OptimizerNode::OnAnotherGraph(const GraphUpdate& update) {
  health_.Count("updates_of_another_graph");
  if (when_ == SolveOn::kEachUpdate) return;
  if (!other_graph_) {
    ticks_unanswered_ = 0;
    AskFrom(optimizer_->version() - 1);
  }
  other_graph_ = update.graph_id;
  ReportState();
}

void OptimizerNode::HearOwnGraph() {
  if (!other_graph_) return;
  other_graph_.reset();
  ticks_of_two_mappers_ = kTicksOfTwoMappers;
  ReportState();
}

// Takes up the other graph if the present one's mapper has not answered for two ticks.
void OptimizerNode::WaitForOwnGraph() {
  if (ticks_of_two_mappers_ > 0 && --ticks_of_two_mappers_ == 0) ReportState();
  if (!other_graph_) return;
  if (++ticks_unanswered_ < kTicksUntilLeft) return AskFrom(optimizer_->version() - 1);
  StartOver();
  graph_id_ = *std::exchange(other_graph_, std::nullopt);
  ticks_of_two_mappers_ = 0;
  Ask();
  ReportState();
}

// Requests the versions that are missing before this one, once per newest version: later versions
// in the answer do not cause another request.
void OptimizerNode::Expect(std::int64_t version) {
  if (version <= newest_version_) return;
  newest_version_ = version;
  Ask();
  ReportState();
}

// Converts an update. Malformed edges are left out. An update with a malformed vertex is requested
// once more; if it is malformed again, an empty update with its version takes its place.
std::optional<GraphUpdate> OptimizerNode::Usable(const graph_update_t& msg) {
  std::optional<GraphUpdate> update = FromLcm(msg);
  if (update) return update;
  health_.Count("updates_malformed");
  const std::optional<GraphUpdate> malformed = UncheckedFromLcm(msg);
  if (malformed) update = WithoutMalformedEdges(*malformed);
  if (update || msg.version != optimizer_->version() + 1) return update;
  if (malformed_version_ != msg.version) {
    malformed_version_ = msg.version;
    newest_version_ = std::max(newest_version_, msg.version);
    Ask();
    ReportState();
    return std::nullopt;
  }
  ++submaps_lost_;
  return GraphUpdate{msg.version, {}, {}, {}, msg.graph_id, msg.is_final != 0, msg.is_resumed != 0};
}

void OptimizerNode::StartOver() {
  health_.Count("graphs_started_over");
  optimizer_ = std::make_shared<PoseGraphOptimizer>(params_);
  solution_ = {};
  newest_version_ = malformed_version_ = submaps_lost_ = 0;
  waiting_ = solve_failed_ = has_ended_ = false;
  asked_in_vain_ = 0;
  next_start_ = SolveStart::kWarm;
}

void OptimizerNode::OnRequest(const graph_request_t& msg) {
  const bool has_it =
      msg.graph_id == solution_.graph_id && msg.have_version >= solution_.graph_version;
  if (msg.sender != "mapper" || solution_.graph_version == 0 || has_it) return;
  health_.Count("solutions_repeated");
  PublishSolution();
}

void OptimizerNode::Ask() { AskFrom(optimizer_->version()); }

void OptimizerNode::AskFrom(std::int64_t have_version) {
  graph_request_t msg{};
  msg.utime = update_utime_;
  msg.seq = request_seq_++;
  msg.sender = "optimizer";
  msg.graph_id = graph_id_;
  msg.have_version = std::max<std::int64_t>(0, have_version);
  bus_->Publish(channels::kGraphRequest, msg);
  health_.Count("requests");
}

void OptimizerNode::AskAgain() {
  const bool catching_up = taken_since_tick_ >= kUpdatesWhenCatchingUp;
  if (!IsMissing() || catching_up) asked_in_vain_ = 0;
  taken_since_tick_ = 0;
  if (worker_busy_) return;
  WaitForOwnGraph();
  if (IsMissing() && asked_in_vain_ == kMaxAskedInVain) {
    health_.Count("versions_given_up");
    newest_version_ = optimizer_->version();
    ReportState();
  }
  if (IsMissing()) {
    ++asked_in_vain_;
    Ask();
  }
  SolveWaiting();
}

void OptimizerNode::EndStart() {
  starting_ = starting_ && std::exchange(taken_while_starting_, 0) > 0;
  SolveWaiting();
}

void OptimizerNode::SolveWaiting() {
  if (!waiting_ || worker_busy_ || starting_ || IsMissing()) return;
  waiting_ = false;
  const SolveStart start = std::exchange(next_start_, SolveStart::kWarm);
  if (Post([this, optimizer = optimizer_, worker = worker_, start] {
        const auto begin = std::chrono::steady_clock::now();  // for HEALTH alone
        std::optional<PoseGraph> solution =
            optimizer->Solve(start, [worker] { worker->ReportProgress(); });
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        return [this, solution = std::move(solution), took] { OnSolved(solution, took.count()); };
      }))
    return;
  waiting_ = true;
  next_start_ = start;
}

// False: the worker's queue is full.
bool OptimizerNode::Post(Worker::Job job) {
  worker_busy_ = true;
  if (worker_->Post(std::move(job))) return true;
  worker_busy_ = false;
  health_.Count("worker_refused");
  return false;
}

// Without a new solution the last one stays in use.
void OptimizerNode::OnSolved(std::optional<PoseGraph> solution, double solve_s) {
  worker_busy_ = false;
  solve_failed_ = !solution;
  if (solution) {
    solution_ = *std::move(solution);
    solution_.graph_id = graph_id_;
    PublishSolution();
  }
  ReportSolution(solve_s);
  ReportState();
  TakeWaiting();
}

void OptimizerNode::TakeWaiting() {
  while (!updates_.empty() && !worker_busy_) {
    const graph_update_t msg = std::move(updates_.front());
    updates_.pop_front();
    Take(msg);
  }
  if (when_ == SolveOn::kWhenAsked) SolveWaiting();
}

// Not answered while the worker is busy or a solution is due: the answer would be out of date. The
// mapper repeats its request.
void OptimizerNode::OnCovarianceRequest(const covariance_request_t& msg) {
  std::optional<CovarianceRequest> request = FromLcm(msg);
  if (!request) {
    health_.Count("covariance_requests_malformed");
    return;
  }
  if (worker_busy_ || waiting_ || request->graph_version != solution_.graph_version ||
      request->graph_id != solution_.graph_id) {
    health_.Count("covariance_requests_late");
    return;
  }
  Post([this, optimizer = optimizer_, request = *std::move(request)] {
    PairCovariances answer{request.sender,
                           request.seq,
                           request.graph_version,
                           optimizer->RelativeCovariances(request.pairs),
                           request.graph_id};
    return [this, answer = std::move(answer)] { OnCovariances(answer); };
  });
}

void OptimizerNode::OnCovariances(const PairCovariances& answer) {
  worker_busy_ = false;
  bus_->Publish(channels::kCovariances,
                ToLcm(answer, FromUtime(update_utime_), covariances_seq_++));
  health_.Count("pair_covariances", static_cast<std::int64_t>(answer.pairs.size()));
  TakeWaiting();
}

void OptimizerNode::PublishSolution() {
  // Every publication has its own number, so that parts of two are never joined.
  const auto parts = ToLcm(solution_, solution_number_++, FromUtime(update_utime_), solution_seq_);
  solution_seq_ += static_cast<std::int64_t>(parts.size());
  for (const pose_graph_t& part : parts) bus_->Publish(channels::kPoseGraph, part);
}

void OptimizerNode::ReportSolution(double solve_s) {
  health_.Set("solve_ms", static_cast<std::int64_t>(1e3 * solve_s));
  health_.Set("graph_version", solution_.graph_version);
  health_.Set("vertices", static_cast<std::int64_t>(solution_.vertices.size()));
  health_.Set("loop_closures", static_cast<std::int64_t>(solution_.loop_edges.size()));
  health_.Set("loop_closures_accepted", Accepted(solution_));
  std::int64_t fixes = 0, fixes_accepted = 0;
  for (const StoredEdge& fix : optimizer_->store().fixes()) {
    fixes += fix.Pulls() ? 1 : 0;
    fixes_accepted += fix.weight.value_or(0.0) >= kAcceptedWeight ? 1 : 0;
  }
  constexpr std::int64_t kFewFixes = 4;
  health_.HoldIf(fixes >= kFewFixes && 2 * fixes_accepted < fixes,
                 conditions::kFixesContradictMap,
                 std::to_string(fixes - fixes_accepted) + " of " + std::to_string(fixes));
  health_.Set("position_fixes", fixes);
  health_.Set("position_fixes_accepted", fixes_accepted);
  const MountingErrors mounting = solution_.MountingOf(0);  // on the vehicle there is one dive
  health_.Set("sonar_forward_mm", std::lround(1e3 * mounting.sonar_m.x()));
  health_.Set("sonar_starboard_mm", std::lround(1e3 * mounting.sonar_m.y()));
  health_.Set("dvl_yaw_mdeg", std::lround(1e3 * Rad2Deg(mounting.dvl_yaw_rad)));
  for (const auto& [name, count] : optimizer_->counters()) health_.Set(name, count);
}

void OptimizerNode::ReportState() {
  health_.HoldIf(IsMissing(), conditions::kGraphIncomplete);
  health_.HoldIf(
      submaps_lost_ > 0, conditions::kSubmapMalformed, std::to_string(submaps_lost_) + " so far");
  health_.HoldIf(solve_failed_, conditions::kNoSolution);
  health_.HoldIf(ticks_of_two_mappers_ > 0, conditions::kTwoMappers);
  health_.HoldIf(!optimizer_->converged(), conditions::kSolutionNotConverged);
  health_.HoldIf(optimizer_->lacks_covariance(), conditions::kNoCovariance);
  health_.SetText("version " + std::to_string(optimizer_->version()) + ", " +
                  std::to_string(solution_.vertices.size()) + " submaps, " +
                  std::to_string(Accepted(solution_)) + " of " +
                  std::to_string(solution_.loop_edges.size()) + " loop closures accepted");
  health_.SetRunning();
}

}  // namespace seastitch
