#include "mapper/mapper.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "mapper/navigation/dead_reckoning.hpp"
#include "mapper/navigation/given_navigation.hpp"
#include "mapper/submaps/footprint.hpp"
#include "mapper/submaps/level_cloud.hpp"
#include "mapper/submaps/rejection.hpp"
#include "mapper/submaps/terrain_information.hpp"
#include "mapper/utc_text.hpp"

namespace seastitch {
namespace {

// Submaps with points in memory that wait behind others, per submap of max_waiting_submaps.
constexpr std::size_t kUnregisteredPerRegistered = 4;
// Time without NAV that is reported [s].
constexpr double kNoNavS = 2.0;
constexpr char kOptimizer[] = "optimizer";
constexpr double kNoOptimizerS = 10.0;  // it may be started later than the mapper

bool IsProfile(SoundSpeed::Source source) {
  return source == SoundSpeed::Source::kProfile || source == SoundSpeed::Source::kConfigured;
}

const char* Sentence(SoundSpeed::Source source) {
  switch (source) {
    case SoundSpeed::Source::kProfile: return "sound speed from a profile";
    case SoundSpeed::Source::kConfigured: return "sound speed from the configured profile";
    case SoundSpeed::Source::kTransducer: return "sound speed from the transducer alone";
    case SoundSpeed::Source::kAssumed: return "sound speed assumed";
  }
  return "";
}

std::string Sentence(const Judgement& harm) {
  char text[200];
  if (harm.torn)
    std::snprintf(text,
                  sizeof text,
                  "it would tear the map apart (%zu cells seen twice in place of %zu by dead "
                  "reckoning)",
                  harm.cells_solved,
                  harm.cells_dead_reckoned);
  else
    std::snprintf(text,
                  sizeof text,
                  "it would make the map less consistent than dead reckoning (%.3f m in place of "
                  "%.3f m)",
                  harm.solved_m,
                  harm.dead_reckoned_m);
  return text;
}

bool IsUsable(const Submap& submap) {
  return submap.T_map_submap.matrix().allFinite() &&
         !(submap.covariance_from_previous && !submap.covariance_from_previous->allFinite()) &&
         !(submap.heading_sigma_rad && !std::isfinite(*submap.heading_sigma_rad));
}

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
    return std::make_unique<GivenNavigation>(
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

Mapper::Mapper(const MapperParams& params) : Mapper(params, MakeNavigation(params)) {}

Mapper::Mapper(const MapperParams& params, std::unique_ptr<Navigation> navigation)
    : params_(params),
      navigation_(std::move(navigation)),
      clocks_(params.navigation.clock_jump_s),
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

void Mapper::OnSoundings(std::function<void(const SubmapSoundings&)> take) {
  on_soundings_ = std::move(take);
  builder_.KeepSoundings();
}

template <class Sample>
void Mapper::Navigate(const Sample& sample) {
  navigation_->Add(sample);
  watch_.Look(*navigation_);
  given_watch_.Look(*navigation_);
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
  given_watch_.Add(sample);
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
  given_watch_.See(on_time.time);
  navigation_->AddSoundSpeed(on_time.time, ping.sound_speed_mps);
  ++pings_received_;
  pings_.Add(std::move(on_time));
  GeoreferencePings();
}

void Mapper::Add(const SoundingPing& ping) {
  given_watch_.See(ping.time);
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

void Mapper::Hear(const std::string& process, double uptime_s) {
  clocks_.Hear(process, uptime_s);
  if (process == kOptimizer) optimizer_heard_s_ = clocks_.health_time_s();
}

void Mapper::GiveNav() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return;
  // Half a millisecond less than the period, so that the rounding of a stamp does not halve the
  // rate.
  const double due_s = 1.0 / params_.nav_rate_hz - 5e-4;
  if (last_nav_ && *latest >= *last_nav_ && ToSeconds(*latest - *last_nav_) < due_s) return;
  if (!GiveNavAt(*latest)) return;
  correction_.TakeFixes();
  if (const auto corrected = correction_.Now()) events_.emplace_back(*corrected);
}

// The states of the last seconds, which an INS's navigation knows only at the end.
void Mapper::GiveLastNav() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest || !last_nav_) return;
  const Duration period = FromSeconds(1.0 / params_.nav_rate_hz);
  for (Time t = *last_nav_ + period; t <= *latest; t += period) GiveNavAt(t);
}

bool Mapper::GiveNavAt(Time t) {
  const std::optional<NavState> state = navigation_->StateAt(t);
  if (!state) return false;
  graph_.SetId(state->time);
  last_nav_ = t;
  if (!nav_began_) nav_began_ = t;
  if (ping_watch_.IsDue(t)) ping_watch_.Look(t, pings_received_, PingsRefused());
  events_.emplace_back(*state);
  return true;
}

void Mapper::GeoreferencePings() {
  const std::optional<Time> latest = navigation_->latest();
  if (!latest) return;
  while (const std::optional<MbesPing> ping = pings_.Take(*latest)) AddToSubmap(*ping);
  while (const std::optional<SoundingPing> ping = sounding_pings_.Take(*latest)) AddToSubmap(*ping);
}

void Mapper::AddToSubmap(const MbesPing& ping) {
  const SoundSpeed::Choice sound_speed = sound_speed_.For(ping);
  sound_speed_source_ = sound_speed.source;
  if (!IsProfile(sound_speed.source)) Count("pings_without_profile");
  const std::optional<GeoreferencedPing> georeferenced = Georeference(
      ping, [this](Time t) { return PoseAt(t); }, params_.vehicle, *sound_speed.rays);
  if (!georeferenced) return RefuseWithoutPose(ping.time);
  if (georeferenced->speed_from_profile) Count("pings_with_impossible_sound_speed");
  if (georeferenced->beams_of_unknown_part > 0)
    Count("beams_of_unknown_transmit_array", georeferenced->beams_of_unknown_part);
  AddToSubmap(*georeferenced);
}

void Mapper::AddToSubmap(const SoundingPing& ping) {
  const std::optional<NavState> state = navigation_->StateAt(ping.time);
  if (!state) return RefuseWithoutPose(ping.time);
  soundings_came_placed_ = true;
  AddToSubmap(Georeference(ping, state->T_map_vehicle, state->v_map_mps.head<2>().norm()));
}

void Mapper::AddToSubmap(const GeoreferencedPing& ping) {
  Count("beams_read", ping.beams_read);
  Count("beams_invalid", ping.beams_invalid);
  Count("beams_refused", ping.beams_refused);
  timing_.Add(ping, [this](Time t) { return PoseAt(t); });
  if (std::optional<Submap> closed = builder_.Add(ping)) OnClosed(std::move(*closed));
  if (const auto frame_time = builder_.frame_time()) frames_.Remember(*frame_time, ping.time);
}

// Without a pose before navigation started, or before a restart: no fault.
void Mapper::RefuseWithoutPose(Time ping) {
  const bool is_early = nav_began_ && ping < *nav_began_;
  Count(is_early ? "pings_before_navigation" : "pings_without_pose");
}

PingWatch::Counts Mapper::PingsRefused() const {
  PingWatch::Counts refused = builder_.counters();
  refused["pings_dropped_waiting"] = pings_.dropped() + sounding_pings_.dropped();
  refused["pings_from_the_future"] = pings_.from_the_future() + sounding_pings_.from_the_future();
  const auto without_pose = counters_.find("pings_without_pose");
  if (without_pose != counters_.end()) refused.insert(*without_pose);
  return refused;
}

std::optional<Eigen::Isometry3d> Mapper::PoseAt(Time t) const {
  const std::optional<NavState> state = navigation_->StateAt(t);
  if (!state) return std::nullopt;
  return state->T_map_vehicle;
}

SurveyNoise Mapper::noise() const {
  SurveyNoise noise{search_.noise().estimate(), timing_.estimate()};
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
  submap.id = SubmapId{next_id_};
  if (on_soundings_) {
    SubmapSoundings soundings = builder_.TakeSoundings();
    soundings.id = submap.id;
    on_soundings_(soundings);
  }
  correction_.TakeFixes();
  const std::vector<MapFix> fixes = navigation_->TakeFixes(submap.end);
  correction_.Given(fixes, submap.id);
  std::vector<GraphEdge> edges = frames_.Place(&submap, next_id_ == 0, fixes);
  Enqueue(std::move(submap), {OwnChain(), std::move(edges)});
}

void Mapper::AddSubmap(Submap submap, OfDive dive) {
  if (submap.id.value < 0) submap.id.value = next_id_;
  if (submap.id.value < next_id_ || !IsUsable(submap)) return Count("submaps_refused");
  frames_.Forget();
  Enqueue(std::move(submap), std::move(dive));
}

void Mapper::Enqueue(Submap submap, OfDive dive) {
  next_id_ = submap.id.value + 1;
  if (submap.footprint.empty() || !submap.predicted_information) Complete(params_, &submap);
  search_.Add(submap, dive.chain);
  Count(std::string("submaps_by_") + ToString(submap.trigger));
  const auto most = static_cast<std::size_t>(params_.max_waiting_submaps);
  const bool skip = submaps_.size() >= most;
  const bool keep_points = submaps_.size() < kUnregisteredPerRegistered * most;
  if (skip) Count("submaps_skipped_busy");
  const auto closed = std::make_shared<const Submap>(std::move(submap));
  events_.emplace_back(
      JournalEntry(ClosedSubmap{closed, dive.position_edges, skip, CheckpointNow()}));
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
  std::vector<RegistrationResultSet> made;
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
    made = std::move(dive.made);
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
  for (RegistrationResultSet& job : made) RecordMade(std::move(job), submap_time);
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
    correction_.Add(step->update);
    growth.steps.push_back(*step);
  }
  events_.emplace_back(JournalEntry(growth));
  for (GraphStep& step : growth.steps) events_.emplace_back(std::move(step));
}

