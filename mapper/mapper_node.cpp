#include "mapper/mapper_node.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>
#include <vector>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

constexpr char kName[] = "mapper";
// Graph updates that answer a request at once: some 20 kB. Who still lacks some asks again.
constexpr int kUpdatesAtOnce = 16;

}  // namespace

MapperNode::MapperNode(const MapperConfig& config, Bus* bus, Worker* worker)
    : bus_(bus),
      worker_(worker),
      registration_(config.loop_closer),
      mapper_(config),
      archive_(std::make_shared<Archive>(
          SurveyStoreParams{config.map_dir, config.max_cached_mb, config.max_unsaved_mb},
          config.loop_closer.registration)) {
  SubscribeSensors();
  SubscribeOptimizer();
  health_.SetStarting(mapper_.WaitsFor());
}

void MapperNode::SubscribeSensors() {
  const auto navigate = [this](const auto& sample) {
    mapper_.Add(sample);
    Deliver();
    SendWaiting();
    LookAgain();
    if (mapper_.IsWaiting()) ReportHealth();  // else with every NAV
  };
  const auto add = [this](const auto& sample) {
    mapper_.Add(sample);
    Deliver();
    ReportHealth();
  };
  Subscribe<imu_t>(channels::kImu, "imu", navigate);
  Subscribe<dvl_t>(channels::kDvl, "dvl", navigate);
  Subscribe<depth_t>(channels::kDepth, "depth", navigate);
  Subscribe<navigation_t>(channels::kIns, "ins", navigate);
  Subscribe<position_fix_t>(channels::kPositionFix, "position_fix", navigate);
  Subscribe<mbes_ping_t>(channels::kMbesPing, "mbes_ping", add);
  Subscribe<mbes_soundings_t>(channels::kMbesSoundings, "mbes_soundings", add);
  Subscribe<sound_velocity_profile_t>(channels::kSvp, "svp", add);
}

void MapperNode::SubscribeOptimizer() {
  bus_->Subscribe<pose_graph_t>(channels::kPoseGraph,
                                QueueOf(channels::kPoseGraph),
                                [this, watch = SequenceWatch()](const pose_graph_t& msg) mutable {
                                  if (watch.Add(msg.seq) > 0) RequestSolution();
                                  OnPoseGraph(msg);
                                });
  bus_->Subscribe<graph_request_t>(channels::kGraphRequest,
                                   QueueOf(channels::kGraphRequest),
                                   [this](const graph_request_t& msg) { OnGraphRequest(msg); });
  bus_->Subscribe<covariances_t>(channels::kCovariances,
                                 QueueOf(channels::kCovariances),
                                 [this](const covariances_t& msg) { OnCovariances(msg); });
}

template <class Msg, class Handler>
void MapperNode::Subscribe(const char* channel, const std::string& name, Handler handler) {
  bus_->Subscribe<Msg>(channel,
                       QueueOf(channel),
                       [this, name, handler, watch = SequenceWatch()](const Msg& msg) mutable {
                         health_.Tick(name);
                         if (const std::int64_t lost = watch.Add(msg.seq); lost > 0)
                           health_.Count(name + "_lost", lost);
                         if (const auto sample = FromLcm(msg))
                           handler(*sample);
                         else
                           health_.Count(name + "_malformed");
                       });
}

void MapperNode::OnPoseGraph(const pose_graph_t& msg) {
  health_.Tick("pose_graph");
  const std::optional<PoseGraph> solution = pose_graph_.Add(msg);
  health_.Set("pose_graph_malformed", pose_graph_.malformed());
  if (!solution) return;
  mapper_.Take(*solution);
  ReportHealth();
}

void MapperNode::OnGraphRequest(const graph_request_t& msg) {
  if (msg.sender == kName) return;  // our own
  health_.Count("graph_requests");
  const bool same_graph = msg.graph_id == mapper_.graph().graph_id();
  const std::int64_t have = same_graph ? std::max<std::int64_t>(0, msg.have_version) : 0;
  version_sent_ = std::min(version_sent_, have);
  // Some at once; the rest one by one, as a submap's points.
  for (int i = 0; i < kUpdatesAtOnce && SendNextUpdate(); ++i) {
  }
}

void MapperNode::OnCovariances(const covariances_t& msg) {
  if (msg.recipient != kName) return;
  if (const std::optional<PairCovariances> answer = FromLcm(msg))
    mapper_.Take(*answer);
  else
    health_.Count("covariances_malformed");
}

void MapperNode::RequestSolution() {
  graph_request_t msg{};
  msg.utime = mapper_.last_nav() ? ToUtime(*mapper_.last_nav()) : 0;
  msg.seq = request_seq_++;
  msg.sender = kName;
  msg.graph_id = mapper_.graph().graph_id();
  msg.have_version = mapper_.solution_version();
  bus_->Publish(channels::kGraphRequest, msg);
  health_.Count("solution_requests");
}

