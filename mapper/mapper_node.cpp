#include "mapper/mapper_node.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "mapper/geometry/georeference.hpp"
#include "mapper/position_edges.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/rejection.hpp"
#include "mapper/submaps/terrain_information.hpp"

namespace seastitch {
namespace {

// Messages that LCM keeps while the loop is busy: several seconds of each stream.
constexpr int kImuQueue = 2000;
constexpr int kDvlQueue = 200;
constexpr int kDepthQueue = 200;
constexpr int kPingQueue = 300;  // 26 kB each
constexpr int kProfileQueue = 10;
constexpr int kFixQueue = 100;
constexpr int kPoseGraphQueue = 200;
constexpr int kRequestQueue = 16;
constexpr int kCovariancesQueue = 4;

constexpr char kName[] = "mapper";
constexpr double kAskAgainAfterS = 30.0;
static_assert(LoopCloser::kMaxPairsAsked <= kMaxCovariancePairs);

// A ping so far ahead of navigation has a wrong clock, and must not hold up those behind it.
constexpr double kMaxAheadS = 30.0;
// Submaps that wait to be stored without registration, in max_waiting_submaps: their points are in
// memory until those before them are registered.
constexpr std::size_t kUnregisteredPerRegistered = 4;
// Graph updates that answer a request at once: some 20 kB. Who still lacks some asks again.
constexpr int kUpdatesAtOnce = 16;
constexpr Eigen::Index kHeadingOfCovariance = 5;

// Of x, y, yaw.
Eigen::Matrix3d LevelCovariance(const NavState& state) {
  constexpr Eigen::Index kAxes[3] = {0, 1, kHeadingOfCovariance};
  Eigen::Matrix3d covariance;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = 0; c < 3; ++c) covariance(r, c) = state.covariance(kAxes[r], kAxes[c]);
  }
  return covariance;
}

double HeadingSigma(const NavState& state) {
  return std::sqrt(state.covariance(kHeadingOfCovariance, kHeadingOfCovariance));
}

bool IsProfile(SoundSpeed::Source source) {
  return source == SoundSpeed::Source::kProfile || source == SoundSpeed::Source::kConfigured;
}

const char* Sentence(SoundSpeed::Source source) {
  switch (source) {
    case SoundSpeed::Source::kProfile: return "; sound speed from a profile";
    case SoundSpeed::Source::kConfigured: return "; sound speed from the configured profile";
    case SoundSpeed::Source::kTransducer:
      return "; sound speed from the transducer alone: no profile known";
    case SoundSpeed::Source::kAssumed: return "; sound speed assumed: no profile known";
  }
  return "";
}

std::string Sentence(const Judgement& harm) {
  char text[200];
  if (harm.torn)
    std::snprintf(text,
                  sizeof text,
                  "the last solution is not used: it would tear the map apart (%zu cells seen "
                  "twice in place of %zu by dead reckoning); ",
                  harm.cells_solved,
                  harm.cells_dead_reckoned);
  else
    std::snprintf(text,
                  sizeof text,
                  "the last solution is not used: it would make the map less consistent than dead "
                  "reckoning (%.3f m in place of %.3f m); ",
                  harm.solved_m,
                  harm.dead_reckoned_m);
  return text;
}

}  // namespace