void Mapper::Finish() {
  navigation_->Finish();
  GiveLastNav();
  GeoreferencePings();
  while (const std::optional<MbesPing> ping = pings_.TakeAny()) AddToSubmap(*ping);
  while (const std::optional<SoundingPing> ping = sounding_pings_.TakeAny()) AddToSubmap(*ping);
  if (std::optional<Submap> last = builder_.Finish()) OnClosed(std::move(*last));
  finishing_ = true;
  if (IsLastStep() && !graph_.empty()) Extend({}, {}, graph_.submap_time(), {});
}

// --- over a restart ------------------------------------------------------------------------------

std::optional<Checkpoint> Mapper::MakeCheckpoint() {
  if (!navigation_->latest()) return std::nullopt;
  return CheckpointNow();
}

Checkpoint Mapper::CheckpointNow() {
  Checkpoint checkpoint;
  checkpoint.number = ++checkpoint_number_;
  checkpoint.time = navigation_->latest().value_or(Time());
  checkpoint.graph_id = graph_.graph_id();
  checkpoint.next_submap = next_id_;
  if (auto saved = navigation_->Save(frames_.previous_time()))
    checkpoint.navigation = *std::move(saved);
  ArchiveWriter archive;
  archive(frames_, builder_);
  checkpoint.frames = archive.Release();
  ArchiveWriter clocks;
  clocks(clocks_);
  checkpoint.clocks = clocks.Release();
  return checkpoint;
}

