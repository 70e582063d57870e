#include "mapper/mapper.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/level_cloud.hpp"
#include "mapper/submaps/terrain_information.hpp"

namespace seastitch {
namespace {

// Submaps with points in memory that wait behind others, per submap of max_waiting_submaps.
constexpr std::size_t kUnregisteredPerRegistered = 4;
constexpr char kOptimizer[] = "optimizer";

std::shared_ptr<const Submap> WithoutPoints(Submap submap) {
  submap.cloud = {};
  return std::make_shared<const Submap>(std::move(submap));
}

const char* CounterOf(LoopSearch::Verdict verdict) {
  switch (verdict) {
    case LoopSearch::Verdict::kUsed: return "solutions_used";
    case LoopSearch::Verdict::kWithheld: return "solutions_withheld";
    case LoopSearch::Verdict::kRefused: return "pose_graph_refused";
    case LoopSearch::Verdict::kOlder: return "pose_graph_older";
  }
  return "";
}

std::unique_ptr<Navigation> MakeNavigation(const MapperParams& params) {
  if (params.navigation_source == NavigationSource::kGiven)
    return std::make_unique<InsNavigation>(
        params.given_navigation, params.navigation, params.vehicle);
  return std::make_unique<DeadReckoning>(params.navigation, params.vehicle);
}

// Journal entry of a job, without the versions of the graph that it makes.
GraphGrowth GrowthBy(const RegistrationResultSet& results) {
  GraphGrowth growth;
  if (results.job.closed) growth.closed = results.job.closed->id;
  growth.pairs = results.job.pairs;
  growth.registered = results.edges;
  for (const ClosureStatistics& closure : results.statistics)
    growth.statistics.push_back(ToNumbers(closure));
  return growth;
}

// Computes outline and predicted information if the submap has none.
void Complete(const MapperParams& params, Submap* submap) {
  const PointCloud level = LevelCloud(submap->cloud, LevelFromBody(submap->T_map_submap));
  if (submap->footprint.empty()) submap->footprint = FootprintOf(level);
  if (submap->predicted_information) return;
  submap->predicted_information =
      params.submap.expected_overlap *
      PredictInformation(level, params.filter.voxel_m, params.submap.sounding_sigma_m);
}

}  // namespace

bool Mapper::IsUsable(const Submap& submap) {
  return submap.T_map_submap.matrix().allFinite() &&
         !(submap.covariance_from_previous && !submap.covariance_from_previous->allFinite()) &&
         !(submap.heading_sigma_rad && !std::isfinite(*submap.heading_sigma_rad));
}

Mapper::Mapper(const MapperParams& params) : Mapper(params, MakeNavigation(params), true) {}

Mapper::Mapper(const MapperParams& params,
               std::unique_ptr<Navigation> navigation,
               bool own_navigation)
    : params_(params),
      navigation_(std::move(navigation)),
      own_navigation_(own_navigation),
      clocks_(params.navigation.clock_jump_s),
      rewind_(params.navigation.clock_jump_s),
      watch_(params.navigation),
      stamp_offsets_(params.navigation),
      vertical_(params.vertical, params.vehicle),
      sound_speed_(params.sound_velocity_profile),
      pings_(static_cast<std::size_t>(params.max_waiting_pings)),
      sounding_pings_(static_cast<std::size_t>(params.max_waiting_pings)),
      builder_(
          params.submap,
          params.filter,
          [this](Time a, Time b) { return DriftBetween(a, b); },
          [this](Time anchor, Time t) {
            return navigation_->Hindsight(anchor, t).value_or(Pose2{});
          }),
      frames_(navigation_.get()),
      correction_(navigation_.get()),
      search_(params.loop_closer),
      graph_(params.mounting) {}

void Mapper::OnSoundings(std::function<void(SubmapSoundings)> take) {
  on_soundings_ = std::move(take);
  builder_.KeepSoundings();
}

template <class Sample>
void Mapper::Navigate(const Sample& sample) {
  if constexpr (std::is_same_v<Sample, ImuSample> || std::is_same_v<Sample, NavigationSample>)
    newest_input_ = sample.time;
  navigation_->Add(sample);
  watch_.Look(*navigation_);
  ins_monitor_.Look(*navigation_);
  stamp_offsets_.Look(*navigation_);
  GiveNav();
  GeoreferencePings();
}

template void Mapper::Navigate(const ImuSample&);
template void Mapper::Navigate(const DvlSample&);
template void Mapper::Navigate(const DepthSample&);
template void Mapper::Navigate(const PositionFix&);
template void Mapper::Navigate(const NavigationSample&);

void Mapper::Add(const DepthSample& sample) {
  vertical_.Add(sample);
  const std::optional<double> level_m = vertical_.LevelAt(sample.time);
  if (!level_m) return Count("depths_without_height");
  DepthSample in_map = sample;
  in_map.depth_m -= *level_m;
  Navigate(in_map);
}

void Mapper::Add(const NavigationSample& sample) {
  ins_monitor_.Add(sample);
  vertical_.Add(sample);
  NavigationSample in_map = sample;
  if (in_map.depth) {
    const std::optional<double> level_m = vertical_.LevelAt(sample.time);
    if (!level_m) Count("depths_without_height");
    in_map.depth->value_m -= level_m.value_or(0.0);
    if (!level_m) in_map.depth.reset();
  }
  Navigate(in_map);
}

void Mapper::Add(const MbesPing& ping) {
  MbesPing on_time = ping;
  on_time.time = ping.time + FromSeconds(params_.sonar_time_offset_s);
  ins_monitor_.See(on_time.time);
  navigation_->AddSoundSpeed(on_time.time, ping.sound_speed_mps);
  ++pings_received_;
  pings_.Add(std::move(on_time));
  GeoreferencePings();
}

void Mapper::Add(const SoundingPing& ping) {
  ins_monitor_.See(ping.time);
  ++pings_received_;
  sounding_pings_.Add(ping);
  GeoreferencePings();
}

void Mapper::Add(SoundVelocityProfile profile, const MessageStamp& stamp) {
  profile.time = clocks_.InDiveTime(SensorChannel::kSvp, profile.time, stamp);
  AddProfile(profile, clocks_.came_at(SensorChannel::kSvp));
}

void Mapper::AddProfile(const SoundVelocityProfile& profile, Time received) {
  if (!sound_speed_.Add(profile, received)) return Count("svp_unusable");
  events_.emplace_back(JournalEntry(profile));
}

void Mapper::OnHeartbeat(const Heartbeat& heartbeat) {
  clocks_.OnHeartbeat(heartbeat);
  if (heartbeat.process == kOptimizer) optimizer_heard_s_ = clocks_.health_time_s();
  if (!AwaitsSolution())
    unsolved_since_s_.reset();
  else if (!unsolved_since_s_ || unsolved_version_ != search_.solution_version())
    unsolved_since_s_ = clocks_.health_time_s();
  unsolved_version_ = search_.solution_version();
}

bool Mapper::AwaitsSolution() const {
  return search_.solution_version() < graph_.version() &&
         (graph_.HasEnded() || IsSolutionDue(search_.size(), search_.solved()));
}

DiveStage Mapper::Stage() const {
  if (next_id_ > 0) return DiveStage::kMapping;
  if (!last_nav_) return DiveStage::kStarting;
  return own_navigation_ ? DiveStage::kNavigating : DiveStage::kMapping;
}

void Mapper::RestartNavigation() {
  rewind_ = RewindWatch(params_.navigation.clock_jump_s);
  Count("navigation_restarts");
  navigation_ = MakeNavigation(params_);
  frames_ = SubmapFrames(navigation_.get());
  correction_ = NavCorrection(navigation_.get());
  builder_.Finish();
  if (on_soundings_) builder_.TakeSoundings();
  while (pings_.TakeAny()) pings_lost_.Add(PingLoss::kBeforeNavigation);
  while (sounding_pings_.TakeAny()) pings_lost_.Add(PingLoss::kBeforeNavigation);
  watch_ = NavigationWatch(params_.navigation);
  smoothed_until_.reset();
  last_nav_.reset();
  nav_began_.reset();
}

void Mapper::GiveNav() {
  if (!GiveStates()) return;
  // Each pose by what was measured in half a window after it at least.
  const double window_s = params_.navigation.window_s;
  if (!smoothed_until_) smoothed_until_ = last_nav_;
  if (ToSeconds(*last_nav_ - *smoothed_until_) > 0.9 * window_s)
    GiveSmoothed(*last_nav_ - FromSeconds(0.5 * window_s));
  correction_.TakeFixes();
  if (const auto corrected = correction_.Now()) events_.emplace_back(*corrected);
}

void Mapper::GiveSmoothed(Time until) {
  smoothed_until_ = until;
  if (!on_smoothed_) return;
  for (const SmoothedPose& pose : navigation_->TakeSmoothed(until)) on_smoothed_(pose);
}

// Gives the states that are due. An INS's navigation knows those of some seconds at once, because
// positions wait for what follows them. False: none is due.
bool Mapper::GiveStates() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return false;
  // Half a millisecond less than the period, so that the rounding of a stamp does not halve the
  // rate.
  const double period_s = 1.0 / params_.nav_rate_hz;
  if (last_nav_ && *latest >= *last_nav_ && ToSeconds(*latest - *last_nav_) < period_s - 5e-4)
    return false;
  const Duration period = FromSeconds(period_s);
  for (Time t = last_nav_ ? navigation_->AfterGap(*last_nav_ + period) : FirstStateBefore(*latest);
       *latest - t >= period;
       t = navigation_->AfterGap(t + period))
    GiveNavAt(t);
  return GiveNavAt(*latest);
}