void MapperNode::AddSubmap(Submap submap) {
  mapper_.AddSubmap(std::move(submap));
  Deliver();
}

bool MapperNode::LookAgain() {
  const bool left = mapper_.LookAgain();
  if (left) PostNextJob();
  Deliver();
  return left;
}

void MapperNode::Finish(const std::function<void()>& pause) {
  while (SendNextChunk()) pause();
  mapper_.Finish();
  Deliver();
  while (SendNextChunk()) pause();
  while (SendNextUpdate()) pause();
  ReportHealth();
}

void MapperNode::Deliver() {
  for (const MapperEvent& event : mapper_.TakeEvents())
    std::visit([this](const auto& what) { Send(what); }, event);
  if (mapper_.HasSubmapToRegister() || job_) PostNextJob();
}

void MapperNode::Send(const NavState& state) {
  bus_->Publish(channels::kNav, ToLcm(state, nav_seq_++));
  health_.Tick("nav");
  ReportHealth();
}

void MapperNode::Send(const CorrectedNavState& state) {
  bus_->Publish(channels::kNavCorrected, ToLcm(state, corrected_seq_++));
}

void MapperNode::Send(const std::shared_ptr<const Submap>& submap) {
  // An announcement ends the submap before it: its points go first.
  while (SendNextChunk()) {
  }
  SubmapMessages messages = ToLcm(*submap, submap_seq_++, points_seq_);
  points_seq_ += static_cast<std::int64_t>(messages.chunks.size());
  bus_->Publish(channels::kSubmap, messages.announcement);
  chunks_.assign(std::make_move_iterator(messages.chunks.begin()),
                 std::make_move_iterator(messages.chunks.end()));
}

// What is new waits behind what was asked for again.
void MapperNode::Send(const GraphStep&) { SendNextUpdate(); }

void MapperNode::Send(const CovarianceQuestion& question) {
  CovarianceRequest request = question.request;
  request.sender = kName;
  bus_->Publish(channels::kCovarianceRequest, ToLcm(request, question.submap_time));
}

void MapperNode::Send(const JournalEntry&) {}

bool MapperNode::SendNextChunk() {
  if (chunks_.empty()) return false;
  bus_->Publish(channels::kSubmapPoints, chunks_.front());
  chunks_.pop_front();
  return true;
}

bool MapperNode::SendNextUpdate() {
  const GraphStep* step = mapper_.graph().After(version_sent_);
  if (step == nullptr) return false;
  bus_->Publish(channels::kGraphUpdate, ToLcm(step->update, step->submap_time, update_seq_++));
  version_sent_ = step->update.version;
  return true;
}

void MapperNode::SendWaiting() {
  SendNextChunk();
  SendNextUpdate();
}

// A job that the worker does not take is tried again with the next message.
void MapperNode::PostNextJob() {
  if (!job_) job_ = mapper_.NextJob();
  if (!job_) return;
  const RegistrationJob job = *std::exchange(job_, std::nullopt);
  const bool posted = worker_->Post([this, archive = archive_, params = registration_, job] {
    SurveyStore& store = archive->store;
    if (job.closed && !job.closed->cloud.empty()) store.Put(job.closed);
    const LoadSubmap load = [&store](SubmapId id) { return store.Get(id); };
    const auto results =
        std::make_shared<RegistrationResultSet>(Run(job, params, load, &archive->prepared));
    return [this, results, counters = store.counters()] {
      OnRegistered(std::move(*results), counters);
    };
  });
  if (posted) return;
  job_ = job;
  health_.Count("worker_refused");
}

void MapperNode::OnRegistered(RegistrationResultSet results, const SurveyStoreCounters& store) {
  if (results.job.closed) store_fails_ = store.write_errors > health_.counter("store_write_errors");
  mapper_.Take(std::move(results));
  health_.Set("store_saved", store.saved);
  health_.Set("store_write_errors", store.write_errors);
  health_.Set("store_read_errors", store.read_errors);
  health_.Set("store_lost", store.lost);
  health_.Set("store_cached_kb", store.cached_bytes / 1000);
  Deliver();
  ReportHealth();
}

void MapperNode::ReportHealth() {
  for (const auto& [name, count] : mapper_.counters()) health_.Set(name, count);
  std::vector<Condition> faults = mapper_.conditions();
  if (store_fails_) faults.push_back({&conditions::kStoreNotWriting, {}});
  health_.SetConditions(faults);
  health_.SetText(mapper_.Summary());
  if (mapper_.IsWaiting())
    health_.SetStarting(mapper_.WaitsFor());
  else
    health_.SetRunning();
}

}  // namespace seastitch