MapperNode::MapperNode(const MapperConfig& config, Bus* bus, Worker* worker)
    : config_(config),
      bus_(bus),
      worker_(worker),
      navigation_(config.navigation, config.vehicle),
      sound_speed_(config.sound_velocity_profile),
      builder_(
          config.submap,
          config.filter,
          [this](Time a, Time b) { return DriftBetween(a, b); },
          [this](Time anchor, Time t) {
            return navigation_.Hindsight(anchor, t).value_or(Pose2{});
          }),
      archive_(std::make_shared<Archive>(
          SurveyStoreParams{config.survey_dir, config.max_cached_mb, config.max_unsaved_mb},
          config.loop_closer.registration)),
      loop_closer_(config.loop_closer) {
  const auto navigate = [this](const auto& sample) { OnNavigation(sample); };
  Subscribe<imu_t>("IMU", kImuQueue, "imu", navigate);
  Subscribe<dvl_t>("DVL", kDvlQueue, "dvl", navigate);
  Subscribe<depth_t>("DEPTH", kDepthQueue, "depth", navigate);
  Subscribe<position_fix_t>("POSITION_FIX", kFixQueue, "position_fix", navigate);
  Subscribe<mbes_ping_t>(
      "MBES_PING", kPingQueue, "mbes_ping", [this](const MbesPing& ping) { OnPing(ping); });
  Subscribe<sound_velocity_profile_t>(
      "SVP", kProfileQueue, "svp", [this](const SoundVelocityProfile& p) { OnProfile(p); });
  bus_->Subscribe<pose_graph_t>("POSE_GRAPH",
                                kPoseGraphQueue,
                                [this, watch = SequenceWatch()](const pose_graph_t& msg) mutable {
                                  if (watch.Add(msg.seq) > 0) RequestSolution();
                                  OnPoseGraph(msg);
                                });
  bus_->Subscribe<graph_request_t>(
      "GRAPH_REQUEST", kRequestQueue, [this](const graph_request_t& msg) { OnGraphRequest(msg); });
  bus_->Subscribe<covariances_t>(
      "COVARIANCES", kCovariancesQueue, [this](const covariances_t& msg) { OnCovariances(msg); });
  health_.SetState(HealthState::kStarting, "waiting for navigation");
}

template <class Msg, class Handler>
void MapperNode::Subscribe(const std::string& channel,
                           int queue,
                           const std::string& name,
                           Handler handler) {
  bus_->Subscribe<Msg>(
      channel, queue, [this, name, handler, watch = SequenceWatch()](const Msg& msg) mutable {
        health_.Tick(name);
        if (const std::int64_t lost = watch.Add(msg.seq); lost > 0)
          health_.Count(name + "_lost", lost);
        if (const auto sample = FromLcm(msg))
          handler(*sample);
        else
          health_.Count(name + "_malformed");
      });
}

template <class Sample>
void MapperNode::OnNavigation(const Sample& sample) {
  navigation_.Add(sample);
  Advance();
}

void MapperNode::OnPing(const MbesPing& ping) {
  if (pings_.size() >= static_cast<std::size_t>(config_.max_waiting_pings)) {
    pings_.pop_front();
    health_.Count("pings_dropped_waiting");
  }
  navigation_.AddSoundSpeed(ping.time, ping.sound_speed_mps);
  pings_.push_back(ping);
  GeoreferencePings(false);
}

void MapperNode::OnProfile(const SoundVelocityProfile& profile) {
  if (!sound_speed_.Add(profile)) health_.Count("svp_unusable");
}

void MapperNode::Advance() {
  PublishNav();
  GeoreferencePings(false);
  SendWaiting();
  RegisterNext();
  LookAgain();
}

void MapperNode::GeoreferencePings(bool no_more_poses) {
  while (!pings_.empty()) {
    const MbesPing& ping = pings_.front();
    const std::optional<Time> latest = navigation_.latest();
    const Time last_echo = LastEcho(ping);
    const bool ready = no_more_poses || (latest && last_echo <= *latest);
    const bool never = latest && ToSeconds(last_echo - *latest) > kMaxAheadS;
    if (!ready && !never) return;
    if (never)
      health_.Count("pings_from_the_future");
    else
      AddToSubmap(ping);
    pings_.pop_front();
  }
}

void MapperNode::AddToSubmap(const MbesPing& ping) {
  const SoundSpeed::Choice sound_speed = sound_speed_.For(ping);
  sound_speed_source_ = sound_speed.source;
  if (!IsProfile(sound_speed.source)) health_.Count("pings_without_profile");
  const PoseLookup T_map_vehicle_at = [this](Time t) -> std::optional<Eigen::Isometry3d> {
    const std::optional<NavState> state = navigation_.StateAt(t);
    if (!state) return std::nullopt;
    return state->T_map_vehicle;
  };
  const std::optional<GeoreferencedPing> georeferenced =
      Georeference(ping, T_map_vehicle_at, config_.vehicle, *sound_speed.rays);
  if (!georeferenced) {
    health_.Count("pings_without_pose");
    return;
  }
  health_.Count("beams_read", georeferenced->beams_read);
  health_.Count("beams_invalid", georeferenced->beams_invalid);
  health_.Count("beams_refused", georeferenced->beams_refused);
  if (georeferenced->speed_from_profile) health_.Count("pings_with_impossible_sound_speed");
  if (std::optional<Submap> closed = builder_.Add(*georeferenced)) OnClosed(std::move(*closed));
}