SensorClocks Mapper::ClocksOf(const Checkpoint& checkpoint) const {
  SensorClocks clocks(params_.navigation.clock_jump_s);
  ArchiveReader archive(checkpoint.clocks);
  archive(clocks);
  return archive.IsDone() ? clocks : SensorClocks(params_.navigation.clock_jump_s);
}

bool Mapper::Resume(const SavedMap& saved,
                    const LoadSubmap& load,
                    const std::function<void()>& progress) {
  const Checkpoint& checkpoint = saved.checkpoint;
  if (next_id_ > 0 || !navigation_->Restore(checkpoint.navigation)) return false;
  ArchiveReader archive(checkpoint.frames);
  archive(frames_, builder_);
  constexpr auto kJudged = static_cast<std::int32_t>(SolutionJudge::kMaxSubmaps);
  const SubmapId first_judged{checkpoint.next_submap - kJudged};
  load_ = [&](SubmapId id) { return id < first_judged ? nullptr : load(id); };
  const auto restore = [this](const auto& entry) {
    try {
      return Restore(entry);
    } catch (const std::invalid_argument&) {  // unreadable statistics
      return false;
    }
  };
  std::size_t restored = 0;
  while (restored < saved.journal.size() && std::visit(restore, saved.journal[restored])) {
    ++restored;
    progress();
  }
  load_ = nullptr;
  Count("journal_entries_unusable", static_cast<std::int64_t>(saved.journal.size() - restored));
  // The frame that navigation refers to is not that of the last submap here: part of the journal is
  // lost.
  if (!archive.IsDone() || next_id_ != checkpoint.next_submap) frames_.Forget();
  next_id_ = std::max(next_id_, checkpoint.next_submap);
  checkpoint_number_ = checkpoint.number;
  clocks_ = ClocksOf(checkpoint);
  resumed_ = Resumed{checkpoint.time, frames_.previous_time()};
  graph_.SetId(FromUtime(checkpoint.graph_id));
  graph_.Resume();
  graph_given_ = graph_.version();
  for (Waiting& waiting : submaps_)
    if (const auto submap = load(waiting.submap->id)) waiting.submap = submap;
  Count("submaps_resumed", static_cast<std::int64_t>(search_.size()));
  return true;
}

