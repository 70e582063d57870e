#include "optimizer/optimizer_node.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace seastitch {
namespace {

constexpr int kUnlimited = 0;
constexpr int kRequestQueue = 16;
// Kept while the worker solves, 38 kB each at most; the mapper has the others still.
constexpr std::size_t kMaxUpdates = 1000;

}  // namespace

OptimizerNode::OptimizerNode(const OptimizerConfig& config, Bus* bus, Worker* worker, SolveOn when)
    : config_(config),
      when_(when),
      bus_(bus),
      worker_(worker),
      optimizer_(std::make_shared<PoseGraphOptimizer>(config.params)) {
  bus_->Subscribe<graph_update_t>(
      "GRAPH_UPDATE", kUnlimited, [this](const graph_update_t& msg) { OnUpdate(msg); });
  bus_->Subscribe<graph_request_t>(
      "GRAPH_REQUEST", kRequestQueue, [this](const graph_request_t& msg) { OnRequest(msg); });
  bus_->Subscribe<covariance_request_t>(
      "COVARIANCE_REQUEST", kRequestQueue, [this](const covariance_request_t& msg) {
        OnCovarianceRequest(msg);
      });
  Ask();
  health_.SetState(HealthState::kStarting, "waiting for the mapper's graph");
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
  const std::optional<GraphUpdate> update = Checked(msg);
  if (!update) return;
  if (optimizer_->Contradicts(*update)) StartOver();
  const bool new_to_us = update->version > optimizer_->version();
  if (optimizer_->Add(*update)) {
    if (!new_to_us) return;
    update_utime_ = msg.utime;
    waiting_ = true;
    newest_version_ = std::max(newest_version_, update->version);
    if (when_ == SolveOn::kEachUpdate) SolveWaiting();
  } else if (update->version > newest_version_) {
    // Asked once for what this one shows to be missing; the answer's own later versions, if it has
    // a hole, are not newer.
    newest_version_ = update->version;
    Ask();
  }
}

std::optional<GraphUpdate> OptimizerNode::Checked(const graph_update_t& msg) {
  std::optional<GraphUpdate> update = FromLcm(msg);
  if (update) return update;
  health_.Count("updates_malformed");
  // The next version counts as empty: what follows must not wait for ever for a step that will come
  // no better when it comes again.
  if (msg.version == optimizer_->version() + 1) return GraphUpdate{msg.version, {}, {}};
  return std::nullopt;
}

void OptimizerNode::StartOver() {
  health_.Count("graphs_started_over");
  optimizer_ = std::make_shared<PoseGraphOptimizer>(config_.params);
  solution_ = {};
  newest_version_ = 0;
}

void OptimizerNode::OnRequest(const graph_request_t& msg) {
  if (msg.from != "mapper" || msg.have_version >= solution_.graph_version) return;
  health_.Count("solutions_repeated");
  PublishSolution();
}

void OptimizerNode::Ask() {
  graph_request_t msg{};
  msg.utime = update_utime_;
  msg.seq = request_seq_++;
  msg.from = "optimizer";
  msg.have_version = optimizer_->version();
  bus_->Publish("GRAPH_REQUEST", msg);
  health_.Count("requests");
}

void OptimizerNode::AskAgain() {
  if (!worker_busy_ && newest_version_ > optimizer_->version()) Ask();
}

void OptimizerNode::SolveWaiting() {
  if (!waiting_ || worker_busy_) return;
  worker_busy_ = true;
  waiting_ = false;
  const bool posted = worker_->Post([this, optimizer = optimizer_] {
    const auto begin = std::chrono::steady_clock::now();  // for HEALTH alone
    PoseGraph solution = optimizer->Solve();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    return [this, solution = std::move(solution), took] { OnSolved(solution, took.count()); };
  });
  if (posted) return;
  worker_busy_ = false;
  waiting_ = true;
  health_.Count("worker_refused");
}

void OptimizerNode::OnSolved(PoseGraph solution, double solve_s) {
  worker_busy_ = false;
  solution_ = std::move(solution);
  PublishSolution();
  Report(solve_s);
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

// No answer while the worker is busy, mostly with another solution, by which what was asked would
// be out of date. Who still lacks it asks again.
void OptimizerNode::OnCovarianceRequest(const covariance_request_t& msg) {
  std::optional<CovarianceRequest> request = FromLcm(msg);
  if (!request) {
    health_.Count("covariance_requests_malformed");
    return;
  }
  if (worker_busy_ || waiting_ || request->graph_version != solution_.graph_version) {
    health_.Count("covariance_requests_late");
    return;
  }
  worker_busy_ = true;
  const bool posted = worker_->Post([this, optimizer = optimizer_, request = *std::move(request)] {
    PairCovariances answer{request.from,
                           request.seq,
                           request.graph_version,
                           optimizer->RelativeCovariances(request.pairs)};
    return [this, answer = std::move(answer)] { OnCovariances(answer); };
  });
  if (posted) return;
  worker_busy_ = false;
  health_.Count("worker_refused");
}

void OptimizerNode::OnCovariances(const PairCovariances& answer) {
  worker_busy_ = false;
  bus_->Publish("COVARIANCES", ToLcm(answer, FromUtime(update_utime_), covariances_seq_++));
  health_.Count("pair_covariances", static_cast<std::int64_t>(answer.pairs.size()));
  TakeWaiting();
}

void OptimizerNode::PublishSolution() {
  // Every publication has its own number, so that parts of two never mix.
  const auto parts = ToLcm(solution_, solution_number_++, FromUtime(update_utime_), solution_seq_);
  solution_seq_ += static_cast<std::int64_t>(parts.size());
  for (const pose_graph_t& part : parts) bus_->Publish("POSE_GRAPH", part);
}

void OptimizerNode::Report(double solve_s) {
  const auto believed = std::count_if(
      solution_.loop_edges.begin(), solution_.loop_edges.end(), [](const SolvedEdge& edge) {
        return edge.weight >= kBelievedWeight;
      });
  health_.Set("solve_ms", static_cast<std::int64_t>(1e3 * solve_s));
  health_.Set("graph_version", optimizer_->version());
  health_.Set("vertices", static_cast<std::int64_t>(solution_.vertices.size()));
  health_.Set("loop_closures", static_cast<std::int64_t>(solution_.loop_edges.size()));
  health_.Set("loop_closures_believed", believed);
  health_.Set("position_fixes", optimizer_->position_fixes());
  health_.Set("position_fixes_believed", optimizer_->position_fixes_believed());
  const MountingErrors& mounting = solution_.mounting;
  health_.Set("sonar_forward_mm", std::lround(1e3 * mounting.sonar_m.x()));
  health_.Set("sonar_starboard_mm", std::lround(1e3 * mounting.sonar_m.y()));
  health_.Set("dvl_yaw_mdeg", std::lround(1e3 * Rad2Deg(mounting.dvl_yaw_rad)));
  for (const auto& [name, count] : optimizer_->counters()) health_.Set(name, count);
  const bool missing = newest_version_ > optimizer_->version();
  health_.SetState(missing ? HealthState::kDegraded : HealthState::kOk,
                   "version " + std::to_string(optimizer_->version()) + ", " +
                       std::to_string(solution_.vertices.size()) + " submaps, " +
                       std::to_string(believed) + " of " +
                       std::to_string(solution_.loop_edges.size()) + " loop closures believed" +
                       (missing ? ", later versions missing" : ""));
}

}  // namespace seastitch