void MapperNode::OnClosed(Submap submap) {
  submap.covariance_from_previous = CovarianceFromPrevious(submap);
  std::vector<Frame> frames;
  if (previous_frame_) frames.push_back(*previous_frame_);
  const bool first = !previous_frame_ && next_id_ == 0;
  previous_frame_.reset();
  std::vector<GraphEdge> position_edges;
  if (const std::optional<NavState> state = navigation_.StateAt(submap.frame_time)) {
    submap.heading_sigma_rad = HeadingSigma(*state);
    previous_frame_ = Frame{SubmapId{next_id_}, *state};
    frames.push_back(*previous_frame_);
    position_edges = FixEdges(submap.end, frames);
    if (first) position_edges.push_back(StartEdge(previous_frame_->id, *state));
  }
  AddSubmap(std::move(submap), std::move(position_edges));
}

// Each fix on the frame that is nearest in time.
std::vector<GraphEdge> MapperNode::FixEdges(Time until, const std::vector<Frame>& frames) {
  std::vector<GraphEdge> edges;
  for (const MapFix& fix : navigation_.TakeFixes(until)) {
    const auto apart = [&fix](const Frame& f) {
      return std::abs(ToSeconds(f.state.time - fix.time));
    };
    const Frame& nearest =
        *std::min_element(frames.begin(), frames.end(), [&](const Frame& a, const Frame& b) {
          return apart(a) < apart(b);
        });
    const auto at_fix = navigation_.StateAt(fix.time);
    const auto covariance = navigation_.RelativeCovariance(nearest.state.time, fix.time);
    if (!at_fix || !covariance) {
      health_.Count("position_fixes_too_far");
      continue;
    }
    edges.push_back(FixEdge(nearest.id, nearest.state, fix, *at_fix, *covariance));
  }
  health_.Count("position_fixes_in_graph", static_cast<std::int64_t>(edges.size()));
  return edges;
}

// At the end of the dive, after the last submap is in the graph: no further one will bring them.
void MapperNode::AddLastFixes() {
  if (!finishing_ || !submaps_.empty() || !previous_frame_) return;
  GraphUpdate update;
  update.edges = FixEdges(*navigation_.latest(), {*previous_frame_});
  if (!update.edges.empty()) AddStep(std::move(update), previous_frame_->state.time);
}

Eigen::Matrix3d MapperNode::DriftBetween(Time a, Time b) const {
  // Of what is further back than navigation remembers, what it lost since then.
  const NavigationParams& p = config_.navigation;
  const Time oldest = *navigation_.latest() - FromSeconds(p.window_s - p.key_interval_s);
  const auto covariance = navigation_.RelativeCovariance(std::max(a, oldest), std::max(b, oldest));
  return covariance.value_or(Eigen::Matrix3d::Zero());
}

Eigen::Matrix3d MapperNode::CovarianceFromPrevious(const Submap& submap) {
  if (!previous_frame_) return Eigen::Matrix3d::Zero();
  const auto relative =
      navigation_.RelativeCovariance(previous_frame_->state.time, submap.frame_time);
  if (relative) return *relative;
  // The previous submap is further back than navigation remembers. As if the two were independent,
  // which is never too sure.
  health_.Count("relative_covariances_missing");
  const std::optional<NavState> state = navigation_.StateAt(submap.frame_time);
  const NavState& previous = previous_frame_->state;
  const Eigen::Matrix3d own = LevelCovariance(state ? *state : previous);
  return RelativeCovariance(LevelPose(previous.T_map_vehicle),
                            LevelPose(submap.T_map_submap),
                            LevelCovariance(previous),
                            own,
                            Eigen::Matrix3d::Zero());
}