bool Mapper::Restore(const SoundVelocityProfile& profile) { return sound_speed_.Add(profile); }

bool Mapper::Restore(const ClosedSubmap& closed) {
  if (closed.submap->id.value < next_id_ || !IsUsable(*closed.submap)) return false;
  next_id_ = closed.submap->id.value + 1;
  search_.Add(*closed.submap, OwnChain());
  submaps_.push_back(
      {closed.submap, {OwnChain(), closed.position_edges}, closed.skip_registration});
  return true;
}

// All checks come before the first change.
bool Mapper::Restore(const GraphGrowth& growth) {
  std::vector<ClosureStatistics> statistics;
  for (const std::vector<double>& numbers : growth.statistics)
    statistics.push_back(ClosureStatisticsFromNumbers(numbers));
  for (const LoopPair& pair : growth.pairs)
    if (!search_.Has(pair.target) || !search_.Has(pair.source)) return false;
  std::int64_t version = graph_.version();
  for (const GraphStep& step : growth.steps)
    if (step.update.version != ++version) return false;
  RegistrationResultSet results;
  if (growth.closed.value >= 0) {
    if (submaps_.empty() || submaps_.front().submap->id != growth.closed) return false;
    submaps_.pop_front();
    const RegistrationJob closed{load_(growth.closed), {}};
    if (closed.closed) results = Run(closed, params_.loop_closer, load_, nullptr);
  }
  for (const GraphStep& step : growth.steps) {
    graph_.Restore(step);
    correction_.Add(step.update);
  }
  results.job.pairs = growth.pairs;
  results.edges = growth.registered;
  results.statistics = std::move(statistics);
  search_.Restore(std::move(results));
  return true;
}

// The instant to use for t in navigation's covariances: one that navigation remembers, with as much
// drift since then as since t. At a restart navigation forgets all frames except the last.
Time Mapper::KnownAt(Time t) const {
  if (!resumed_ || t >= resumed_->at) return t;
  const Time since = resumed_->since.value_or(resumed_->at);
  const Time oldest = *navigation_->latest() - FromSeconds(params_.navigation.window_s);
  return since > oldest ? since : resumed_->at;
}