// The first instant, in steps of NAV's period back from t, from which on navigation has states.
Time Mapper::FirstStateBefore(Time t) const {
  const Duration period = FromSeconds(1.0 / params_.nav_rate_hz);
  const Time oldest = t - FromSeconds(params_.navigation.window_s);
  while (t - period >= oldest && navigation_->StateAt(t - period)) t -= period;
  return t;
}

bool Mapper::GiveNavAt(Time t) {
  const std::optional<NavState> state = navigation_->StateAt(t);
  if (!state) return false;
  graph_.SetId(params_.graph_id != 0 ? params_.graph_id : ToUtime(state->time));
  last_nav_ = t;
  clocks_.SetStage(Stage());
  if (!nav_began_) nav_began_ = t;
  if (ping_watch_.IsDue(t)) ping_watch_.Look(t, pings_received_, pings_lost());
  events_.emplace_back(*state);
  return true;
}

std::optional<Eigen::Isometry3d> Mapper::PoseAt(Time t) const {
  const std::optional<NavState> state = navigation_->StateAt(t);
  if (!state) return std::nullopt;
  return state->T_map_vehicle;
}

SurveyNoise Mapper::noise() const {
  SurveyNoise noise{search_.noise().estimate(), placer_.timing()};
  noise.timing.configured_s = params_.sonar_time_offset_s;
  noise.timing.placed_by_source = soundings_came_placed_;
  return noise;
}