void MapperNode::AddSubmap(Submap submap, std::vector<GraphEdge> position_edges) {
  if (submap.id.value < 0) submap.id.value = next_id_;
  if (submap.id.value < next_id_ || !submap.T_map_submap.matrix().allFinite() ||
      !submap.covariance_from_previous.allFinite() || !std::isfinite(submap.heading_sigma_rad)) {
    health_.Count("submaps_refused");
    return;
  }
  next_id_ = submap.id.value + 1;
  registrations_left_ += config_.loop_closer.overlap.max_pairs;
  const Eigen::Matrix3d R_level_submap = LevelFromBody(submap.T_map_submap);
  if (submap.footprint.empty()) submap.footprint = FootprintOf(submap.cloud, R_level_submap);
  if (submap.predicted_information.isZero(0.0)) {
    submap.predicted_information =
        config_.submap.expected_overlap *
        PredictInformation(
            submap.cloud, R_level_submap, config_.filter.voxel_m, config_.submap.sounding_sigma_m);
  }
  loop_closer_.Add(submap);
  PublishSubmap(submap);
  const auto most = static_cast<std::size_t>(config_.max_waiting_submaps);
  const bool busy = submaps_.size() >= most;
  if (busy) health_.Count("submaps_skipped_busy");
  if (submaps_.size() >= kUnregisteredPerRegistered * most) {
    health_.Count("submaps_not_stored");
    submap.cloud = {};
  }
  submaps_.push_back(
      {std::make_shared<const Submap>(std::move(submap)), std::move(position_edges), busy});
  RegisterNext();
}

void MapperNode::RegisterNext() {
  if (worker_busy_ || submaps_.empty()) return;
  const Waiting& next = submaps_.front();
  Register(
      next.submap,
      next.skip_registration ? std::vector<LoopPair>{} : loop_closer_.PairsFor(next.submap->id));
}

bool MapperNode::LookAgain() {
  if (worker_busy_ || !submaps_.empty()) return false;
  const std::int64_t most =
      std::min<std::int64_t>(registrations_left_, config_.loop_closer.overlap.max_pairs);
  if (most < 1) return false;
  if (AskForCovariances()) return true;
  if (!loop_closer_.HasMoved()) return false;
  std::vector<LoopPair> pairs = loop_closer_.PairsOfMoved(static_cast<int>(most));
  if (!pairs.empty()) Register(nullptr, std::move(pairs));
  return true;
}

// Once a solution, and again where no answer came: request or answer may be lost, or the optimizer
// busy. Not where it has gone on to a solution that is not used here.
bool MapperNode::AskForCovariances() {
  CovarianceRequest request = loop_closer_.request();
  if (request.pairs.empty() || request.graph_version != solution_version_) return false;
  const bool asked = asked_version_ == request.graph_version;
  const bool due =
      last_nav_ && asked_time_ && ToSeconds(*last_nav_ - *asked_time_) > kAskAgainAfterS;
  if (asked && !due) return false;
  asked_version_ = request.graph_version;
  asked_time_ = last_nav_;
  request.from = kName;
  request.seq = covariance_request_seq_++;
  bus_->Publish("COVARIANCE_REQUEST", ToLcm(request, graph_.back().submap_time));
  health_.Count("covariances_asked", static_cast<std::int64_t>(request.pairs.size()));
  return true;
}

void MapperNode::OnCovariances(const covariances_t& msg) {
  if (msg.to != kName || msg.request_seq + 1 != covariance_request_seq_) return;
  const std::optional<PairCovariances> answer = FromLcm(msg);
  if (!answer) {
    health_.Count("covariances_malformed");
    return;
  }
  health_.Count("covariances_answered", static_cast<std::int64_t>(answer->pairs.size()));
  loop_closer_.SetCovariances(*answer);
}

void MapperNode::Register(std::shared_ptr<const Submap> closed, std::vector<LoopPair> pairs) {
  const auto num_pairs = static_cast<std::int64_t>(pairs.size());
  const auto job = [this,
                    archive = archive_,
                    params = config_.loop_closer,
                    closed = std::move(closed),
                    pairs = std::move(pairs)] {
    SurveyStore& store = archive->store;
    if (closed && !closed->cloud.empty()) store.Put(closed);
    const LoadSubmap load = [&](SubmapId id) { return store.Get(id); };
    const auto source = closed || pairs.empty() ? closed : load(pairs.front().source);
    Registered registered{closed, pairs, {}, {}, {}};
    if (closed) registered.surface = SolutionJudge::Surface(*closed);
    if (source) registered.edges = RegisterPairs(*source, pairs, load, params, &archive->prepared);
    registered.store = store.counters();
    return std::function<void()>([this, registered = std::move(registered)]() mutable {
      OnRegistered(std::move(registered));
    });
  };
  worker_busy_ = true;
  registrations_left_ -= num_pairs;
  if (worker_->Post(job)) return;
  worker_busy_ = false;  // a closed submap is tried again with the next message
  registrations_left_ += num_pairs;
  health_.Count("worker_refused");
}