std::vector<MapperEvent> Mapper::TakeEvents() { return std::exchange(events_, {}); }

std::vector<Condition> Mapper::conditions() const {
  std::vector<Condition> now;
  if (const auto& harm = search_.harm())
    now.push_back({&conditions::kSolutionWithheld, Sentence(*harm)});
  if (!solution_refused_.empty())
    now.push_back({&conditions::kSolutionsRefused, solution_refused_});
  const bool given = params_.navigation_source == NavigationSource::kGiven;
  const std::vector<Condition> of_navigation =
      given ? given_watch_.conditions(*navigation_) : watch_.conditions(*navigation_);
  now.insert(now.end(), of_navigation.begin(), of_navigation.end());
  const std::vector<Condition> of_clocks = clocks_.conditions();
  now.insert(now.end(), of_clocks.begin(), of_clocks.end());
  const std::vector<Condition> of_pings = ping_watch_.conditions();
  now.insert(now.end(), of_pings.begin(), of_pings.end());
  if (nav_came_at_ && ToSeconds(*clocks_.newest() - *nav_came_at_) > kNoNavS)
    now.push_back({&conditions::kNoNavigation, "since " + UtcOf(*last_nav_)});
  if (vertical_.IsMissed()) now.push_back({&conditions::kNoWaterLevel, ""});
  if (clocks_.health_time_s() - optimizer_heard_s_ > kNoOptimizerS &&
      search_.solution_version() < graph_.version())
    now.push_back({&conditions::kNoOptimizer,
                   "solved up to version " + std::to_string(search_.solution_version()) + " of " +
                       std::to_string(graph_.version())});
  if (sound_speed_source_ && !IsProfile(*sound_speed_source_))
    now.push_back({&conditions::kNoSoundSpeedProfile, Sentence(*sound_speed_source_)});
  if (failed_in_last_job_ > 0)
    now.push_back({&conditions::kRegistrationFailed, std::to_string(failed_in_last_job_)});
  return now;
}

std::string Mapper::WaitsFor() const {
  return "waiting for navigation: " + Explain(navigation_->start_state());
}

std::map<std::string, std::int64_t> Mapper::counters() const {
  std::map<std::string, std::int64_t> all = counters_;
  for (const auto& [name, count] : navigation_->counters()) all["nav_" + name] = count;
  for (const auto& [name, count] : PingsRefused()) all[name] = count;
  for (const auto& [name, count] : clocks_.counters()) all[name] = count;
  all["position_fixes_in_graph"] = frames_.fixes_in_graph();
  all["position_fixes_too_far"] = frames_.fixes_too_far();
  all["relative_covariances_missing"] = frames_.independent();
  all["pings_waiting"] = static_cast<std::int64_t>(pings_.size() + sounding_pings_.size());
  all["submaps_waiting"] = static_cast<std::int64_t>(submaps_.size());
  all["solution_version"] = search_.solution_version();
  all["loop_closures_accepted"] = search_.accepted();
  all["loop_closures_rejected"] = search_.rejected();
  return all;
}

std::string Mapper::Summary() const {
  std::map<std::string, std::int64_t> refused = builder_.counters();
  const auto count = [this](const char* name) {
    const auto found = counters_.find(name);
    return found == counters_.end() ? 0 : found->second;
  };
  refused["beams_refused"] = count("beams_refused");
  const Rejection rejection = RejectionOf(count("beams_read") - count("beams_invalid"), refused);
  std::string summary = std::to_string(search_.size()) + " submaps, " +
                        std::to_string(search_.accepted()) + " loop closures accepted, " +
                        std::to_string(search_.rejected()) + " rejected, " + rejection.Text();
  if (sound_speed_source_ && IsProfile(*sound_speed_source_))
    summary += std::string("; ") + Sentence(*sound_speed_source_);
  return summary;
}

}  // namespace seastitch