std::optional<Eigen::Matrix3d> Mapper::DriftBetween(Time a, Time b) const {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return std::nullopt;
  // For instants that navigation has forgotten, the covariance since the oldest one that it
  // remembers.
  const NavigationParams& p = params_.navigation;
  const Time oldest = *latest - FromSeconds(p.window_s - p.key_interval_s);
  return navigation_->RelativeCovariance(std::max(KnownAt(a), oldest),
                                         std::max(KnownAt(b), oldest));
}

void Mapper::OnClosed(Submap submap) {
  correction_.TakeFixes();
  const std::vector<MapFix> fixes = navigation_->TakeFixes(submap.end);
  AddFramesFor(fixes, submap.start);
  submap.id = SubmapId{next_id_};
  if (on_soundings_) {
    SubmapSoundings soundings = builder_.TakeSoundings();
    soundings.id = submap.id;
    on_soundings_(std::move(soundings));
  }
  correction_.Given(fixes, submap.id);
  std::vector<GraphEdge> edges = frames_.Place(&submap, next_id_ == 0, fixes);
  Enqueue(std::move(submap), {OwnChain(), std::move(edges)});
}

void Mapper::AddFramesFor(const std::vector<MapFix>& fixes, std::optional<Time> next) {
  for (Submap& frame : frames_.FramesFor(fixes, next)) {
    frame.id = SubmapId{next_id_};
    frame.dvl_yaw_rad = navigation_->dvl_yaw_rad();
    std::vector<GraphEdge> edges = frames_.Place(&frame, next_id_ == 0, {});
    Enqueue(std::move(frame), {OwnChain(), std::move(edges)});
  }
}