void MapperNode::OnRegistered(Registered registered) {
  worker_busy_ = false;
  GraphUpdate update;
  Time submap_time;
  if (const Submap* submap = registered.closed.get()) {
    const std::vector<GraphEdge> position_edges = std::move(submaps_.front().position_edges);
    submaps_.pop_front();
    submap_time = submap->frame_time;
    update.vertices.push_back({submap->id,
                               submap->frame_time,
                               LevelPose(submap->T_map_submap),
                               submap->heading_sigma_rad});
    update.edges = loop_closer_.DeadReckoningEdge(submap->id);
    update.edges.insert(update.edges.end(), position_edges.begin(), position_edges.end());
    judge_.AddSubmap(*submap, std::move(registered.surface));
  } else {
    submap_time = graph_.back().submap_time;
    health_.Count("pairs_looked_at_again", static_cast<std::int64_t>(registered.pairs.size()));
  }
  for (const LoopPair& pair : registered.pairs) judge_.AddPair(pair.target, pair.source);
  for (const GraphEdge& edge : loop_closer_.Record(registered.pairs, registered.edges))
    update.edges.push_back(edge);
  if (registered.closed || !update.edges.empty()) AddStep(std::move(update), submap_time);

  health_.Count("registrations", static_cast<std::int64_t>(registered.edges.size()));
  health_.Count("registrations_without_target",
                static_cast<std::int64_t>(registered.pairs.size() - registered.edges.size()));
  health_.Set("store_saved", registered.store.saved);
  health_.Set("store_write_errors", registered.store.write_errors);
  health_.Set("store_read_errors", registered.store.read_errors);
  health_.Set("store_lost", registered.store.lost);
  health_.Set("store_cached_kb", registered.store.cached_bytes / 1000);
  ReportHealth();
  RegisterNext();
  AddLastFixes();
}

void MapperNode::AddStep(GraphUpdate update, Time submap_time) {
  update.version = static_cast<std::int64_t>(graph_.size()) + 1;
  update.mounting = config_.mounting;
  graph_.push_back({std::move(update), submap_time});
  SendNextUpdate();
}

// One after the other, so that what was asked for again never overtakes what is new.
bool MapperNode::SendNextUpdate() {
  if (updates_sent_ == graph_.size()) return false;
  const Step& step = graph_[updates_sent_++];
  bus_->Publish("GRAPH_UPDATE", ToLcm(step.update, step.submap_time, update_seq_++));
  return true;
}

void MapperNode::OnGraphRequest(const graph_request_t& msg) {
  if (msg.from == kName) return;  // our own
  health_.Count("graph_requests");
  const auto have = static_cast<std::size_t>(std::max<std::int64_t>(0, msg.have_version));
  updates_sent_ = std::min(updates_sent_, have);
  // Some at once; the rest one by one, as a submap's points.
  for (int i = 0; i < kUpdatesAtOnce && SendNextUpdate(); ++i) {
  }
}

void MapperNode::SendWaiting() {
  SendNextChunk();
  SendNextUpdate();
}

void MapperNode::OnPoseGraph(const pose_graph_t& msg) {
  health_.Tick("pose_graph");
  const std::optional<PoseGraph> graph = pose_graph_.Add(msg);
  health_.Set("pose_graph_malformed", pose_graph_.malformed());
  if (!graph) return;
  if (graph->graph_version > static_cast<std::int64_t>(graph_.size()) ||
      !loop_closer_.IsUsable(*graph)) {
    health_.Count("pose_graph_refused");
    return;
  }
  // An optimizer that began anew is on its way through the graph.
  if (graph->graph_version < solution_version_) {
    health_.Count("pose_graph_older");
    return;
  }
  solution_version_ = graph->graph_version;
  health_.Set("solution_version", solution_version_);
  const Judgement judgement = judge_.Judge(*graph);
  harm_.reset();
  if (judgement.harmful) {
    harm_ = judgement;
    health_.Count("solutions_withheld");
  } else {
    loop_closer_.SetSolution(*graph);
    asked_version_ = 0;
  }
  ReportHealth();
}