void Mapper::AddSubmap(Submap submap, OfDive dive) {
  if (submap.id.value < 0) submap.id.value = next_id_;
  if (submap.id.value < next_id_ || !IsUsable(submap)) return Count("submaps_refused");
  frames_.Forget();
  Enqueue(std::move(submap), std::move(dive));
}

void Mapper::Enqueue(Submap submap, OfDive dive) {
  next_id_ = submap.id.value + 1;
  clocks_.SetStage(Stage());
  if (HasSoundings(submap.trigger) && (submap.footprint.empty() || !submap.predicted_information))
    Complete(params_, &submap);
  search_.Add(submap, dive.chain);
  Count(std::string("submaps_by_") + ToString(submap.trigger));
  const auto most = static_cast<std::size_t>(params_.max_waiting_submaps);
  const bool skip = submaps_.size() >= most;
  const bool keep_points = submaps_.size() < kUnregisteredPerRegistered * most;
  if (skip) Count("submaps_skipped_busy");
  const auto closed = std::make_shared<const Submap>(std::move(submap));
  events_.emplace_back(JournalEntry(ClosedSubmap{closed, dive.position_edges, skip}));
  events_.emplace_back(closed);
  submaps_.push_back({keep_points ? closed : WithoutPoints(*closed), std::move(dive), skip});
}

std::optional<RegistrationJob> Mapper::NextJob() {
  if (job_is_out_) return std::nullopt;
  RegistrationJob job;
  if (!submaps_.empty()) {
    job.closed = submaps_.front().submap;
    if (!submaps_.front().skip_registration) job.pairs = search_.PairsFor(job.closed->id);
  } else if (!again_.empty()) {
    job.pairs = std::move(again_);
    again_.clear();
  } else {
    return std::nullopt;
  }
  job.noise = search_.noise().components();
  job_is_out_ = true;
  return job;
}

void Mapper::Take(RegistrationResultSet results) {
  job_is_out_ = false;
  std::vector<GraphVertex> vertices;
  std::vector<GraphEdge> edges;
  std::vector<RegistrationResultSet> replayed_jobs;
  Time submap_time;
  if (const Submap* submap = results.job.closed.get()) {
    OfDive dive = std::move(submaps_.front().dive);
    submaps_.pop_front();
    submap_time = submap->frame_time;
    vertices.push_back({submap->id,
                        submap->frame_time,
                        LevelPose(submap->T_map_submap),
                        submap->heading_sigma_rad,
                        dive.chain.number});
    graph_.SetMounting(dive.chain.mounting);
    edges = search_.DeadReckoningEdge(submap->id);
    edges.insert(edges.end(), dive.position_edges.begin(), dive.position_edges.end());
    replayed_jobs = std::move(dive.replayed_jobs);
  } else {
    submap_time = graph_.submap_time();
    Count("pairs_retried", static_cast<std::int64_t>(results.job.pairs.size()));
  }
  const auto registered = static_cast<std::int64_t>(results.edges.size());
  const auto pairs = static_cast<std::int64_t>(results.job.pairs.size());
  Count("registrations", registered);
  Count("registrations_failed", results.failed);
  failed_in_last_job_ = results.failed;
  GraphGrowth growth = GrowthBy(results);
  Count("registrations_without_result", pairs - registered);
  const std::vector<GraphEdge> closures = search_.Record(std::move(results));
  edges.insert(edges.end(), closures.begin(), closures.end());
  Extend(std::move(vertices), std::move(edges), submap_time, std::move(growth));
  for (RegistrationResultSet& job : replayed_jobs) RecordMade(std::move(job), submap_time);
}

void Mapper::RecordMade(RegistrationResultSet results, Time submap_time) {
  Count("registrations_of_finished_maps", static_cast<std::int64_t>(results.job.pairs.size()));
  GraphGrowth growth = GrowthBy(results);
  Extend({}, search_.Restore(std::move(results)), submap_time, std::move(growth));
}

bool Mapper::LookAgain() {
  if (job_is_out_ || !submaps_.empty() || !again_.empty()) return false;
  std::optional<LoopSearch::Step> step = search_.LookAgain(last_nav_);
  if (!step) return false;
  if (step->ask) {
    step->ask->graph_id = graph_.graph_id();
    Count("covariances_asked", static_cast<std::int64_t>(step->ask->pairs.size()));
    events_.emplace_back(CovarianceQuestion{*std::move(step->ask), graph_.submap_time()});
  }
  again_ = std::move(step->pairs);
  return true;
}

bool Mapper::Take(const PoseGraph& solution) {
  if (solution.graph_id != graph_.graph_id()) {
    Count("pose_graph_refused");
    if (!graph_.empty()) solution_refused_ = "it is of another graph";
    return false;
  }
  const LoopSearch::Verdict verdict = search_.Take(solution, graph_.version());
  Count(CounterOf(verdict));
  const bool is_refused = verdict == LoopSearch::Verdict::kRefused;
  solution_refused_ = is_refused ? "it is not finite, or not of these submaps" : "";
  if (verdict != LoopSearch::Verdict::kUsed) return false;
  correction_.Take(solution);
  return true;
}

bool Mapper::Take(const PairCovariances& answer) {
  if (answer.graph_id != graph_.graph_id() || !search_.Take(answer)) return false;
  Count("covariances_answered", static_cast<std::int64_t>(answer.pairs.size()));
  return true;
}

// Sends a graph step. The last step also contains the fixes that no further submap will bring, and
// marks the end of the graph.
void Mapper::Extend(std::vector<GraphVertex> vertices,
                    std::vector<GraphEdge> edges,
                    Time submap_time,
                    GraphGrowth growth) {
  const bool last = IsLastStep();
  std::vector<GraphEdge> fixes;
  if (last && navigation_->latest())
    fixes = frames_.EdgesOf(navigation_->TakeFixes(*navigation_->latest()));
  graph_.Append(std::move(vertices), std::move(edges), submap_time, last && fixes.empty());
  if (!fixes.empty()) graph_.Append({}, std::move(fixes), graph_.submap_time(), last);
  GiveGraph(std::move(growth));
}

bool Mapper::IsLastStep() const {
  return finishing_ && !job_is_out_ && submaps_.empty() && !graph_.HasEnded();
}

void Mapper::GiveGraph(GraphGrowth growth) {
  while (const GraphStep* step = graph_.After(graph_given_)) {
    graph_given_ = step->update.version;
    AddToCorrection(step->update);
    growth.steps.push_back(*step);
  }
  events_.emplace_back(JournalEntry(growth));
  for (GraphStep& step : growth.steps) events_.emplace_back(std::move(step));
}

void Mapper::AddToCorrection(const GraphUpdate& update) {
  correction_.Add(update);
  for (const GraphEdge& edge : update.edges)
    fixes_in_graph_ += edge.kind == EdgeKind::kPositionFix ? 1 : 0;
}

void Mapper::Finish() {
  navigation_->Finish();
  GiveStates();
  if (const std::optional<Time> latest = navigation_->latest()) GiveSmoothed(*latest);
  GeoreferencePings();
  while (const std::optional<MbesPing> ping = pings_.TakeAny()) AddToSubmap(*ping);
  while (const std::optional<SoundingPing> ping = sounding_pings_.TakeAny()) AddToSubmap(*ping);
  if (std::optional<Submap> last = builder_.Finish()) OnClosed(std::move(*last));
  if (next_id_ > 0) AddFramesFor(navigation_->WaitingFixes(), std::nullopt);
  finishing_ = true;
  if (IsLastStep() && !graph_.empty()) Extend({}, {}, graph_.submap_time(), {});
}

std::vector<MapperEvent> Mapper::TakeEvents() { return std::exchange(events_, {}); }

}  // namespace seastitch