void MapperNode::RequestSolution() {
  graph_request_t msg{};
  msg.utime = last_nav_ ? ToUtime(*last_nav_) : 0;
  msg.seq = request_seq_++;
  msg.from = kName;
  msg.have_version = solution_version_;
  bus_->Publish("GRAPH_REQUEST", msg);
  health_.Count("solution_requests");
}

void MapperNode::PublishNav() {
  const std::optional<Time> latest = navigation_.latest();
  if (!latest) return;
  // Half a millisecond less, so that a stamp's rounding does not halve the rate.
  const double due_s = 1.0 / config_.nav_rate_hz - 5e-4;
  if (last_nav_ && *latest >= *last_nav_ && ToSeconds(*latest - *last_nav_) < due_s) return;
  const std::optional<NavState> state = navigation_.StateAt(*latest);
  if (!state) return;
  last_nav_ = *latest;
  bottom_lock_ = state->bottom_lock;
  bus_->Publish("NAV", ToLcm(*state, nav_seq_++));
  health_.Tick("nav");
  ReportHealth();
}

void MapperNode::PublishSubmap(const Submap& submap) {
  // An announcement ends the submap before it: its points go first.
  while (SendNextChunk()) {
  }
  SubmapMessages messages = ToLcm(submap, submap_seq_++, points_seq_);
  points_seq_ += static_cast<std::int64_t>(messages.chunks.size());
  bus_->Publish("SUBMAP", messages.announcement);
  chunks_.assign(std::make_move_iterator(messages.chunks.begin()),
                 std::make_move_iterator(messages.chunks.end()));
  health_.Count(std::string("submaps_by_") + ToString(submap.trigger));
}

bool MapperNode::SendNextChunk() {
  if (chunks_.empty()) return false;
  bus_->Publish("SUBMAP_POINTS", chunks_.front());
  chunks_.pop_front();
  return true;
}

void MapperNode::Finish(const std::function<void()>& pause) {
  while (SendNextChunk()) pause();
  navigation_.Finish();
  GeoreferencePings(true);
  if (std::optional<Submap> last = builder_.Finish()) OnClosed(std::move(*last));
  finishing_ = true;
  AddLastFixes();
  while (SendNextChunk()) pause();
  while (SendNextUpdate()) pause();
  ReportHealth();
}

std::string MapperNode::RejectionText() const {
  std::map<std::string, std::int64_t> counters = builder_.counters();
  counters["beams_refused"] = health_.counter("beams_refused");
  return RejectionOf(health_.counter("beams_read") - health_.counter("beams_invalid"), counters)
      .Text();
}

void MapperNode::ReportHealth() {
  for (const auto& [name, count] : navigation_.counters()) health_.Set("nav_" + name, count);
  for (const auto& [name, count] : builder_.counters()) health_.Set(name, count);
  health_.Set("bus_decode_errors", bus_->decode_errors());
  health_.Set("bus_publish_errors", bus_->publish_errors());
  health_.Set("submaps_waiting", static_cast<std::int64_t>(submaps_.size()));
  health_.Set("loop_closures_accepted", loop_closer_.accepted());
  health_.Set("loop_closures_rejected", loop_closer_.rejected());
  if (!last_nav_ && graph_.empty()) return;
  const std::string figures =
      std::to_string(loop_closer_.size()) + " submaps, " + std::to_string(loop_closer_.accepted()) +
      " loop closures accepted, " + std::to_string(loop_closer_.rejected()) + " rejected, " +
      RejectionText() + (sound_speed_source_ ? Sentence(*sound_speed_source_) : "");
  std::string trouble;
  if (health_.counter("store_write_errors") > 0)
    trouble += "the survey directory cannot be written; ";
  if (harm_) trouble += Sentence(*harm_);
  if (last_nav_ && !bottom_lock_) trouble += "no bottom lock; ";
  const bool profile_missing = sound_speed_source_ && !IsProfile(*sound_speed_source_);
  const bool well = trouble.empty() && !profile_missing;
  health_.SetState(well ? HealthState::kOk : HealthState::kDegraded, trouble + figures);
}

}  // namespace seastitch
